#include "allocator.h"

#include <errno.h>

// The C library's own, under the names by which they can be called when the usual ones are replaced.
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);
void __libc_free(void* memory);

static struct {
  bool armed, failed;
  enum failing failing;
  size_t first, count;
} plan;
static long live;

void allocator_arm(enum failing failing, size_t first) {
  plan.failed = false;
  plan.failing = failing;
  plan.first = first;
  plan.count = 0;
  __atomic_store_n(&plan.armed, true, __ATOMIC_RELEASE);
}

bool allocator_disarm(void) {
  __atomic_store_n(&plan.armed, false, __ATOMIC_RELEASE);
  return plan.failed;
}

size_t allocator_count(void) { return plan.count; }

long allocator_live(void) { return __atomic_load_n(&live, __ATOMIC_RELAXED); }

static bool fails(void) {
  if (!__atomic_load_n(&plan.armed, __ATOMIC_ACQUIRE)) return false;
  const size_t number = __atomic_fetch_add(&plan.count, 1, __ATOMIC_RELAXED);
  if (plan.failing == ONE ? number != plan.first : number < plan.first) return false;
  __atomic_store_n(&plan.failed, true, __ATOMIC_RELAXED);
  errno = ENOMEM;
  return true;
}

static void* counted(void* memory) {
  if (memory) __atomic_add_fetch(&live, 1, __ATOMIC_RELAXED);
  return memory;
}

void* malloc(size_t size) { return fails() ? NULL : counted(__libc_malloc(size)); }

void* calloc(size_t number, size_t size) { return fails() ? NULL : counted(__libc_calloc(number, size)); }

void* realloc(void* memory, size_t size) {
  if (fails()) return NULL;
  void* moved = __libc_realloc(memory, size);
  return memory ? moved : counted(moved);
}

void* memalign(size_t alignment, size_t size) { return fails() ? NULL : counted(__libc_memalign(alignment, size)); }

void* aligned_alloc(size_t alignment, size_t size) { return memalign(alignment, size); }

int posix_memalign(void** memory, size_t alignment, size_t size) {
  void* block = memalign(alignment, size);
  if (!block) return ENOMEM;
  *memory = block;
  return 0;
}

void free(void* memory) {
  if (memory) __atomic_sub_fetch(&live, 1, __ATOMIC_RELAXED);
  __libc_free(memory);
}

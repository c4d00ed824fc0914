#define _GNU_SOURCE  // dl_iterate_phdr, RTLD_NEXT
#include "allocator.h"

#include <dlfcn.h>
#include <errno.h>
#include <link.h>
#include <malloc.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

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
static long live, bytes;
static struct {
  bool chosen;  // false: all allocations fail
  struct {
    uintptr_t function, begin, end;  // an address in a library whose allocations fail, and its code
  } libraries[ALLOCATOR_LIBRARIES];
  pthread_mutex_t mutex;
  void* blocks[1 << 12];  // theirs, in no order
  size_t count;
} only = {.mutex = PTHREAD_MUTEX_INITIALIZER};
static __thread bool refused;  // the next allocation, of operator new

static int find_code(struct dl_phdr_info* library, size_t size, void* data) {
  (void)size, (void)data;
  for (int i = 0; i < library->dlpi_phnum; ++i) {
    const ElfW(Phdr)* part = &library->dlpi_phdr[i];
    const uintptr_t begin = library->dlpi_addr + part->p_vaddr;
    for (int j = 0; j < ALLOCATOR_LIBRARIES; ++j) {
      if (part->p_type != PT_LOAD || only.libraries[j].function - begin >= part->p_memsz) continue;
      only.libraries[j].begin = begin;
      only.libraries[j].end = begin + part->p_memsz;
    }
  }
  return 0;
}

void allocator_only(void (*const functions[ALLOCATOR_LIBRARIES])(void)) {
  memset(only.libraries, 0, sizeof only.libraries);
  only.count = 0;
  only.chosen = functions;
  if (!functions) return;
  for (int i = 0; i < ALLOCATOR_LIBRARIES; ++i) only.libraries[i].function = (uintptr_t)functions[i];
  dl_iterate_phdr(find_code, NULL);
}

static bool is_chosen(const void* caller) {
  for (int i = 0; i < ALLOCATOR_LIBRARIES; ++i)
    if ((uintptr_t)caller >= only.libraries[i].begin && (uintptr_t)caller < only.libraries[i].end) return true;
  return false;
}

static void* keep(void* memory, const void* caller) {
  if (!memory || !is_chosen(caller)) return memory;
  pthread_mutex_lock(&only.mutex);
  if (only.count == sizeof only.blocks / sizeof *only.blocks) abort();
  only.blocks[only.count++] = memory;
  pthread_mutex_unlock(&only.mutex);
  return memory;
}

static void forget(const void* memory) {
  if (!memory || !only.chosen) return;
  pthread_mutex_lock(&only.mutex);
  for (size_t i = 0; i < only.count; ++i)
    if (only.blocks[i] == memory) only.blocks[i] = only.blocks[--only.count];
  pthread_mutex_unlock(&only.mutex);
}

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

long allocator_live(void) { return only.chosen ? (long)only.count : __atomic_load_n(&live, __ATOMIC_RELAXED); }

long allocator_bytes(void) { return __atomic_load_n(&bytes, __ATOMIC_RELAXED); }

static void count(void* memory, int sign) {
  if (!memory) return;
  __atomic_add_fetch(&live, sign, __ATOMIC_RELAXED);
  __atomic_add_fetch(&bytes, sign * (long)malloc_usable_size(memory), __ATOMIC_RELAXED);
}

static bool fails(const void* caller) {
  if (refused) {
    refused = false;
    return true;
  }
  if (!__atomic_load_n(&plan.armed, __ATOMIC_ACQUIRE)) return false;
  if (only.chosen && !is_chosen(caller)) return false;
  const size_t number = __atomic_fetch_add(&plan.count, 1, __ATOMIC_RELAXED);
  if (plan.failing == ONE ? number != plan.first : number < plan.first) return false;
  __atomic_store_n(&plan.failed, true, __ATOMIC_RELAXED);
  errno = ENOMEM;
  return true;
}

#define CALLER __builtin_return_address(0)

static void* counted(void* memory, const void* caller) {
  count(memory, 1);
  return keep(memory, caller);
}

void* malloc(size_t size) { return fails(CALLER) ? NULL : counted(__libc_malloc(size), CALLER); }

void* calloc(size_t number, size_t size) { return fails(CALLER) ? NULL : counted(__libc_calloc(number, size), CALLER); }

void* realloc(void* memory, size_t size) {
  if (fails(CALLER)) return NULL;
  forget(memory);
  count(memory, -1);
  void* moved = __libc_realloc(memory, size);
  counted(moved || size == 0 ? moved : memory, CALLER);
  return moved;
}

static void* aligned(size_t alignment, size_t size, const void* caller) {
  return fails(caller) ? NULL : counted(__libc_memalign(alignment, size), caller);
}

void* memalign(size_t alignment, size_t size) { return aligned(alignment, size, CALLER); }

void* aligned_alloc(size_t alignment, size_t size) { return aligned(alignment, size, CALLER); }

// operator new(size_t), which calls malloc from the C++ library whoever called it.
void* _Znwm(size_t size) {
  static void* (*next)(size_t);
  if (!next) {
    void* found = dlsym(RTLD_NEXT, "_Znwm");
    memcpy(&next, &found, sizeof next);
  }
  refused = only.chosen && fails(CALLER);
  return keep(next(size), CALLER);
}

int posix_memalign(void** memory, size_t alignment, size_t size) {
  void* block = aligned(alignment, size, CALLER);
  if (!block) return ENOMEM;
  *memory = block;
  return 0;
}

void free(void* memory) {
  count(memory, -1);
  forget(memory);
  __libc_free(memory);
}

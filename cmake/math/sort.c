// qsort and qsort_r that keep the order of equal elements, as glibc's do: other C libraries give other orders.
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef int compare_function(const void* a, const void* b, void* context);

// Merges the sorted runs [from, middle) and [middle, end) of elements into `to`.
static void merge(const char* from, const char* middle, const char* end, size_t size, compare_function* compare,
                  void* context, char* to) {
  const char* right = middle;
  while (from < middle && right < end) {
    const char** taken = compare(from, right, context) <= 0 ? &from : &right;
    memcpy(to, *taken, size);
    *taken += size;
    to += size;
  }
  memcpy(to, from, (size_t)(middle - from));
  memcpy(to + (middle - from), right, (size_t)(end - right));
}

// Needs no memory, but time that grows with the square of the count.
static void insert_each(char* base, size_t count, size_t size, compare_function* compare, void* context) {
  for (size_t i = 1; i < count; ++i)
    for (char* at = base + i * size; at > base && compare(at - size, at, context) > 0; at -= size)
      for (size_t byte = 0; byte < size; ++byte) {
        const char held = at[byte];
        at[byte] = at[byte - size];
        at[byte - size] = held;
      }
}

void mjenv_qsort_r(void* base, size_t count, size_t size, compare_function* compare, void* context) {
  if (count < 2 || size == 0) return;
  char* buffer = malloc(count * size);
  if (!buffer) {
    insert_each(base, count, size, compare, context);
    return;
  }
  char *from = base, *to = buffer;
  const size_t bytes = count * size;
  for (size_t run = size; run < bytes; run *= 2) {
    for (size_t start = 0; start < bytes; start += 2 * run) {
      const size_t middle = start + run < bytes ? start + run : bytes;
      const size_t end = middle + run < bytes ? middle + run : bytes;
      merge(from + start, from + middle, from + end, size, compare, context, to + start);
    }
    char* const sorted = to;
    to = from;
    from = sorted;
  }
  if (from != base) memcpy(base, from, bytes);
  free(buffer);
}

// The same with Windows' order of arguments.
typedef int windows_compare_function(void* context, const void* a, const void* b);

struct windows_call {
  windows_compare_function* compare;
  void* context;
};

static int compare_for_windows(const void* a, const void* b, void* call) {
  const struct windows_call* made = call;
  return made->compare(made->context, a, b);
}

void mjenv_qsort_s(void* base, size_t count, size_t size, windows_compare_function* compare, void* context) {
  struct windows_call call = {compare, context};
  mjenv_qsort_r(base, count, size, compare_for_windows, &call);
}

typedef int plain_compare_function(const void* a, const void* b);

static int compare_plainly(const void* a, const void* b, void* compare) {
  return (*(plain_compare_function**)compare)(a, b);
}

void mjenv_qsort(void* base, size_t count, size_t size, plain_compare_function* compare) {
  mjenv_qsort_r(base, count, size, compare_plainly, &compare);
}

// An allocator that fails when told to, for the test program and every library in it.
#ifndef MJENV_TESTS_ALLOCATOR_H
#define MJENV_TESTS_ALLOCATOR_H

#include <stdbool.h>
#include <stddef.h>

enum failing {
  ONE,  // the allocation fails, those after it do not
  ALL   // it and all after it fail
};

// Of this process's allocations from now on, number `first` fails (0: the next).
void allocator_arm(enum failing failing, size_t first);
enum { ALLOCATOR_LIBRARIES = 2 };

// From now on nothing fails, and nothing counts as live, but what the libraries that hold the functions (or NULL) ask
// for themselves, by malloc or operator new; NULL: what any asks for.
void allocator_only(void (*const functions[ALLOCATOR_LIBRARIES])(void));
// From now on nothing fails. False when nothing did since allocator_arm.
bool allocator_disarm(void);
// Allocations since allocator_arm.
size_t allocator_count(void);
// Blocks that are allocated and not freed.
long allocator_live(void);
// Their bytes, whatever libraries have been chosen.
long allocator_bytes(void);

#endif

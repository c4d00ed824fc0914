// The library's functions for the callbacks of tasks (mjenv/task.h), and the reasons why callbacks failed.
#pragma once

#include "mjenv/task.h"

namespace mjenv::core {

const mjenv_task_api& task_api();

// The reason that a callback gave for its failure on this thread; "" if it gave none.
const char* task_message();
void set_task_message(const char* text);
void clear_task_message();

}  // namespace mjenv::core

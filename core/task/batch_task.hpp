// "Batch-v0": any model, with observations, rewards and infos that the caller computes (mjenv_advance).
#pragma once

#include "mjenv/task.h"

namespace mjenv::core {

mjenv_task batch_task();

}  // namespace mjenv::core

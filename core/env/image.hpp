// Images of rows: the bytes that mjenv_snapshot writes and mjenv_restore reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "env/frames.hpp"
#include "env/perturbation.hpp"
#include "env/randomization.hpp"
#include "env/rows.hpp"
#include "task/options.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// An image fits an environment with the same identity, version of MuJoCo and math library, if this library reads its
// version (ImageHeader). An image of all rows also needs the same number of rows.
struct Identity {
  enum class Rounding : std::uint16_t { any, plain, fused };

  // A hash of the id, the model, the task's revision, the options with InIdentity::yes, and whether the rows' histories
  // stack each key of a Dict by itself (Frames::stacks_keys).
  std::uint64_t hash;
  Rounding rounding;  // how Euclidean norms are rounded (the option "norm"); `any` if the task computes none
  // Fingerprints; 0 for none.
  std::uint64_t randomization = 0, perturbation = 0;
};

Identity identity_of(const Options& options, const Task& task, const Frames& frames);

// In these functions, row may be MJENV_ALL_ROWS.
std::size_t image_size(const Rows& rows, std::int64_t row);
void write_image(const Rows& rows, const Identity& identity, std::int64_t row, void* image);
// Checks the image before it changes any row. id: the environment's id, for messages.
void read_image(Rows& rows, const Task& task, const Randomization& randomization, const Perturbation& perturbation,
                const Frames& frames, const Identity& identity, const std::string& id, std::int64_t row,
                const void* image, std::size_t size);

}  // namespace mjenv::core

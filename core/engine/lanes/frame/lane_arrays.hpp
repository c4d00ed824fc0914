// The arrays of Lanes for a model, as the version's arrays.hpp lists them.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "engine/lanes/frame/memory.hpp"
#include "engine/lanes/frame/version.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

// An array of Lanes, and the array of mjData from and to which it is copied.
struct LaneArray {
  double* Lanes::*numbers;
  mjtNum* mjData::*data;
  int count;
};

// Numbers or flags of mjModel whose values may differ from row to row. `of` finds them in a model.
template <typename Element>
struct OwnArray {
  double* Lanes::*numbers;
  const Element* (*of)(const mjModel& model);
  int count;
  bool are_shared = false;  // the lanes hold the values that all rows share
};
using OwnNumbers = OwnArray<mjtNum>;
using OwnFlags = OwnArray<mjtByte>;

class LaneArrays {
 public:
  // by_rows: those Parties that are stages of this model that MuJoCo's functions always compute row by row. What they
  // write is in mjData already, so it is never copied there.
  explicit LaneArrays(const mjModel& model, unsigned by_rows = 0);

  std::size_t bytes(int width) const { return Memory<Lanes>::bytes(width, counts_); }

 protected:
  const mjModel& m_;
  std::array<std::vector<LaneArray>, kParties> written_, read_;  // for each Party, what it writes and reads in mjData
  std::vector<OwnNumbers> own_, frames_;  // frames_: those that the lanes hold only if rows have their own
  std::vector<OwnFlags> flags_;
  Counts<Lanes> counts_;
  int longest_ = 1;  // the greatest count of an array that is copied from or to mjData
};

// The name of an array with a number that is not finite or whose absolute value is above mjMAXVAL, MuJoCo's limit for
// the numbers of a state; "" if there is none. Searches only arrays whose numbers lanes multiply even where MuJoCo
// skips a product with 0 (kModerate). With such numbers, computations do not overflow; if they did, the checks of the
// lanes' results would find it.
std::string excessive_array(const mjModel& model);

}  // namespace mjenv::core::lanes

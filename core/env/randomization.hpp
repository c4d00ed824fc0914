// What resets draw for arrays of the mjModel (mjenv_randomize).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"
#include "mjenv/mjenv.h"
#include "numpy/random.hpp"

namespace mjenv::core {

class Randomization {
 public:
  // Draws nothing.
  Randomization() = default;
  // Copies the list, but skips items whose array is empty in this model. Throws if MuJoCo cannot compute with the
  // smallest or the largest value of an item, a value of CHOICE, or the mean of NORMAL, except for quaternions and
  // directions. If other values might be invalid, `draw` checks each (Item::is_checked).
  Randomization(const mjenv_randomization* items, std::int64_t count, const Model& model);

  bool empty() const { return items_.empty(); }
  // Whether mj_setConst follows the draws.
  bool computes_constants() const { return computes_constants_; }
  // The arrays of which rows need their own values.
  std::vector<std::string> arrays() const;
  // A hash of the list; 0 if it is empty.
  std::uint64_t fingerprint() const { return fingerprint_; }
  // Call this before `draw`, with the layout of the blocks, when all arrays are in it.
  void place(const OwnArrays& layout) noexcept;

  // Draws the values into a row's block. Throws if MuJoCo cannot compute with one of them.
  void draw(np::Generator& rng, std::byte* block) const;

 private:
  struct Item {
    OwnArray array;
    mjenv_distribution distribution;
    mjenv_effect effect;
    bool shared;
    bool is_checked;  // whether `draw` checks each value, because some that can be drawn might be refused
    std::vector<std::size_t> elements;
    std::vector<double> originals;   // the model's own values of these elements
    std::vector<double> parameters;  // logarithms for LOG_UNIFORM

    double next(np::Generator& rng) const;
    double value(std::size_t i, double drawn) const;
  };
  std::vector<Item> items_;
  bool computes_constants_ = false;
  std::uint64_t fingerprint_ = 0;

  static Item item_of(const mjenv_randomization& given, const Model& model);
  static void take_elements(Item& item, const mjenv_randomization& given);
  static void take_parameters(Item& item, const mjenv_randomization& given);
  static void check_ends(const Item& item);
};

}  // namespace mjenv::core

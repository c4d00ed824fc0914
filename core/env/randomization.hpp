// What resets draw for arrays of the mjModel (mjenv_randomize).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/own_array.hpp"
#include "engine/own_arrays.hpp"
#include "env/draw_document.hpp"
#include "numpy/random.hpp"

namespace mjenv::core {

class Randomization {
 public:
  // Draws nothing.
  Randomization() = default;
  // Throws if MuJoCo cannot compute with the smallest or the largest value of an item, a choice, or the mean of a normal
  // distribution. This is not checked for quaternions and directions. If other values of an item might be invalid,
  // `draw` checks each value (Item::is_checked).
  explicit Randomization(const std::vector<DrawSettings>& items);

  bool empty() const { return items_.empty(); }
  // Whether mj_setConst is called after the draws.
  bool computes_constants() const { return computes_constants_; }
  // The arrays for which rows need their own values.
  std::vector<std::string> arrays() const;
  // A hash of the list; 0 if it is empty.
  std::uint64_t fingerprint() const { return fingerprint_; }
  // Call this before `draw`, with the layout of the rows' blocks after all arrays() were added to it.
  void place(const OwnArrays& layout) noexcept;

  // Draws the values into a row's block. ranges: the parameters of the distributions for this row, which at first are
  // those of the list. Throws if MuJoCo cannot compute with one of the values.
  void draw(np::Generator& rng, const double* ranges, std::byte* block) const;

  // Where a row's ranges have the parameters of one item.
  struct Range {
    std::size_t item, first, count;
  };
  const std::vector<double>& ranges() const { return ranges_; }
  // Whether an array's name is that of a range, such as "draws[0]". find throws if there is no such item, or if its
  // parameters cannot be changed.
  static bool is_name(const std::string& array) { return array.compare(0, 6, "draws[") == 0; }
  Range find(const std::string& array) const;
  // Throws unless the item could have these parameters.
  void check(const Range& range, const double* parameters) const;
  // Whether a row can have these ranges. Used to check the ranges in an image.
  bool is_valid(const double* ranges) const;

 private:
  struct Item {
    OwnArray array;
    Distribution distribution;
    Effect effect;
    bool shared, repeats;
    std::size_t per_draw = 1;  // how many of its elements use each draw of the item that it repeats
    bool is_checked;           // whether `draw` checks each value, because it may draw an invalid one
    double factor;
    std::vector<std::size_t> elements;
    std::vector<double> originals;     // the model's own values of these elements
    std::vector<double> choices;       // to choose from
    std::size_t first = 0, count = 0;  // where ranges_ has the parameters of other distributions

    double next(const double* parameters, np::Generator& rng) const;
    double value(std::size_t i, double drawn) const;
    void write(std::size_t i, double drawn, std::byte* block) const {
      array.write(elements[i], value(i, drawn), block);
    }
  };
  std::vector<Item> items_;
  std::vector<double> ranges_;
  bool computes_constants_ = false;
  std::uint64_t fingerprint_ = 0;

  void add(const DrawSettings& given);
  static Item item_of(const DrawSettings& given);
  static std::size_t per_draw(const Item& item, std::size_t draws);
  static void check_parameters(const Item& item, const double* parameters);
  static void check_ends(const Item& item, const Item& drawn, const double* parameters);
  // The index behind the last of the items that repeat the one at `begin`.
  std::size_t end_of(std::size_t begin) const;
};

}  // namespace mjenv::core

// The parts of a row. The code that allocates, copies and saves rows loops over this table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mjenv::core {

enum class Part : std::uint8_t {
  head,
  carried,
  parameters,
  perturbation,
  ranges,
  history,
  random_state,
  // For each Entry, its state and its own values.
  first_state,
  first_values,
  set_state_state,
  set_state_values,
  set_constants_rest,
  set_constants_values,
  state,
  values,
};

// What a part consists of. Rows::bytes_of tells how many bytes it has, and read_image checks the bytes of an image
// accordingly.
enum class Content : std::uint8_t {
  head,          // Rows::Head
  state,         // a state (StateLayout)
  rest,          // StateLayout::rest
  carried,       // the numbers that the row carries for the task (SimView::carried)
  parameters,    // the row's live parameters (Parameters)
  values,        // a block of own values (OwnArrays)
  perturbation,  // the record of noise, delays and pushes (Perturbation)
  ranges,        // the parameters from which resets draw (Randomization)
  history,       // the record of the last observations (Frames)
  random_state,  // a stream of NumPy's RandomState
};

struct PartKind {
  Part part;
  const char* name;  // in images
  Content content;
  // The bit of Head::kept that says whether a row has the part. 0: all rows have it.
  std::uint16_t kept = 0;

  bool is_in(std::uint16_t all_kept) const { return kept == 0 || (all_kept & kept) != 0; }
};

constexpr std::size_t kPartCount = 15;
constexpr std::size_t index_of(Part part) { return static_cast<std::size_t>(part); }

// In the order of Part.
constexpr std::array<PartKind, kPartCount> kParts{{
    {Part::head, "head", Content::head},
    {Part::carried, "carried", Content::carried},
    {Part::parameters, "parameters", Content::parameters},
    {Part::perturbation, "perturbation", Content::perturbation},
    {Part::ranges, "ranges", Content::ranges},
    {Part::history, "history", Content::history},
    {Part::random_state, "random_state", Content::random_state},
    {Part::first_state, "first_state", Content::state},
    {Part::first_values, "first_values", Content::values, 1},
    {Part::set_state_state, "set_state_state", Content::state, 2},
    {Part::set_state_values, "set_state_values", Content::values, 4},
    {Part::set_constants_rest, "set_constants_rest", Content::rest, 8},
    {Part::set_constants_values, "set_constants_values", Content::values, 16},
    {Part::state, "state", Content::state},
    {Part::values, "values", Content::values},
}};
constexpr bool are_in_order() {
  for (std::size_t i = 0; i < kPartCount; ++i)
    if (index_of(kParts[i].part) != i) return false;
  return true;
}
static_assert(are_in_order());
constexpr std::uint16_t kept_bit(Part part) { return kParts[index_of(part)].kept; }

// A row's recipe. Rows do not store the derived arrays of mjData (xpos, contacts, ...): a worker makes them again when
// they are needed (Holder::hold). It repeats, in this order, what has computed them, each time with the state and the
// own values that the row had then. At last it loads the present ones, because a write changes no derived array until
// the next mj_step or mj_forward, as in Gymnasium.
//
//   first          what Head::origin says; all rows have this entry and `now`
//   set_state      mj_forward, if set_state was called after a step, which keeps that step's forces
//   set_constants  mj_setConst, if it was called; of the state it reads only StateLayout::rest
//   now            the present state and own values; a step begins with them
//
// An entry's own values are kept only if the row's were written since. Otherwise those of the next entry apply.
enum class Entry : std::uint8_t { first, set_state, set_constants, now };

constexpr Entry next(Entry entry) { return static_cast<Entry>(static_cast<std::uint8_t>(entry) + 1); }
constexpr Part state_of(Entry entry) {
  return static_cast<Part>(index_of(Part::first_state) + 2 * static_cast<std::size_t>(entry));
}
constexpr Part values_of(Entry entry) { return static_cast<Part>(index_of(state_of(entry)) + 1); }
static_assert(values_of(Entry::now) == Part::values);

}  // namespace mjenv::core

// The parts of a row. The code that allocates, copies and saves rows loops over this table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mjenv::core {

enum class Part : std::uint8_t {
  head,
  state,
  carried,
  parameters,
  values,
  perturbation,
  ranges,
  history,
  random_state,
  computed_state,
  computed_values,
  stepped_state,
  stepped_values,
  constants_rest,
  constants_values,
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
  // The bit of Head::kept that says whether a row has the part. A reset or a step clears it, and so does
  // set_state, except for the stepped parts. 0: all rows have the part.
  std::uint8_t kept = 0;

  bool is_in(std::uint8_t all_kept) const { return kept == 0 || (all_kept & kept) != 0; }
};

constexpr std::size_t kPartCount = 15;
constexpr std::size_t index_of(Part part) { return static_cast<std::size_t>(part); }

// In the order of Part.
constexpr std::array<PartKind, kPartCount> kParts{{
    {Part::head, "head", Content::head},
    {Part::state, "state", Content::state},
    {Part::carried, "carried", Content::carried},
    {Part::parameters, "parameters", Content::parameters},
    {Part::values, "values", Content::values},
    {Part::perturbation, "perturbation", Content::perturbation},
    {Part::ranges, "ranges", Content::ranges},
    {Part::history, "history", Content::history},
    {Part::random_state, "random_state", Content::random_state},
    {Part::computed_state, "computed_state", Content::state},
    {Part::computed_values, "computed_values", Content::values, 1},
    {Part::stepped_state, "stepped_state", Content::state, 2},
    {Part::stepped_values, "stepped_values", Content::values, 4},
    {Part::constants_rest, "constants_rest", Content::rest, 8},
    {Part::constants_values, "constants_values", Content::values, 16},
}};
constexpr bool are_in_order() {
  for (std::size_t i = 0; i < kPartCount; ++i)
    if (index_of(kParts[i].part) != i) return false;
  return true;
}
static_assert(are_in_order());
constexpr std::uint8_t kept_bit(Part part) { return kParts[index_of(part)].kept; }

// As in Gymnasium, a write changes no derived array (xpos, contacts, ...) until the next mj_step or mj_forward. But
// rows do not store derived arrays: a worker computes them again when they are needed (Worker::hold). After a write, it
// must compute them from the state and values from before the write. So a row stores the inputs of up to four
// computations, its versions:
//
//   version    state           own values        own values are kept          what Worker::hold does with it
//   now        state           values            always                       loads it last; steps begin with it
//   computed   computed_state  computed_values   if written since             repeats the last mj_step or mj_forward
//                                                the computation
//   stepped    stepped_state   stepped_values    if computed_values were      repeats the last mj_step before
//                                                kept at set_state            set_state, for that step's forces
//   constants  constants_rest  constants_values  from mj_setConst until       repeats mj_setConst
//                                                the next computation
//
// If a version's own values are not kept, those of the version above apply, or for `constants` those of the model.
enum class Version : std::uint8_t { now, computed, stepped, constants };

}  // namespace mjenv::core

// What steppers of all versions do: they hold the rows' numbers in lanes, copy between lanes and mjData, compute the
// stages, and leave rows to MuJoCo.
#pragma once

#include <array>
#include <cstdint>
#include <exception>
#include <vector>

#include "engine/lanes/frame/lane_arrays.hpp"
#include "engine/lanes/frame/stages.hpp"
#include "engine/lanes/frame/stepper.hpp"

namespace mjenv::core::lanes {

class LaneStepper : public Stepper, protected LaneArrays {
 public:
  LaneStepper(const Model& model, const Code& code);
  std::uint32_t step(Work* const* works, int count, std::int64_t frames, double* const* before,
                     const BeforeSubstep* before_substep) final;
  std::uint32_t forward(Work* const* works, int count) final;

 protected:
  const Code& code_;
  Lanes lanes_{};
  std::array<const mjModel*, kMaxWidth> row_models_{};
  std::array<mjData*, kMaxWidth> data_{};
  std::array<Work*, kMaxWidth> works_{};
  int count_ = 0;
  unsigned readers_ = 0;  // the Parties that read mjData after this step

  // ---- What each version defines ----

  // Computes what follows from the rows' numbers of mjModel, which have changed, and whether they are `unlike`.
  virtual void adopt() = 0;
  // Whether the tables of the shared model are not valid for a row's model.
  virtual bool is_unlike(const mjModel& m) const = 0;
  // Decides how this step is computed. May add to readers_.
  virtual void begin() {}
  // Does what mj_forward does. is_shown: callbacks read what it computes; otherwise only steps read the state that it
  // leaves.
  virtual void forward_alone(bool is_shown) = 0;
  // Does what mj_step does.
  virtual void advance(bool is_last) = 0;
  // Writes to mjData what readers_ read, except the state. Returns how Work::note_step must be called.
  struct Left {
    unsigned lag;
    bool is_shown;
  };
  virtual Left finish() = 0;

  // ---- What versions use ----

  std::uint32_t live() const { return all_ & ~lanes_.left_to_mujoco; }
  void leave_bad(const double* numbers, int count) { lanes_.left_to_mujoco |= code_.bad(numbers, count); }
  // Copies to lanes what this Party has written to the rows' mjData. Lanes without a row get a copy of the first row.
  void gather(Party writer);
  // Copies to the mjData of these rows (bits) what this Party reads there.
  void scatter(Party reader, unsigned rows = ~0U);
  // Computes the stages whose functions are in the table; those that are shown, or all.
  void compute(bool shown_only = false);

  // Calls body(row, its model, its mjData) for the rows that are not left to MuJoCo. If MuJoCo fails in a row, this
  // leaves the row, too: it is then stepped alone, fails again, and the error is reported.
  template <typename Body>
  void for_live_rows(const Body& body) {
    const std::uint32_t rows = live();
    for (int row = 0; row < count_; ++row) {
      if (!(rows >> row & 1)) continue;
      try {
        body(row, *row_models_[row], *data_[row]);
      } catch (const std::exception&) {
        lanes_.left_to_mujoco |= 1u << row;
      }
    }
  }

  // Whether the rows have their own values of this array. Either all rows have a copy of an array or none has, so the
  // first row's pointers tell for all.
  template <typename Element>
  bool has_own(Element* mjModel::*array) const {
    return row_models_[0]->*array != m_.*array;
  }

 private:
  Memory<Lanes> memory_;
  std::uint32_t all_ = 0;      // the lanes that have a row, as bits
  bool has_shared_ = false;    // no row has numbers of mjModel of its own
  std::vector<double> spare_;  // where scatter writes the numbers of lanes without a row
  struct Call {
    void (*in_lanes)(Lanes&);
    const Stage* row_by_row;  // if in_lanes is null
  };
  std::vector<Call> all_calls_, shown_calls_;

  template <typename Own>
  bool are_shared(const Own& own) const {
    return own.of(*row_models_[0]) == own.of(m_);
  }
  template <typename Own>
  void gather_own(Own& own);
  void gather_own();
  void leave_unlike();
  void gather_forces();
  // Brings the rows into lanes. Returns false if all of them are left to MuJoCo.
  bool load(Work* const* works, int count, unsigned readers);
  void forward_where_deferred();
};

// ---- What each version defines, too ----

// How much memory the large arrays take that its stepper has besides Lanes.
std::size_t more_bytes(const mjModel& m, int width);

}  // namespace mjenv::core::lanes

// Makes the constraints of several rows in lanes: limits of joints and contacts of planes, spheres and capsules.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/lanes/lanes.hpp"
#include "engine/lanes/memory.hpp"
#include "engine/lanes/model_tables.hpp"
#include "engine/lanes/solver.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

class ConstraintMaker {
 public:
  // Null if lanes cannot make the constraints of this model. The tables must outlive the maker.
  static std::unique_ptr<ConstraintMaker> make(const Code& code, const mjModel& m, const ModelTables& tables);

  // Call this when rows begin a step: these are their models. Returns whether lanes can make their constraints.
  bool follow(const RowModels& models, int count);

  // Finds the limits and contacts of these rows, as bits. Code::reject must have run. Returns false if MuJoCo's functions
  // must find them.
  bool find(const Lanes& lanes, std::uint32_t rows, const Solver& solver, const RowModels& models, const RowData& data);
  const Contacts& found() const { return contacts_; }

 private:
  // What MuJoCo computes of a row's mjModel, computed when it is first used.
  class Numbers {
   public:
    explicit Numbers(std::size_t count) : numbers_(count), are_known_(count) {}
    void forget() { are_known_.assign(are_known_.size(), 0); }
    // Null if MuJoCo would warn of the numbers.
    const ConstraintNumbers* of_limit(const mjModel& m, int joint);
    const ConstraintNumbers* of_contact(const mjModel& m, int pair);

   private:
    enum : unsigned char { unknown, usual, mixed };
    std::vector<ConstraintNumbers> numbers_;
    std::vector<unsigned char> are_known_;
    template <typename Compute>
    const ConstraintNumbers* get(std::size_t index, const Compute& compute);
  };

  const Code& code_;
  const mjModel& m_;
  Contacts contacts_{};
  Memory<Contacts> memory_;
  Numbers shared_;            // of the model that rows share
  std::vector<Numbers> own_;  // for each lane, of its row's own model
  std::array<Numbers*, kMaxWidth> used_{};

  ConstraintMaker(const Code& code, const mjModel& m, const ModelTables& tables);
  template <typename Entry, typename Get>
  bool set_numbers(Entry& entry, const Get& get);
};

}  // namespace mjenv::core::lanes

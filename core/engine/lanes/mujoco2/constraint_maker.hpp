// Makes the constraints of several rows in lanes: equalities, friction, limits and contacts.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/lanes/frame/memory.hpp"
#include "engine/lanes/mujoco2/lanes.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"
#include "engine/lanes/mujoco2/solver.hpp"
#include "engine/mujoco.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {

class ConstraintMaker {
 public:
  // Returns null if lanes cannot make the constraints of this model. The tables must outlive the maker.
  static std::unique_ptr<ConstraintMaker> make(const Code& code, const mjModel& m, const ModelTables& tables);

  // Call this at the beginning of a step, with the models of its rows. Returns whether lanes can make their
  // constraints.
  bool follow(const RowModels& models, int count);

  // Finds the reached limits and the contacts of `rows` (bits). Call Code::reject first. Returns false if MuJoCo's
  // functions must find them instead.
  bool find(const Lanes& lanes, std::uint32_t rows, const Solver& solver, const RowModels& models, const RowData& data);
  const Contacts& found() const { return contacts_; }

 private:
  // The ConstraintNumbers of one mjModel, each of which is computed when it is first used.
  class ModelNumbers {
   public:
    ModelNumbers(const mjModel& m, std::size_t pairs);
    void forget() { validity_.assign(validity_.size(), unknown); }
    // These return null if MuJoCo would warn of the numbers.
    const ConstraintNumbers* of_equality(const mjModel& m, int id);
    const ConstraintNumbers* of_friction(const mjModel& m, Object object, int id);
    const ConstraintNumbers* of_limit(const mjModel& m, Object object, int id);
    const ConstraintNumbers* of_contact(ConstraintMaker& maker, const mjModel& m, int pair);

   private:
    enum : unsigned char { unknown, valid, invalid };  // invalid: MuJoCo would warn of them
    // Where the numbers of each kind begin in numbers_. Those of the limits of joints begin at 0.
    std::size_t pairs_, dofs_, tendon_limits_, tendon_frictions_, equalities_;
    std::vector<ConstraintNumbers> numbers_;
    std::vector<unsigned char> validity_;  // for each of numbers_: unknown, valid or invalid
    template <typename Compute>
    const ConstraintNumbers* get(std::size_t first, int index, const Compute& compute);
  };

  const Code& code_;
  const mjModel& m_;
  Contacts contacts_{};
  Memory<Contacts> memory_;
  ModelNumbers shared_;            // of the model that rows without own values share
  std::vector<ModelNumbers> own_;  // for each lane, those of its row's own model
  std::array<ModelNumbers*, kMaxWidth> used_{};
  std::vector<Contacts::Limited> joints_, tendons_;
  std::vector<Contacts::Equal> equals_;
  std::vector<Contacts::Friction> frictions_;
  int shared_rows_ = 0;  // the lists are valid for this many rows with the shared model; 0: they are not valid
  // Whether Model has no list of pairs, so that MuJoCo searches for them in every row. Then `find` finds what this
  // search would, and set_contact computes the pairs' parameters, which no mjModel has.
  const bool are_always_searched_;
  const bool has_friction_;
  const ModelTables& tables_;
  Pairs mixed_;  // room for the parameters of one pair
  // The arguments of the current call of `find`:
  const Lanes* lanes_ = nullptr;
  const RowModels* models_ = nullptr;
  const RowData* data_ = nullptr;

  bool set_contact(ConstraintNumbers& n, const mjModel& m, int pair);
  int collide(int pair, unsigned rows);
  int collide(int pair, int lane);

  ConstraintMaker(const Code& code, const mjModel& m, const ModelTables& tables);
  template <typename Entry, typename Get>
  bool set_numbers(Entry& entry, const Get& get);
  bool add_equality(const Equality& equality, const RowModels& models, int count);
  bool add_friction(Object object, int id, const RowModels& models, int count);
};

}  // namespace mjenv::core::lanes

// Lists the constraints of several rows that lanes make, with the numbers of the rows' models that they take.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/lanes/frame/contact_pairs.hpp"
#include "engine/lanes/frame/memory.hpp"
#include "engine/lanes/frame/row_solver.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {

class RowMaker {
 public:
  RowMaker(const RowMaker&) = delete;
  RowMaker& operator=(const RowMaker&) = delete;

  // Call this at the beginning of a step, with the models and data of its rows. Returns whether lanes can make their
  // constraints.
  bool follow(const RowModels& models, const RowData& data, int count);
  const Contacts& found() const { return contacts_; }

 protected:
  enum class Kind { equality, dof_friction, tendon_friction, joint_limit, tendon_limit, contact };

  const Code& code_;
  const mjModel& m_;
  Contacts contacts_{};

  // pairs and equalities must outlive the maker. is_still_tendon: for each tendon, whether its Jacobian is always 0.
  // special: the arrays that only some versions have.
  RowMaker(const Code& code, const mjModel& m, const std::vector<ContactPair>& pairs,
           const std::vector<Equality>& equalities, const std::vector<unsigned char>& is_still_tendon,
           const Counts<Contacts>& special = {});
  ~RowMaker() = default;

  // MuJoCo's getsolparam, and what mj_makeImpedance computes from nothing but its result. Returns false if MuJoCo would
  // warn of the numbers.
  static bool set_solparam(ConstraintNumbers& n, const mjModel& m, const mjtNum* solref, const mjtNum* solimp);
  // Sets the numbers of an entry (a limit, contact, equality or friction). Lanes that do not have it get the numbers of
  // another lane. Returns false if MuJoCo would warn of the numbers.
  template <typename Entry>
  bool set_numbers(Entry& entry, Kind kind, int id);
  // The same for the limits and contacts that have been found.
  bool set_numbers();

  // The rows, as bits, for whose model `has` returns true.
  template <typename Has>
  static unsigned rows_in_which(const RowModels& models, int count, const Has& has) {
    unsigned rows = 0;
    for (int row = 0; row < count; ++row)
      if (has(*models[row])) rows |= 1U << row;
    return rows;
  }

  Pairs mixed_;  // room for the parameters of one pair

 private:
  // The ConstraintNumbers of one mjModel, each of which is computed when it is first used.
  struct ModelNumbers {
    enum : unsigned char { unknown, valid, invalid };  // invalid: MuJoCo would warn of them
    std::vector<ConstraintNumbers> numbers;
    std::vector<unsigned char> validity;  // for each of `numbers`
  };

  Memory<Contacts> memory_;
  std::vector<std::size_t> first_;  // for each Kind, the index of its first numbers
  ModelNumbers shared_;             // of the model that rows without own values share
  std::vector<ModelNumbers> own_;   // for each lane, those of its row's own model
  std::array<ModelNumbers*, kMaxWidth> used_{};
  RowModels models_{};
  std::vector<int> joints_, tendons_, frictional_tendons_;  // those that can have limits or friction
  std::vector<Contacts::Limited> limited_joints_, limited_tendons_;
  std::vector<Contacts::Friction> frictions_;
  const std::vector<Equality>& equalities_;
  std::vector<Contacts::Equal> equals_;
  int shared_rows_ = 0;  // the lists are valid for this many rows with the shared model; 0: they are not valid

  bool set(ConstraintNumbers& n, const mjModel& m, Kind kind, int id);
  static bool set_equality(ConstraintNumbers& n, const mjModel& m, int id);
  bool set_contact(ConstraintNumbers& n, const mjModel& m, int pair);
  const ConstraintNumbers* numbers(int lane, Kind kind, int id);
  bool add_equality(const Equality& equality, const RowModels& models, const RowData& data, int count);
  bool add_friction(Object object, int id, int count);
};

template <typename Entry>
bool RowMaker::set_numbers(Entry& entry, Kind kind, int id) {
  const ConstraintNumbers* some = nullptr;
  if (shared_rows_ > 0) {  // all rows have the same numbers
    some = numbers(0, kind, id);
    for (int lane = 0; lane < code_.width; ++lane) entry.numbers[lane] = some;
    return some;
  }
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(entry.rows >> lane & 1)) continue;
    some = entry.numbers[lane] = numbers(lane, kind, id);
    if (!some) return false;
  }
  for (int lane = 0; lane < code_.width; ++lane)
    if (!(entry.rows >> lane & 1)) entry.numbers[lane] = some;
  return true;
}

}  // namespace mjenv::core::lanes

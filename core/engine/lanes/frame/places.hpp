// Where the constraints are that lanes have made.
#pragma once

#include "engine/lanes/frame/constrained.hpp"

namespace mjenv::core::lanes {
namespace {

// Finds the places of constraints. They are made one after the other, each only in the lanes that have it.
class Places {
 public:
  Places(const Contacts& contacts, const Constraints& c) : contacts_(contacts), c_(c) {}

  // Goes to the next limit, contact or equality, which makes `size` constraints (rows of the Jacobian) in the lanes
  // `rows`, but not in those that are left to MuJoCo: these may have more constraints than there are places.
  void next(unsigned rows, int size) {
    const unsigned counted = rows & contacts_.rows;
    for (int lane = 0; lane < kWidth; ++lane) {
      if (!(counted >> lane & 1) && !c_.is_aligned) continue;
      for (int i = 0; i < size; ++i) {
        const int number = numbers_[lane]++, beyond = c_.is_aligned ? -1 : number - c_.at_first[lane];
        places_[i][lane] = beyond < 0 ? number : c_.size - Constraints::kRest + beyond;
      }
    }
  }
  // Skips all equality and friction constraints.
  void skip_bounded() {
    for (int i = 0; i < contacts_.equality_count; ++i)
      next(contacts_.equals[i].rows, contacts_.equals[i].equality->size);
    for (int i = 0; i < contacts_.friction_count; ++i) next(contacts_.frictions[i].rows, 1);
  }
  // If all lanes have the same places: the place of the next constraint.
  int first() const { return numbers_[0]; }
  // For each lane, the place of constraint i of the limit, contact or equality to which `next` went.
  const int* of(int i) const { return places_[i]; }
  int at(int i, int lane) const { return places_[i][lane]; }

 private:
  static constexpr int kMostRows = 10;  // of a contact with six dimensions and a pyramidal cone
  const Contacts& contacts_;
  const Constraints& c_;
  int numbers_[kWidth] = {};  // the number of each lane's next constraint
  int places_[kMostRows][kWidth]{};
};

}  // namespace
}  // namespace mjenv::core::lanes

// Finds the contacts and reached limits of several rows in lanes, and lists them, or writes the contacts to mjData.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/lanes/frame/equalities.hpp"
#include "engine/lanes/frame/row_maker.hpp"
#include "engine/model.hpp"

namespace mjenv::core::lanes {

// The pairs of geoms whose contacts lanes find, and the equalities. A base class, so that they exist before RowMaker.
struct ListedPairs {
  Pairs listed;
  std::vector<int> columns;  // Lanes::columns
  std::vector<unsigned char> is_still_tendon;
  std::vector<ContactPair> pairs;
  std::vector<Equality> equalities;
  explicit ListedPairs(const Model& model);
};

class Collider final : private ListedPairs, public RowMaker {
 public:
  // The feature because of which MuJoCo finds the contacts row by row; "" if there is none.
  static std::string obstacle(const Model& model);

  // The model must outlive the collider.
  Collider(const Model& model, const Code& code);
  // Tells lanes which pairs there are. The collider must outlive the lanes.
  void list_pairs(Lanes& lanes) const;
  bool has_pairs() const { return !pairs.empty(); }
  // Finds the contacts of these rows (bits). Returns false if MuJoCo has to find them.
  bool find_contacts(const Lanes& lanes, std::uint32_t rows);
  // Whether MuJoCo, too, would find all contacts that have been found: whether its memory is large enough.
  bool has_room(const RowData& data) const;
  // How much of it this many contacts of a row take at most, while MuJoCo finds them.
  static std::int64_t bytes_of(const mjModel& m, const Contacts& found, std::int64_t contacts);
  // Also finds the limits, after `follow`. Returns false if MuJoCo has to find them, too.
  bool find(const Lanes& lanes, std::uint32_t rows);
  // Writes to mjData the contacts that have been found for a row. m: the row's model.
  void write(int row, const mjModel& m, mjData& d);

 private:
  mjModel without_contacts_;
};

}  // namespace mjenv::core::lanes

// Finds the contacts of several rows in lanes, and writes them to mjData.
#pragma once

#include <string>

#include "engine/lanes/frame/lane_arrays.hpp"
#include "engine/model.hpp"
#include "engine/work.hpp"

namespace mjenv::core::lanes {

class Collider {
 public:
  // The feature because of which MuJoCo finds the contacts row by row; "" if there is none.
  static std::string obstacle(const Model& model);

  // model: the one that rows step with.
  Collider(const mjModel& model, const Code& code);
  // Whether lanes can find the contacts of rows with these models.
  bool follows(const mjModel& row) const;
  // Finds the contacts of these rows (bits). Returns false if MuJoCo has to find them.
  bool find(const Lanes& lanes, std::uint32_t rows);
  // Writes to mjData the contacts that have been found for a row. m: the row's model.
  void write(int row, const mjModel& m, mjData& d) const;

 private:
  const mjModel& m_;
  const Code& code_;
  mjModel without_contacts_;
  Contacts contacts_{};
};

}  // namespace mjenv::core::lanes

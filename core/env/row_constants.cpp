#include "env/row_constants.hpp"

#include <algorithm>

#include "error.hpp"

namespace mjenv::core {

void RowConstants::prepare() {
  if (!constants_) constants_ = std::make_unique<Constants>(model_);
}

void RowConstants::prepare_draw() {
  prepare();
  constants_->make_data();
}

std::vector<std::string> RowConstants::set(Work& work, Rows& rows, std::int64_t row) {
  prepare();
  rows.make_room(Entry::set_constants);
  const OwnArrays& arrays = rows.arrays();
  constants_->compute(arrays, arrays.empty() ? nullptr : rows.values(row), work.data());
  std::vector<std::string> names = constants_->new_arrays(arrays);
  if (!names.empty()) return names;
  rows.append(row, Entry::set_constants);
  std::copy_n(rows.layout().rest(rows.state(row)), rows.layout().more, rows.state(row, Entry::set_constants));
  rows.keep(row);
  if (!arrays.empty()) constants_->save(arrays, rows.own_values(row));
  work.save(rows.state(row));
  rows.head(row).written = Written::by_caller;
  return names;
}

void RowConstants::repeat(Work& work, Rows& rows, std::int64_t row) {
  prepare();
  const OwnArrays& arrays = rows.arrays();
  const std::byte* values = arrays.empty() ? nullptr : rows.values(row, Entry::set_constants);
  if (values) work.use(arrays, values);
  work.load_rest(rows.state(row, Entry::set_constants));
  constants_->compute(arrays, values, work.data());
}

void RowConstants::draw(const OwnArrays& arrays, std::byte* block) {
  constants_->compute(arrays, block);
  const std::vector<std::string> more = constants_->new_arrays(arrays);
  if (!more.empty()) fail(MJENV_E_MODEL, "mj_setConst changes " + listed(more) + ", which all rows share");
  constants_->save(arrays, block);
}

}  // namespace mjenv::core

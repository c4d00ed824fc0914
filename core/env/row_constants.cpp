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
  rows.prepare_keep_constants();
  const OwnArrays& arrays = rows.arrays();
  constants_->compute(arrays, arrays.empty() ? nullptr : rows.values(row), work.data());
  std::vector<std::string> names = constants_->new_arrays(arrays);
  if (!names.empty()) return names;
  rows.keep(row);
  rows.keep_constants(row);
  if (!arrays.empty()) constants_->save(arrays, rows.own_values(row));
  work.save(rows.state(row));
  rows.head(row).written = Written::by_caller;
  rows.head(row).has_constants = true;
  return names;
}

void RowConstants::repeat(Work& work, Rows& rows, std::int64_t row, std::vector<std::byte>& scratch) {
  prepare();
  const OwnArrays& arrays = rows.arrays();
  const std::byte* values = rows.values(row, Version::constants);
  if (!arrays.empty()) {
    scratch.resize(arrays.block_bytes());
    if (values)
      std::copy_n(values, scratch.size(), scratch.data());
    else
      arrays.fill(0, scratch.data());
    work.use(arrays, scratch.data());
  }
  work.load_rest(rows.constants_rest(row));
  constants_->compute(arrays, values, work.data());
}

void RowConstants::draw(const OwnArrays& arrays, std::byte* block) {
  constants_->compute(arrays, block);
  const std::vector<std::string> more = constants_->new_arrays(arrays);
  if (!more.empty()) fail(MJENV_E_MODEL, "mj_setConst changes " + listed(more) + ", which all rows share");
  constants_->save(arrays, block);
}

}  // namespace mjenv::core

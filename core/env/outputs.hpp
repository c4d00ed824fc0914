// The arrays in which the pipeline keeps the outputs of all rows until mjenv_recv copies them to the caller.
#pragma once

#include <cstdint>
#include <vector>

#include "env/episodes.hpp"
#include "env/place.hpp"
#include "env/schema.hpp"

namespace mjenv::core {

class Outputs {
 public:
  Outputs() = default;
  Outputs(const Schema& schema, const Episodes& episodes, std::int64_t rows);
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  std::int64_t rows() const { return batch_.rows; }
  Place at(std::int64_t row) const { return {batch_, batch_.rows, row}; }
  // Copies the row's outputs to the row's place in the caller's arrays.
  void deliver(const Schema& schema, std::int64_t row, const mjenv_batch& out) const;

 private:
  mjenv_batch batch_{};
  std::vector<double> obs_, reward_, info_, reset_info_, final_obs_, final_info_, arrays_;
  std::vector<std::uint8_t> terminated_, truncated_, was_reset_;
  std::vector<std::int32_t> status_;
};

}  // namespace mjenv::core

// What the caller sees of a task's observation: with the options "time_aware" and "history", also the time, and the
// observations of the last steps. Both compute what Gymnasium's wrappers TimeAwareObservation and FrameStackObservation
// compute. The option "observation" says whether the caller sees a Gymnasium Box or Dict. A Dict's keys are parts of the
// observation, which stays one array here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "task/field.hpp"
#include "task/options.hpp"

namespace mjenv::core {

// A frame is the task's observation of one step, and behind it the time if the caller wants it. With a history, each
// row has a record of doubles: whether the newest frame belongs to the row's present state, then the observation as the
// caller sees it.
class Frames {
 public:
  // fields: of the task's observation. rows: how many rows the environment has, to refuse a history for which there is
  // no memory.
  Frames(const Options& options, const std::vector<Field>& fields, std::int64_t rows);

  // Whether the caller sees the task's observation as it is.
  bool empty() const { return !is_timed_ && !has_history_; }
  // How many numbers the task's observation has.
  std::size_t task_count() const { return task_count_; }
  // Of the observation that the caller sees: its fields, the shape that Gymnasium gives it, and the bounds of its
  // numbers.
  const std::vector<Field>& fields() const { return fields_; }
  const std::vector<Field>& keys() const { return keys_; }  // of a Dict; none: it is a Box
  const std::vector<std::int64_t>& shape() const { return shape_; }
  const std::vector<double>& low() const { return low_; }
  const std::vector<double>& high() const { return high_; }
  // How many doubles a row's record has; 0 if it needs none.
  std::size_t record_count() const { return record_count_; }

  // Returns what the caller sees after `steps` steps of an episode, of which this is the task's newest observation.
  // scratch: room for it. record: the row's, to which this adds the frame; after 0 steps the history begins anew.
  const double* add(double* record, const double* observation, std::int64_t steps, std::vector<double>& scratch) const;
  // Returns what the caller sees in the row's present state, without adding a frame: the older frames of the record,
  // and this observation as the newest.
  const double* show(const double* record, const double* observation, std::int64_t steps,
                     std::vector<double>& scratch) const;
  // What `add` returned last; null if there is no record, or the row's state was set or written since.
  const double* last(const double* record) const {
    return record_count_ > 0 && record[0] != 0 ? record + kHead : nullptr;
  }
  // Call this when the row's state was set or written.
  static void forget(double* record) { record[0] = 0; }

  // Whether a record keeps the history of each key by itself. Then it fits no environment with a Box, and vice versa.
  bool stacks_keys() const { return stacks_keys_; }
  // Whether a row can have this record. Checks the record of an image.
  bool is_valid(const double* record) const { return record[0] == 0 || record[0] == 1; }

 private:
  static constexpr std::size_t kHead = 1;  // where the observation begins in a record

  // Numbers of the observation that are kept together: `frames` times `count`, from the oldest to the newest.
  struct Stack {
    std::size_t to, count, frames;
    std::size_t newest() const { return to + (frames - 1) * count; }
  };
  // Numbers of a frame, and where they stand in the newest part of the observation.
  struct Piece {
    std::size_t from, to, count;
  };

  std::size_t task_count_, record_count_ = 0;
  bool is_timed_, normalizes_time_, pads_with_zeros_;
  bool has_history_ = false, stacks_keys_ = false;
  std::int64_t limit_;  // of the steps of an episode
  std::vector<Field> fields_, keys_;
  std::vector<std::int64_t> shape_;
  std::vector<double> low_, high_;
  std::vector<Stack> stacks_;
  std::vector<Piece> pieces_;  // of the task's observation
  std::size_t time_at_ = 0;    // where the newest time stands

  void take_whole(const std::vector<Field>& blocks, std::size_t frames);
  void take_terms(const std::string& lengths);
  void name_frames(const std::vector<Field>& blocks, std::size_t frames);
  void take_bounds(std::size_t count);
  void place(const double* observation, std::int64_t steps, double* to) const;
};

// Declares the options of every id.
void declare_frame_options(Options& options);

}  // namespace mjenv::core

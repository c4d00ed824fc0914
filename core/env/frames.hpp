// Makes the observation that the caller sees from the task's. The option "time_aware" adds the time, as Gymnasium's
// wrapper TimeAwareObservation does; "history" adds the observations of the last steps, as FrameStackObservation does.
// The option "observation" says whether the caller sees a Gymnasium Box or Dict. In this library the observation is one
// array in both cases; the keys of a Dict are parts of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "task/field.hpp"
#include "task/options.hpp"

namespace mjenv::core {

struct Space {
  std::vector<double> low, high;
  std::vector<std::int64_t> shape;
};

// A frame is the task's observation of one step, followed by the time if "time_aware" is set. With a history, each row
// has a record of doubles: first whether the newest frame belongs to the row's present state, then the observation as
// the caller sees it.
class Frames {
 public:
  // fields: those of the task's observation. rows, workers: how many the environment has; a history for which there is
  // no memory is refused.
  Frames(const Options& options, const std::vector<Field>& fields, std::int64_t rows, std::int64_t workers);

  // Whether the caller sees the task's observation unchanged.
  bool empty() const { return !is_timed_ && !has_history_; }
  // How many numbers the task's observation has.
  std::size_t task_count() const { return task_count_; }
  // These describe the observation that the caller sees: its fields, its keys, and its space.
  const std::vector<Field>& fields() const { return fields_; }
  const std::vector<Field>& keys() const { return keys_; }  // the keys of a Dict; empty: it is a Box
  const Space& space() const { return space_; }
  // How many doubles a row's record has; 0 if it needs none.
  std::size_t record_count() const { return record_count_; }

  // Returns what the caller sees after `steps` steps of an episode. observation: the task's newest. record: the row's,
  // to which this adds the frame; after 0 steps the history begins anew. scratch: receives the result if there is no
  // record.
  const double* add(double* record, const double* observation, std::int64_t steps, std::vector<double>& scratch) const;
  // Returns what the caller sees in the row's present state: the older frames of the record, and this observation as
  // the newest frame. Adds no frame to the record.
  const double* show(const double* record, const double* observation, std::int64_t steps,
                     std::vector<double>& scratch) const;
  // What `add` returned last. Null if there is no record, or if the row's state was set or written since.
  const double* last(const double* record) const {
    return record_count_ > 0 && record[0] != 0 ? record + kHead : nullptr;
  }
  // Call this when the row's state was set or written.
  static void forget(double* record) { record[0] = 0; }

  // Whether a record stacks the frames of each key separately. Such a record does not fit an environment with a Box,
  // and the record of a Box does not fit here.
  bool stacks_keys() const { return stacks_keys_; }
  // Whether a row can have this record. Used to check the records in an image.
  bool is_valid(const double* record) const { return record[0] == 0 || record[0] == 1; }

 private:
  static constexpr std::size_t kHead = 1;  // where the observation begins in a record

  // A part of the observation that contains `frames` frames of `count` numbers each, from the oldest to the newest.
  struct Stack {
    std::size_t to, count, frames;
    std::size_t newest() const { return to + (frames - 1) * count; }
  };
  // Consecutive numbers of the task's observation, and where the caller's observation has their newest frame.
  struct Piece {
    std::size_t from, to, count;
  };

  std::size_t task_count_, record_count_ = 0;
  bool is_timed_, normalizes_time_, pads_with_zeros_;
  bool has_history_ = false, stacks_keys_ = false;
  std::int64_t limit_;  // the number of steps after which an episode is truncated
  std::vector<Field> fields_, keys_;
  Space space_;
  std::vector<Stack> stacks_;
  std::vector<Piece> pieces_;  // of the task's observation
  std::size_t time_at_ = 0;    // where the observation has the newest time

  void stack_whole(const std::vector<Field>& blocks, std::size_t frames);
  void stack_terms(const std::string& lengths);
  void name_frames(const std::vector<Field>& blocks, std::size_t frames);
  void set_bounds(std::size_t count);
  double bytes(std::size_t count, std::size_t frames, std::int64_t rows, std::int64_t workers) const;
  void place(const double* observation, std::int64_t steps, double* to) const;
};

// Declares the options that concern observations, which every id has.
void declare_frame_options(Options& options);

}  // namespace mjenv::core

#include "env/frames.hpp"

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

#include "error.hpp"
#include "system/memory.hpp"
#include "task/task.hpp"
#include "task/task_field.hpp"

namespace mjenv::core {
namespace {

constexpr const char* kTime = "time";
constexpr std::int64_t kMaxFrames = std::numeric_limits<std::int32_t>::max();

[[noreturn]] void refuse(mjenv_status status, const std::string& why) { fail(status, "option \"history\": " + why); }

// Splits a word such as "position=3" into the name and the number.
std::pair<std::string, std::size_t> length_of(const std::string& word) {
  const std::size_t sign = word.rfind('=');
  const std::string digits = sign == std::string::npos ? "" : word.substr(sign + 1);
  const bool is_number = !digits.empty() && digits.size() <= 10 &&
                         std::all_of(digits.begin(), digits.end(), [](char c) { return '0' <= c && c <= '9'; });
  const std::int64_t frames = is_number ? std::stoll(digits) : 0;
  if (frames < 1 || frames > kMaxFrames)
    refuse(MJENV_E_VALUE, quoted(word) + " is not TERM=COUNT, such as \"position=3\", with a count of 1 to " +
                              std::to_string(kMaxFrames));
  return {word.substr(0, sign), static_cast<std::size_t>(frames)};
}

}  // namespace

void declare_frame_options(Options& options) {
  options.text("observation", "auto",
               "what the observation is in Gymnasium: a Box (flat), or a Dict (dict) of the task's groups of terms, in "
               "which a term without a group is a key by itself; auto: a Dict if the task has groups",
               "auto flat dict", InIdentity::no);
  options.flag("time_aware", false,
               "add the time since the reset to the observation, as its term \"time\": Gymnasium's "
               "TimeAwareObservation, flattened");
  options.flag("normalize_time", true,
               "the time is the share of max_episode_steps that has passed, a float32 number; 0: it is the number of "
               "steps, which is the default of Gymnasium's TimeAwareObservation");
  options.text_or_index(
      "history", 0,
      "how many observations are stacked, the newest last, as Gymnasium's FrameStackObservation does; 0: none are; or "
      "how many of the last values of some terms, or of the terms of some groups, are stacked, as in \"position=3 "
      "velocity=2\"");
  options.text("history_padding", "reset",
               "what stands before the first observation of an episode in the history: this observation (reset), or "
               "zeros (zero)",
               "reset zero");
}

Frames::Frames(const Options& options, const std::vector<Field>& fields, std::int64_t rows, std::int64_t workers)
    : task_count_(static_cast<std::size_t>(total(fields))),
      is_timed_(options.get("time_aware").integer != 0),
      normalizes_time_(options.get("normalize_time").integer != 0),
      pads_with_zeros_(options.get("history_padding").text == "zero"),
      limit_(options.get("max_episode_steps").integer),
      fields_(fields) {
  if (is_timed_) {
    if (limit_ == 0)
      fail(MJENV_E_VALUE, "option \"time_aware\" is 1, but max_episode_steps is 0: episodes have no limit of steps");
    if (!normalizes_time_ && limit_ > std::numeric_limits<std::int32_t>::max())
      fail(MJENV_E_VALUE, "option \"normalize_time\" is 0, but max_episode_steps is " + std::to_string(limit_) +
                              ", which an int32 cannot hold");
    if (std::any_of(fields.begin(), fields.end(),
                    [](const Field& field) { return field.name == kTime || field.group == kTime; }))
      fail(MJENV_E_VALUE, "option \"time_aware\" is 1, but the observation has a term or group \"time\" already");
    fields_.push_back({MJENV_ROLE_OBSERVATION,
                       kTime,
                       normalizes_time_ ? "the share of max_episode_steps that has passed" : "steps since the reset",
                       MJENV_DTYPE_FLOAT64,
                       {1},
                       total(fields),
                       1});
  }
  const Option& history = options.get("history");
  has_history_ = !history.text.empty() || history.integer > 0;
  const std::string& wanted = options.get("observation").text;
  const bool has_groups =
      std::any_of(fields.begin(), fields.end(), [](const Field& field) { return !field.group.empty(); });
  if (wanted == "dict" || (wanted == "auto" && has_groups)) keys_ = keys_of(fields_);
  const auto whole = static_cast<std::size_t>(history.integer);
  // A history of whole observations stacks each of these blocks separately: the keys of a Dict, or the one Box.
  const std::vector<Field> blocks =
      keys_.empty() ? std::vector<Field>{{MJENV_ROLE_OBSERVATION, "", "", MJENV_DTYPE_FLOAT64, {}, 0, total(fields_)}}
                    : keys_;
  if (whole > 0)
    stack_whole(blocks, whole);
  else
    stack_terms(history.text);

  std::size_t count = 0;
  for (const Stack& stack : stacks_) count += stack.count * stack.frames;
  if (std::any_of(stacks_.begin(), stacks_.end(), [](const Stack& stack) { return stack.frames > 1; }))
    record_count_ = kHead + count;
  if (has_history_)
    check_memory(std::to_string(rows) + " row(s) with the option \"history\"", bytes(count, whole, rows, workers));
  if (whole > 0)
    name_frames(blocks, whole);
  else if (!keys_.empty())
    keys_ = keys_of(fields_);
  set_bounds(count);
}

// How much memory an observation of `count` numbers takes: the rows' records, the bounds, the workers' buffers
// (Writer::scratch), and the descriptions of the fields of each frame.
double Frames::bytes(std::size_t count, std::size_t frames, std::int64_t rows, std::int64_t workers) const {
  constexpr std::size_t kSuffix = std::char_traits<char>::length("[-10000000]"), kWithoutHeap = 15, kOfHeap = 16;
  const auto text = [](std::size_t length) { return length <= kWithoutHeap ? 0 : length + 1 + kOfHeap; };
  std::size_t of_frame = 0;
  for (const Field& field : fields_)
    of_frame += sizeof field + text(field.name.size() + kSuffix) + text(field.doc.size()) + text(field.group.size()) +
                field.shape.size() * sizeof field.shape[0] + kOfHeap;
  const auto real = [](auto number) { return static_cast<double>(number); };
  return real(rows) * real(record_count_ * sizeof(double)) + real(2 + workers) * real(count * sizeof(double)) +
         real(frames) * real(of_frame);
}

// Sets up a history in which each block is stacked as a whole. The blocks together are the task's observation and the
// time.
void Frames::stack_whole(const std::vector<Field>& blocks, std::size_t frames) {
  std::size_t to = 0;
  for (const Field& block : blocks) {
    const Stack stack{to, static_cast<std::size_t>(block.count), frames};
    const auto from = static_cast<std::size_t>(block.offset), end = std::min(from + stack.count, task_count_);
    if (from < end) pieces_.push_back({from, stack.newest(), end - from});
    if (end < from + stack.count) time_at_ = stack.newest() + (task_count_ - from);
    stacks_.push_back(stack);
    to += stack.count * frames;
  }
  stacks_keys_ = blocks.size() > 1;
  const auto length = static_cast<std::int64_t>(frames);
  space_.shape = {length, blocks[0].count};
  if (!keys_.empty()) space_.shape = {static_cast<std::int64_t>(to)};
}

// Lists the fields of all frames (older ones as "NAME[-AGE]"), and gives each key the shape of all its frames.
void Frames::name_frames(const std::vector<Field>& blocks, std::size_t frames) {
  const std::vector<Field> newest = std::move(fields_);
  fields_.clear();
  fields_.reserve(newest.size() * frames);
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const Field& block = blocks[k];
    for (std::size_t i = 0; i < frames; ++i)
      for (Field field : newest) {
        if (field.offset < block.offset || field.offset >= block.offset + block.count) continue;
        const std::size_t age = frames - 1 - i;
        if (age > 0) field.name += "[-" + std::to_string(age) + "]";
        field.offset += static_cast<std::int64_t>(stacks_[k].to + i * stacks_[k].count) - block.offset;
        fields_.push_back(std::move(field));
      }
    if (keys_.empty()) continue;
    Field& key = keys_[k];
    key.shape.insert(key.shape.begin(), static_cast<std::int64_t>(frames));
    key.offset = static_cast<std::int64_t>(stacks_[k].to);
    key.count = static_cast<std::int64_t>(stacks_[k].count * frames);
  }
}

// Sets up a history of single terms: `lengths` names them and the number of their frames.
void Frames::stack_terms(const std::string& lengths) {
  std::vector<std::size_t> frames(fields_.size(), 0);
  std::istringstream words(lengths);
  for (std::string word; words >> word;) {
    const auto [name, length] = length_of(word);
    bool is_found = false;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (!is_called(fields_[i], name)) continue;
      is_found = true;
      if (frames[i] != 0) refuse(MJENV_E_VALUE, "the term " + quoted(fields_[i].name) + " is named twice");
      frames[i] = length;
    }
    if (!is_found)
      refuse(MJENV_E_NAME, "the observation has no term or group " + quoted(name) +
                               choices(name, names_of(fields_), "mjenv_field_at with MJENV_ROLE_OBSERVATION"));
  }
  std::size_t to = 0;
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    Field& field = fields_[i];
    const Stack stack{to, static_cast<std::size_t>(field.count), std::max<std::size_t>(frames[i], 1)};
    const auto from = static_cast<std::size_t>(field.offset);
    if (from == task_count_)
      time_at_ = stack.newest();
    else
      pieces_.push_back({from, stack.newest(), stack.count});
    stacks_.push_back(stack);
    if (frames[i] != 0) field.shape.insert(field.shape.begin(), static_cast<std::int64_t>(frames[i]));
    field.offset = static_cast<std::int64_t>(to);
    field.count = static_cast<std::int64_t>(stack.count * stack.frames);
    to += stack.count * stack.frames;
  }
  space_.shape = {static_cast<std::int64_t>(to)};
}

// Sets the bounds of the observation's `count` numbers. The caller has checked that there is enough memory for them.
void Frames::set_bounds(std::size_t count) {
  space_.low.assign(count, -kInfinity);
  space_.high.assign(count, kInfinity);
  if (!is_timed_) return;
  for (const Stack& stack : stacks_) {
    if (time_at_ < stack.newest() || time_at_ >= stack.newest() + stack.count) continue;
    for (std::size_t i = 0; i < stack.frames; ++i) {
      const std::size_t at = time_at_ - i * stack.count;
      space_.low[at] = 0;
      space_.high[at] = normalizes_time_ ? 1 : static_cast<double>(limit_);
    }
  }
}

void Frames::place(const double* observation, std::int64_t steps, double* to) const {
  for (const Piece& piece : pieces_) std::copy_n(observation + piece.from, piece.count, to + piece.to);
  if (!is_timed_) return;
  const auto time = static_cast<double>(steps);
  to[time_at_] = normalizes_time_ ? static_cast<float>(time / static_cast<double>(limit_)) : time;
}

const double* Frames::add(double* record, const double* observation, std::int64_t steps,
                          std::vector<double>& scratch) const {
  if (record_count_ == 0) return show(record, observation, steps, scratch);
  double* seen = record + kHead;
  if (steps > 0)
    for (const Stack& stack : stacks_)
      std::copy(seen + stack.to + stack.count, seen + stack.newest() + stack.count, seen + stack.to);
  place(observation, steps, seen);
  if (steps == 0)
    for (const Stack& stack : stacks_)
      for (double* to = seen + stack.to; to != seen + stack.newest(); to += stack.count) {
        if (pads_with_zeros_)
          std::fill_n(to, stack.count, 0.0);
        else
          std::copy_n(seen + stack.newest(), stack.count, to);
      }
  record[0] = 1;
  return seen;
}

const double* Frames::show(const double* record, const double* observation, std::int64_t steps,
                           std::vector<double>& scratch) const {
  if (record_count_ > 0) std::copy_n(record + kHead, scratch.size(), scratch.data());
  place(observation, steps, scratch.data());
  return scratch.data();
}

}  // namespace mjenv::core

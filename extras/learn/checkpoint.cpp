#include "checkpoint.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include "error.hpp"
#include "hash.hpp"
#include "system/files.hpp"
#include "system/memory.hpp"

namespace mjenv::learn {
namespace {

constexpr std::string_view kHead = "mjenv-checkpoint 1\n";

// Lines "NAME VALUE" that must be equal for a learner and a checkpoint that it loads.
std::string description(const Settings& settings, const Spaces& spaces) {
  return settings.saved() + "observations " + std::to_string(spaces.observations) + "\nactuators " +
         std::to_string(spaces.actuators) + "\n\n";
}

[[noreturn]] void refuse(const std::string& path, const std::string& reason) {
  core::fail(MJENV_E_SNAPSHOT, core::quoted(path) + " " + reason);
}

// The names and values in a description, followed by the defaults of settings that it may lack because they are newer.
std::vector<std::pair<std::string, std::string>> values_of(const std::string& description) {
  std::vector<std::pair<std::string, std::string>> values;
  const std::string text = description + Settings().saved();
  for (std::size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    const std::size_t blank = std::min(text.find(' ', at), end);
    values.emplace_back(text.substr(at, blank - at), text.substr(blank, end - blank));
  }
  return values;
}

// Compares two descriptions by name, and throws an error that tells the first difference.
void check_description(const std::string& path, const std::string& theirs, const std::string& ours) {
  const auto saved = values_of(theirs), own = values_of(ours);
  const auto line = [](const auto& values, const std::string& name) {
    const auto found = std::find_if(values.begin(), values.end(), [&](const auto& one) { return one.first == name; });
    return core::quoted(found == values.end() ? "" : (name + found->second).substr(0, 100));
  };
  for (const auto* values : {&own, &saved})
    for (const auto& [name, value] : *values)
      if (line(saved, name) != line(own, name))
        refuse(path,
               "is a checkpoint of another learner: it has " + line(saved, name) + ", this one " + line(own, name));
}

template <typename T>
void append(std::vector<std::byte>& to, const T* from, std::size_t count) {
  const auto* begin = reinterpret_cast<const std::byte*>(from);
  to.insert(to.end(), begin, begin + count * sizeof(T));
}

struct Content {
  std::string description, note;
  std::vector<std::byte> state;
};

// Throws unless the file is a whole checkpoint.
Content read_content(const std::string& path) {
  const auto most = static_cast<std::int64_t>(core::free_memory() / 4);  // it is copied
  const std::string bytes = core::read_file(path, most, "", MJENV_E_FILE, MJENV_E_MEMORY);
  const std::string_view text = bytes;
  const std::size_t end = text.find("\n\n");
  if (text.substr(0, kHead.size()) != kHead || end == std::string_view::npos) refuse(path, "is no checkpoint");
  Content content;
  content.description = text.substr(kHead.size(), end + 2 - kHead.size());
  std::uint64_t sum = 0, size = 0;
  const std::size_t summed = end + 2 + sizeof sum, note = summed + sizeof size;
  if (bytes.size() < note) refuse(path, "is damaged: it ends too early");
  std::memcpy(&sum, bytes.data() + end + 2, sizeof sum);
  std::memcpy(&size, bytes.data() + summed, sizeof size);
  if (sum != core::hash(bytes.data() + summed, bytes.size() - summed))
    refuse(path, "is damaged: its checksum is wrong");
  if (size > bytes.size() - note) refuse(path, "is damaged: its sizes do not fit");
  content.note = text.substr(note, size);
  const auto* begin = reinterpret_cast<const std::byte*>(bytes.data());
  content.state.assign(begin + note + size, begin + bytes.size());
  return content;
}

}  // namespace

// A checkpoint consists of the head, the description, an empty line, the checksum of what follows, the size of the note,
// the note, and the state.
void write_checkpoint(const std::string& path, const Settings& settings, const Spaces& spaces, const std::string& note,
                      const std::vector<std::byte>& state) {
  const std::string text = std::string(kHead) + description(settings, spaces);
  const std::uint64_t size = note.size();
  std::uint64_t sum = 0;
  std::vector<std::byte> content;
  content.reserve(text.size() + sizeof sum + sizeof size + note.size() + state.size());
  append(content, text.data(), text.size());
  append(content, &sum, 1);
  append(content, &size, 1);
  append(content, note.data(), note.size());
  append(content, state.data(), state.size());
  const std::size_t summed = text.size() + sizeof sum;
  sum = core::hash(content.data() + summed, content.size() - summed);
  std::memcpy(content.data() + text.size(), &sum, sizeof sum);
  core::replace_file(path, content.data(), content.size());
}

std::vector<std::byte> read_checkpoint(const std::string& path, const Settings& settings, const Spaces& spaces) {
  Content content = read_content(path);
  check_description(path, content.description, description(settings, spaces));
  return std::move(content.state);
}

std::string read_note(const std::string& path) { return read_content(path).note; }

}  // namespace mjenv::learn

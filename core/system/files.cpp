#include "system/files.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "error.hpp"

namespace mjenv::core {
namespace {

[[noreturn]] void cannot_write(const std::string& path, const std::string& why) {
  fail(MJENV_E_FILE, "cannot write " + quoted(path) + ": " + why);
}

// Creates a file beside `path`, whose name becomes `beside`. Null: errno says why.
std::FILE* create_beside(const std::string& path, std::string& beside) {
  constexpr int kTries = 1000;  // others may write the same file at the same time, or may have left theirs behind
  std::FILE* file = nullptr;
  for (int i = 0; !file && (i == 0 || (errno == EEXIST && i < kTries)); ++i) {
    beside = path + ".partial" + (i == 0 ? "" : std::to_string(i));
    file = platform::create_new(beside);
  }
  return file;
}

}  // namespace

std::string read_file(const std::string& path, std::int64_t max_bytes, const char* what, mjenv_status unreadable,
                      mjenv_status too_large) {
  return read_file(platform::InputFile(path), path, max_bytes, what, unreadable, too_large);
}

std::string read_file(const platform::InputFile& file, const std::string& path, std::int64_t max_bytes,
                      const char* what, mjenv_status unreadable, mjenv_status too_large) {
  const auto cannot = [&](const char* why) { fail(unreadable, what + quoted(path) + " cannot be read: " + why); };
  if (!file.is_open()) cannot(std::strerror(errno));
  const platform::FileStatus status = file.status();
  if (!status.is_regular) cannot("it is no regular file");
  if (status.bytes > max_bytes)
    fail(too_large, what + quoted(path) + " has " + std::to_string(status.bytes) + " bytes; the limit is " +
                        std::to_string(max_bytes));
  std::string content(static_cast<std::size_t>(status.bytes), '\0');
  std::size_t got = 0;
  while (got < content.size()) {
    const std::int64_t count = file.read(&content[got], content.size() - got);
    if (count < 0) cannot(std::strerror(errno));
    if (count == 0) break;
    got += static_cast<std::size_t>(count);
  }
  content.resize(got);
  return content;
}

void replace_file(const std::string& path, const void* content, std::size_t size) {
  if (const platform::InputFile old(path); old.is_open() && !old.status().is_regular)
    cannot_write(path, "it is no regular file");
  std::string beside;
  std::FILE* file = create_beside(path, beside);
  if (!file) cannot_write(path, std::strerror(errno));
  bool written = std::fwrite(content, 1, size, file) == size && platform::write_through(file);
  int error = errno;
  if (std::fclose(file) != 0 && written) {
    written = false;
    error = errno;
  }
  if (written && platform::rename_over(beside, path)) return;
  if (written) error = errno;
  platform::remove_file(beside);
  cannot_write(path, std::strerror(error));
}

}  // namespace mjenv::core

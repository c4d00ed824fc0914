#include "file.hpp"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "error.hpp"

namespace mjenv::learn {
namespace {

[[noreturn]] void fail_at(const char* what, const std::string& path, const std::string& reason) {
  core::fail(MJENV_E_FILE, "cannot " + std::string(what) + " " + core::quoted(path) + ": " + reason);
}

// The operating system's last error, as a text.
std::string system_reason() { return std::generic_category().message(errno != 0 ? errno : EIO); }

}  // namespace

void replace_file(const std::string& path, const void* content, std::size_t size) {
  const auto target = std::filesystem::u8path(path), partial = std::filesystem::u8path(path + ".partial");
  errno = 0;
  std::ofstream file(partial, std::ios::binary | std::ios::trunc);
  file.write(static_cast<const char*>(content), static_cast<std::streamsize>(size));
  file.close();
  std::error_code error;
  if (!file) {
    const std::string reason = system_reason();
    std::filesystem::remove(partial, error);
    fail_at("write", path, reason);
  }
  std::filesystem::rename(partial, target, error);
  if (!error) return;
  std::error_code ignored;
  std::filesystem::remove(partial, ignored);
  fail_at("write", path, error.message());
}

std::vector<std::byte> read_file(const std::string& path) {
  errno = 0;
  std::ifstream file(std::filesystem::u8path(path), std::ios::binary);
  std::vector<std::byte> content;
  char part[65536];
  while (file.read(part, sizeof part) || file.gcount() > 0) {
    const auto* begin = reinterpret_cast<const std::byte*>(part);
    content.insert(content.end(), begin, begin + file.gcount());
  }
  if (file.bad() || !file.eof()) fail_at("read", path, system_reason());
  return content;
}

}  // namespace mjenv::learn

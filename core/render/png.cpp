#include "render/png.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <system_error>
#include <vector>

#include "error.hpp"

namespace mjenv::core {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append_big_endian(Bytes& to, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<std::uint8_t>(value >> shift));
}

std::uint32_t crc(const std::uint8_t* data, std::size_t size) {
  std::uint32_t sum = 0xFFFFFFFF;
  for (std::size_t i = 0; i < size; ++i) {
    sum ^= data[i];
    for (int bit = 0; bit < 8; ++bit) sum = sum & 1 ? sum >> 1 ^ 0xEDB88320 : sum >> 1;
  }
  return ~sum;
}

void append_chunk(Bytes& to, const char* type, const Bytes& data) {
  append_big_endian(to, static_cast<std::uint32_t>(data.size()));
  const std::size_t start = to.size();
  to.insert(to.end(), type, type + 4);
  to.insert(to.end(), data.begin(), data.end());
  append_big_endian(to, crc(to.data() + start, to.size() - start));
}

// zlib's format without compression.
Bytes stored(const Bytes& data) {
  constexpr std::size_t kMost = 0xFFFF;
  Bytes out{0x78, 0x01};
  std::uint32_t a = 1, b = 0;  // Adler's sum
  for (std::size_t start = 0; start < data.size(); start += kMost) {
    const std::size_t size = std::min(kMost, data.size() - start);
    out.push_back(start + size == data.size());
    for (const std::size_t word : {size, ~size}) {
      out.push_back(static_cast<std::uint8_t>(word));
      out.push_back(static_cast<std::uint8_t>(word >> 8));
    }
    for (std::size_t i = start; i < start + size; ++i) {
      out.push_back(data[i]);
      a = (a + data[i]) % 65521;
      b = (b + a) % 65521;
    }
  }
  append_big_endian(out, b << 16 | a);
  return out;
}

Bytes png_of(const std::uint8_t* rgb, int width, int height) {
  Bytes header, lines;
  append_big_endian(header, static_cast<std::uint32_t>(width));
  append_big_endian(header, static_cast<std::uint32_t>(height));
  header.insert(header.end(), {8, 2, 0, 0, 0});  // bits a colour, colours without a palette
  const std::size_t length = 3 * static_cast<std::size_t>(width);
  for (int y = 0; y < height; ++y) {
    lines.push_back(0);  // no filter
    lines.insert(lines.end(), rgb, rgb + length);
    rgb += length;
  }
  Bytes png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  append_chunk(png, "IHDR", header);
  append_chunk(png, "IDAT", stored(lines));
  append_chunk(png, "IEND", {});
  return png;
}

std::filesystem::path temporary_folder() {
  std::error_code error;
  auto folder = std::filesystem::temp_directory_path(error);
  if (!error) return folder;
  const char* chosen = std::getenv("TMPDIR");
  fail(MJENV_E_RENDER, "no folder to save a picture in: the environment variable TMPDIR is " +
                           (chosen ? mjenv::core::quoted(chosen) : "unset") + " (" + error.message() + ")");
}

}  // namespace

std::string save_png(const std::uint8_t* rgb, int width, int height) {
  const Bytes png = png_of(rgb, width, height);
  std::string path = temporary_folder() / "frame_XXXXXX.png";
  const int descriptor = mkstemps(path.data(), 4);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(descriptor < 0 ? nullptr : fdopen(descriptor, "wb"),
                                                             std::fclose);
  if (!file || std::fwrite(png.data(), 1, png.size(), file.get()) != png.size() || std::fflush(file.get()) != 0)
    fail(MJENV_E_RENDER, "the picture " + mjenv::core::quoted(path) + " cannot be written");
  return path;
}

}  // namespace mjenv::core

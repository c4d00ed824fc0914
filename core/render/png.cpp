#include "render/png.hpp"

#include <lodepng.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <system_error>
#include <vector>

#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

std::filesystem::path temporary_folder() {
  std::error_code error;
  auto folder = std::filesystem::temp_directory_path(error);
  if (!error) return folder;
  const auto chosen = platform::environment("TMPDIR");
  fail(MJENV_E_RENDER, "no folder to save a picture in: the environment variable TMPDIR is " +
                           (chosen ? core::quoted(*chosen) : "unset") + " (" + error.message() + ")");
}

}  // namespace

std::string save_png(const std::uint8_t* rgb, int width, int height) {
  std::vector<unsigned char> png;
  if (const unsigned error =
          lodepng::encode(png, rgb, static_cast<unsigned>(width), static_cast<unsigned>(height), LCT_RGB))
    fail(MJENV_E_RENDER, std::string("the picture cannot be saved: ") + lodepng_error_text(error));
  std::string path = (temporary_folder() / "frame_XXXXXX.png").u8string();
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(platform::create_file(path, 4), std::fclose);
  if (!file || std::fwrite(png.data(), 1, png.size(), file.get()) != png.size() || std::fflush(file.get()) != 0)
    fail(MJENV_E_RENDER, "the picture " + core::quoted(path) + " cannot be written");
  return path;
}

}  // namespace mjenv::core

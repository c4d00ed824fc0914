// Reads the files of a model. A trusted model may read any file, an untrusted one only files in its folder and below.
#pragma once

#include <cerrno>
#include <cstring>
#include <string>

#include "engine/untrusted/files.hpp"
#include "engine/untrusted/limits.hpp"
#include "system/platform.hpp"

namespace mjenv::core {

class Folder {
 public:
  // `model` is the path of the model, or "" for a model from memory.
  Folder(const std::string& model, Limits limits)
      : path_(model.substr(0, model.find_last_of("/\\") + 1)), exists_(!model.empty()), limits_(limits) {}

  // Reads a file, which the model calls by this name. Fails with MJENV_E_MODEL.
  std::string read(const std::string& file, const std::string& name, const Limit& bytes) {
    constexpr std::size_t kMaxPath = 900;  // MuJoCo copies paths to buffers of 1000
    if (file.find('\0') != std::string::npos || file.size() > kMaxPath)
      refuse("file " + quoted(name) + " cannot be read: its path is too long or contains a NUL character");
    if (const auto why = limits_.excess("files", ++files_, kFiles); !why.empty()) refuse(why);
    if (!limits_.trusted()) check_inside(file, name);
    return read_file(file, limits_.of(bytes));
  }
  // Whether any file has been read.
  bool used() const { return files_ > 0; }

 private:
  std::string path_;
  bool exists_;
  Limits limits_;
  std::int64_t files_ = 0;

  void check_inside(const std::string& file, const std::string& name) const {
    if (!exists_)
      refuse("the model refers to file " + quoted(name) + ", but has no folder, because it comes from memory" +
             kUnlessTrusted);
    const std::string below = file.compare(0, path_.size(), path_) == 0 ? file.substr(path_.size()) : file;
    if (platform::names_no_file(below))
      refuse("file " + quoted(name) +
             " is refused, because such a name may stand for a device, a stream, a drive or another machine" +
             kUnlessTrusted);
    const std::string own = resolved(path_.empty() ? "." : path_), real = resolved(file);
    if (real.compare(0, own.size(), own) != 0 || (own.back() != '/' && real[own.size()] != '/'))
      refuse("file " + quoted(file) + " is outside of the model's folder " + quoted(own) + kUnlessTrusted);
  }
  // The path with its symbolic links resolved.
  static std::string resolved(const std::string& path) {
    std::string real = platform::real_path(path);
    if (real.empty()) refuse("file " + quoted(path) + " cannot be read: " + std::strerror(errno));
    return real;
  }
};

}  // namespace mjenv::core

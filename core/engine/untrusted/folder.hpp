// Reads the files of a model. A trusted model may read any file, an untrusted one only files in its folder and below.
#pragma once

#include <cerrno>
#include <cstring>
#include <memory>
#include <string>

#include "engine/load.hpp"
#include "engine/mujoco.hpp"
#include "engine/untrusted/files.hpp"
#include "engine/untrusted/limits.hpp"
#include "system/files.hpp"
#include "system/platform.hpp"

namespace mjenv::core {

class Folder {
 public:
  // `model` is the path of the model, or "" for a model from memory.
  Folder(const std::string& model, Limits limits)
      : path_(model.substr(0, model.find_last_of("/\\") + 1)), exists_(!model.empty()), limits_(limits) {}

  // Returns the content of a file, which the model calls by this name. Reads each file only once, so that MuJoCo gets
  // what has been checked, even if the file changes. Fails with MJENV_E_MODEL.
  const std::string& read(const std::string& file, const std::string& name, const Limit& bytes) {
    constexpr std::size_t kMaxPath = 900;  // MuJoCo copies paths to buffers of 1000
    if (file.find('\0') != std::string::npos || file.size() > kMaxPath)
      refuse("file " + quoted(name) + " cannot be read: its path is too long or contains a NUL character");
    if (const auto why = limits_.excess("files", ++count_, kFiles); !why.empty()) refuse(why);
    auto& content = files_[file];
    if (!content) content = std::make_shared<const std::string>(read_now(file, name, limits_.of(bytes)));
    return *content;
  }

  // Whether there is such a file. MuJoCo gets the same answer later.
  bool has(const std::string& file) {
    const auto found = files_.find(file);
    if (found != files_.end()) return found->second != nullptr;
    const bool exists = platform::status_of(file).exists;
    if (!exists) files_[file] = nullptr;
    return exists;
  }

  // The files that have been read or looked for.
  const Files& files() const { return files_; }

 private:
  std::string path_;
  bool exists_;
  Limits limits_;
  std::int64_t count_ = 0;
  Files files_;
  std::string real_path_;  // of the folder, from the first file on

  std::string read_now(const std::string& file, const std::string& name, std::int64_t max_bytes) {
    if (limits_.trusted()) return read_file(file, max_bytes);
    if (!kKnowsFilesByPath)
      for (const auto& [other, content] : files_)
        if (content && name_of(other) == name_of(file))
          refuse("the files " + quoted(other) + " and " + quoted(file) +
                 " have the same name, by which MuJoCo's shared library tells files apart" + kUnlessTrusted);
    const platform::InputFile opened(path_inside(file, name), platform::InputFile::Links::refused);
    return read_file(opened, file, max_bytes);
  }

  // The real path of a file that is in the folder.
  std::string path_inside(const std::string& file, const std::string& name) {
    if (!exists_)
      refuse("the model refers to file " + quoted(name) + ", but has no folder, because it comes from memory" +
             kUnlessTrusted);
    const std::string below = file.compare(0, path_.size(), path_) == 0 ? file.substr(path_.size()) : file;
    if (platform::names_no_file(below))
      refuse("file " + quoted(name) +
             " is refused, because such a name may stand for a device, a stream, a drive or another machine" +
             kUnlessTrusted);
    if (real_path_.empty()) real_path_ = resolved(path_.empty() ? "." : path_);
    std::string real = resolved(file);
    if (real.compare(0, real_path_.size(), real_path_) != 0 ||
        (real_path_.back() != '/' && real[real_path_.size()] != '/'))
      refuse("file " + quoted(file) + " is outside of the model's folder " + quoted(real_path_) + kUnlessTrusted);
    return real;
  }
  // The path with its symbolic links resolved.
  static std::string resolved(const std::string& path) {
    std::string real = platform::real_path(path);
    if (real.empty()) refuse("file " + quoted(path) + " cannot be read: " + std::strerror(errno));
    return real;
  }
};

}  // namespace mjenv::core

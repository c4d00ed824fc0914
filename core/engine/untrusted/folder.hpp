// The files that a model may read: a trusted one any, a stranger's only those in its own folder and below.
#pragma once

#include <string>

#include "engine/untrusted/limits.hpp"

namespace mjenv::core {

class Folder {
 public:
  // Of the model with this path, which is "" for a model from memory.
  Folder(const std::string& model, Limits limits);

  // "", or a path that ends in "/".
  const std::string& path() const { return path_; }
  // The content of a file, which the model refers to by this name. Fails with MJENV_E_MODEL.
  std::string read(const std::string& file, const std::string& name, const Limit& bytes);
  // Whether any file has been read.
  bool used() const { return files_ > 0; }

 private:
  std::string path_;
  bool exists_;
  Limits limits_;
  std::int64_t files_ = 0;

  void check_inside(const std::string& file, const std::string& name) const;
};

}  // namespace mjenv::core

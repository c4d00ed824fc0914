// The files that a model may read: all if it is trusted, else only those in its folder and below.
#pragma once

#include <string>

#include "engine/untrusted/limits.hpp"

namespace mjenv::core {

class Folder {
 public:
  // `model` is the path of the model, or "" for a model from memory.
  Folder(const std::string& model, Limits limits);

  // Returns "", or a path that ends in "/".
  const std::string& path() const { return path_; }
  // Reads a file, which the model calls by this name. Fails with MJENV_E_MODEL.
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

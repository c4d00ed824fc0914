#pragma once

#include <memory>
#include <string>

#include "engine/mujoco.hpp"
#include "error.hpp"

namespace mjenv::core {

// Makes MuJoCo read a text in memory as if it were a file in the folder. The folder need not exist.
class MemoryFile {
 public:
  MemoryFile(const std::string& folder, const std::string& text)
      : path_(folder + "<model>"), files_(new mjVFS, release) {
    mj_defaultVFS(files_.get());
    if (text.empty()) fail(MJENV_E_MODEL, "it is empty");
    add_file(*files_, path_, text);
  }
  const std::string& path() const { return path_; }
  const mjVFS& files() const { return *files_; }

 private:
  std::string path_;
  static void release(mjVFS* files) {
    mj_deleteVFS(files);
    delete files;
  }
  std::unique_ptr<mjVFS, void (*)(mjVFS*)> files_;
};

}  // namespace mjenv::core

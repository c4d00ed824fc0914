#pragma once

#include <mujoco/mujoco.h>

#include <cstring>
#include <memory>
#include <new>
#include <string>

#include "error.hpp"

namespace mjenv::core {

// Gives MuJoCo a text in place of a file with the name kName, in any folder.
class MemoryFile {
 public:
  static constexpr const char* kName = "<model>";

  explicit MemoryFile(const std::string& text) : files_(new mjVFS, release) {
    mj_defaultVFS(files_.get());
    if (text.empty()) fail(MJENV_E_MODEL, "it is empty");
    if (mj_makeEmptyFileVFS(files_.get(), kName, static_cast<int>(text.size())) != 0) throw std::bad_alloc();
    std::memcpy(files_->filedata[0], text.data(), text.size());
  }
  const mjVFS& files() const { return *files_; }

 private:
  static void release(mjVFS* files) {
    mj_deleteVFS(files);
    delete files;
  }
  std::unique_ptr<mjVFS, void (*)(mjVFS*)> files_;
};

}  // namespace mjenv::core

#include "engine/compile.hpp"

#include <mujoco/mujoco.h>

#include <new>

#include "engine/errors.hpp"
#include "engine/load.hpp"
#include "engine/memory_file.hpp"
#include "engine/versions.hpp"
#include "error.hpp"
#include "system/locale.hpp"

namespace mjenv::core {

mjModel* compile(const std::string& folder, const std::string& text, std::int64_t hull_limit) {
  const ClassicLocale locale;
  const ErrorTrap trap;
  const MemoryFile file(text);
  std::string reason;
  if (mjModel* model = load(folder + MemoryFile::kName, file.files(), hull_limit, reason)) return model;
  if (lacks_memory(reason.c_str())) throw std::bad_alloc();
  fail(MJENV_E_MODEL, with_version(reason));
}

}  // namespace mjenv::core

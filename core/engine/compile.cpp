#include "engine/compile.hpp"

#include <memory>
#include <new>

#include "engine/errors.hpp"
#include "engine/load.hpp"
#include "engine/memory_file.hpp"
#include "engine/mujoco.hpp"
#include "engine/versions.hpp"
#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {

mjModel* compile(const std::string& folder, const std::string& text, std::int64_t hull_limit) {
  const platform::ClassicLocale locale;
  const ErrorTrap trap;
  const MemoryFile file(folder, text);
  std::string reason;
  if (mjModel* model = load(file.path(), file.files(), hull_limit, reason)) {
    std::unique_ptr<mjModel, void (*)(mjModel*)> owned(model, mj_deleteModel);
    check_supported(*owned);
    return owned.release();
  }
  if (lacks_memory(reason.c_str())) throw std::bad_alloc();
  fail(MJENV_E_MODEL, with_version(reason));
}

}  // namespace mjenv::core

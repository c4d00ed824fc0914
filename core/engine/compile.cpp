#include "engine/compile.hpp"

#include <mujoco/mujoco.h>

#include <array>
#include <cstring>
#include <memory>
#include <new>

#include "engine/errors.hpp"
#include "engine/versions.hpp"
#include "error.hpp"
#include "system/locale.hpp"

#include <pthread.h>

#include <cstdlib>
#include <locale>
#include <mutex>

namespace mjenv::core {
namespace {

using Reason = std::array<char, 1000>;

constexpr const char* kName = "<model>";

// A text that MuJoCo finds in place of a file of that name, in any folder.
class File {
 public:
  explicit File(const std::string& text) : files_(new mjVFS, release) {
    mj_defaultVFS(files_.get());
    if (text.empty()) fail(MJENV_E_MODEL, "it is empty");
    if (mj_makeEmptyFileVFS(files_.get(), kName, static_cast<int>(text.size())) != 0) throw std::bad_alloc();
    std::memcpy(files_->filedata[0], text.data(), text.size());
  }
  const mjVFS* get() const { return files_.get(); }

 private:
  static void release(mjVFS* files) {
    mj_deleteVFS(files);
    delete files;
  }
  std::unique_ptr<mjVFS, void (*)(mjVFS*)> files_;
};

// MuJoCo keeps the last model under a lock. This lock is held longer, and a fork waits for it, so
// that a child never finds MuJoCo's held by a thread that it does not have.
std::mutex one_at_a_time;
[[maybe_unused]] const int registered =
    pthread_atfork([] { one_at_a_time.lock(); }, [] { one_at_a_time.unlock(); }, [] { one_at_a_time.unlock(); });

// Gives the C library's rand() another state, because MuJoCo seeds it, and takes it back: the host's sequence goes on.
class OtherRandom {
 public:
  OtherRandom() : before_(initstate(1, state_.data(), state_.size())) {}
  ~OtherRandom() { setstate(before_); }
  OtherRandom(const OtherRandom&) = delete;
  OtherRandom& operator=(const OtherRandom&) = delete;

 private:
  std::array<char, 128> state_{};
  char* before_;
};

mjModel* load_in_any_locale(const char* path, const mjVFS* files, Reason& reason) {
  mjModel* model = mj_loadXML(path, files, reason.data(), static_cast<int>(reason.size()));
  mj_freeLastXML();  // which is kept for mj_saveLastXML
  return model;
}

// MuJoCo 2.2.2 reads numbers by streams in the global locale of C++, if it uses the same C++ library as the host. Only
// the host can set that, so models are refused where it changes numbers.
void check_global_locale() {
  if (std::locale() == std::locale::classic()) return;
  const File file("<mujoco><option timestep='1234.5'/></mujoco>");
  Reason reason{};
  mjModel* model = load_in_any_locale(kName, file.get(), reason);
  const bool right = model && model->opt.timestep == 1234.5;
  mj_deleteModel(model);
  if (!right)
    fail(MJENV_E_MODEL,
         "in the global locale " + quoted(std::locale().name()) +
             " MuJoCo's shared library misreads numbers: call std::locale::global(std::locale::classic()) "
             "before environments are created, or build mjenv with MJENV_ENGINE=source");
}

mjModel* load(const char* path, const mjVFS* files, std::int64_t, Reason& reason) {
  const std::lock_guard lock(one_at_a_time);
  const OtherRandom random;
  check_global_locale();
  std::unique_ptr<mjModel, void (*)(mjModel*)> model(load_in_any_locale(path, files, reason), mj_deleteModel);
  check_global_locale();  // the host may have set it meanwhile
  return model.release();
}

}  // namespace

mjModel* compile(const std::string& folder, const std::string& text, std::int64_t hull_work) {
  const ClassicLocale locale;
  const ErrorTrap trap;
  const File file(text);
  Reason reason{};
  if (mjModel* model = load((folder + kName).c_str(), file.get(), hull_work, reason)) return model;
  if (lacks_memory(reason.data())) throw std::bad_alloc();
  fail(MJENV_E_MODEL, with_version(reason.data()));
}

}  // namespace mjenv::core

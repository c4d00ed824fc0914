// Loads models with a shared library of MuJoCo.
#include <pthread.h>

#include <array>
#include <cstdlib>
#include <locale>
#include <memory>
#include <mutex>

#include "engine/load.hpp"
#include "engine/memory_file.hpp"
#include "engine/mujoco.hpp"
#include "error.hpp"

namespace mjenv::core {
namespace {

// MuJoCo holds its own lock while it loads a model. If the process forked then, the child could never take that lock.
// So this lock is taken first, and fork() waits for it.
std::mutex one_at_a_time;
[[maybe_unused]] const int registered =
    pthread_atfork([] { one_at_a_time.lock(); }, [] { one_at_a_time.unlock(); }, [] { one_at_a_time.unlock(); });

// Gives the C library's rand() another state while MuJoCo, which seeds it, loads a model. Then restores the host's.
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

using OwnedModel = std::unique_ptr<mjModel, void (*)(mjModel*)>;

OwnedModel load_in_any_locale(const char* path, const mjVFS& files, std::string& reason) {
  std::array<char, 1000> text{};
  OwnedModel model(mj_loadXML(path, &files, text.data(), static_cast<int>(text.size())), mj_deleteModel);
  mj_freeLastXML();  // MuJoCo keeps the parsed XML for mj_saveLastXML
  reason = text.data();
  return model;
}

// MuJoCo reads numbers by streams in the global locale of C++, if it uses the same C++ library as the host. Only
// the host can set that locale, so all models are refused while it changes numbers.
void check_global_locale() {
  if (std::locale() == std::locale::classic()) return;
  const MemoryFile file("", "<mujoco><option timestep='1234.5'/></mujoco>");
  std::string reason;
  const OwnedModel model = load_in_any_locale(file.path().c_str(), file.files(), reason);
  if (!model || model->opt.timestep != 1234.5)
    fail(MJENV_E_MODEL,
         "in the global locale " + quoted(std::locale().name()) +
             " MuJoCo's shared library misreads numbers: call std::locale::global(std::locale::classic()) "
             "before environments are created, or build mjenv with MJENV_ENGINE=source");
}

}  // namespace

const bool kLoadLimitsHulls = false;
const bool kLengthRangesEnd = false;

mjModel* load(const std::string& path, const mjVFS& files, std::int64_t, std::string& reason) {
  const std::lock_guard lock(one_at_a_time);
  const OtherRandom random;
  check_global_locale();
  OwnedModel model = load_in_any_locale(path.c_str(), files, reason);
  check_global_locale();  // the host may have set it meanwhile
  return model.release();
}

}  // namespace mjenv::core

// Loads models with a shared library of MuJoCo.
#include <pthread.h>

#include <array>
#include <cstdlib>
#include <locale>
#include <memory>
#include <mutex>
#include <new>

#include "engine/load.hpp"
#include "engine/mujoco.hpp"
#include "error.hpp"

namespace mjenv::core {
namespace {

// MuJoCo holds a lock of its own while it loads a model. If another thread forked meanwhile, the child could never take
// that lock. So each load first takes this lock, and fork() waits until it is free.
std::mutex one_at_a_time;
[[maybe_unused]] const int registered =
    pthread_atfork([] { one_at_a_time.lock(); }, [] { one_at_a_time.unlock(); }, [] { one_at_a_time.unlock(); });

// MuJoCo seeds the C library's rand() when it loads a model. While this object lives, rand() has another state, so that
// the host's random numbers do not change.
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

OwnedModel load_in_any_locale(const char* path, const Files& files, std::string& reason) {
  const VirtualFiles virtual_files(files);
  std::array<char, 1000> text{};
  OwnedModel model(mj_loadXML(path, virtual_files.get(), text.data(), static_cast<int>(text.size())), mj_deleteModel);
  mj_freeLastXML();  // MuJoCo would keep the parsed XML for mj_saveLastXML, which nobody calls
  reason = text.data();
  return model;
}

// MuJoCo reads numbers from C++ streams. If it shares the host's C++ library, these use the host's global locale, which
// this library must not change. So it refuses all models while that locale writes numbers in another way.
void check_global_locale() {
  if (std::locale() == std::locale::classic()) return;
  const char* const path = "<model>";
  const Files files{{path, std::make_shared<const std::string>("<mujoco><option timestep='1234.5'/></mujoco>")}};
  std::string reason;
  const OwnedModel model = load_in_any_locale(path, files, reason);
  if (!model || model->opt.timestep != 1234.5)
    fail(MJENV_E_MODEL,
         "in the global locale " + quoted(std::locale().name()) +
             " MuJoCo's shared library misreads numbers: call std::locale::global(std::locale::classic()) "
             "before environments are created, or build mjenv with MJENV_ENGINE=source");
}

// If memory runs out while MuJoCo loads a model, MuJoCo does not free what it holds: 172 KB in version 4.0.0. So no load
// begins unless as much memory is free as MuJoCo 4.0 needs for a small robot.
void check_free_memory() {
  constexpr std::size_t kNeeded = std::size_t{32} << 20;
  void* const volatile room = std::malloc(kNeeded);  // volatile: otherwise the compiler drops the allocation
  if (!room) throw std::bad_alloc();
  std::free(room);
}

}  // namespace

const bool kLoadLimitsHulls = false;
const bool kLengthRangesEnd = false;
const bool kCompilesOnThreads = true;

mjModel* load(const std::string& path, const Files& files, const Limits&, std::string& reason) {
  check_free_memory();
  const std::lock_guard lock(one_at_a_time);
  const OtherRandom random;
  check_global_locale();
  OwnedModel model = load_in_any_locale(path.c_str(), files, reason);
  check_global_locale();  // again, because the host may have set another locale during the load
  return model.release();
}

}  // namespace mjenv::core

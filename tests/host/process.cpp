// What of the process MuJoCo's loader could read or change: locales, random numbers, signal handlers, the environment,
// the working folder, the mask of new files' permissions, open files and threads. Models do not depend on them, and
// they stay.
#include <dirent.h>
#include <locale.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <locale>
#include <thread>

#include "host.hpp"

namespace {

// Two positions, as InvertedPendulum needs, a mesh's vertices, numbers of every kind, and a texture with random dots.
constexpr const char* kModel =
    "<mujoco><option timestep='0.00250'/>"
    "<asset><texture name='dots' type='2d' builtin='flat' mark='random' random='0.125' width='64' height='64'/>"
    "<mesh name='corner' vertex='0 0 0  1.250 0 0  0 1.250 0  0 0 1.250'/></asset>"
    "<worldbody><body><joint name='x' type='slide' axis='1 0 0'/><joint axis='0 1.5 0'/>"
    "<geom size='0.125' mass='1.250'/><geom type='mesh' mesh='corner' mass='1234.5'/></body></worldbody>"
    "<actuator><motor joint='x' ctrlrange='-1.5 1.5' ctrllimited='true'/></actuator></mujoco>";
const Setting kOwn{"InvertedPendulum-v5", kModel};

// Everything that a model holds, and what is computed with it.
std::vector<unsigned char> image_of(const Setting& setting) {
  mjenv_env* env = made(setting);
  played(env, 1, 0.25);
  int64_t size = 0;
  assert_ok(mjenv_snapshot(env, MJENV_ALL_ROWS, nullptr, 0, &size));
  std::vector<unsigned char> image(size);
  assert_ok(mjenv_snapshot(env, MJENV_ALL_ROWS, image.data(), size, &size));
  mjenv_destroy(env);
  return image;
}

std::vector<double> masses() {
  mjenv_env* env = made(kOwn);
  const auto found = read(env, 0, "body_mass");
  mjenv_destroy(env);
  return found;
}

// ---- Locales ----

// As in much of Europe: 1.234,5 for a thousand and a bit.
class Commas : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

class Global {
 public:
  explicit Global(const std::locale& locale) : before_(std::locale::global(locale)) {}
  ~Global() { std::locale::global(before_); }

 private:
  std::locale before_;
};

const std::locale& commas() {
  static const std::locale locale(std::locale::classic(), new Commas);
  return locale;
}

#ifdef MJENV_ENGINE_COMPILED_IN
void test_global_locale(void**) {
  const auto expected = image_of(kOwn), built_in = image_of({"Ant-v5"});
  const Global global(commas());
  assert_true(image_of(kOwn) == expected);
  assert_true(image_of({"Ant-v5"}) == built_in);
  assert_true(masses()[1] == 1.25 + 1234.5);
  assert_true(std::locale() == commas());
}

// Another thread sets it all the time.
void test_changing_locale(void**) {
  const auto expected = image_of(kOwn);
  std::atomic<bool> stop{false};
  const std::locale before;
  std::thread other([&] {
    while (!stop) {
      std::locale::global(commas());
      std::locale::global(before);
    }
  });
  bool same = true;
  for (int i = 0; i < 50; ++i) same = same && image_of(kOwn) == expected;
  stop = true;
  other.join();
  assert_true(same);
}
#else
// The shared library reads models in it: a model is right or refused.
void test_global_locale(void**) {
  const Global global(commas());
  for (const Setting& setting : {kOwn, Setting{"Ant-v5"}}) {
    mjenv_env* env = nullptr;
    assert_int_equal(create(setting, &env), MJENV_E_MODEL);
    assert_non_null(std::strstr(mjenv_last_error(), "std::locale::global(std::locale::classic())"));
  }
}

void test_changing_locale(void**) {
  std::locale::global(commas());
  std::locale::global(std::locale::classic());
  assert_true(masses()[1] == 1.25 + 1234.5);
}
#endif

// C's locales, of the process and of the thread: one with commas, made here, and two that there may be.
void test_c_locales(void**) {
  char folder[] = "/tmp/mjenv-locales-XXXXXX";
  assert_non_null(mkdtemp(folder));
  const std::string source = std::string(folder) + "/source", commas = std::string(folder) + "/commas";
  std::FILE* file = std::fopen(source.c_str(), "wb");
  assert_non_null(file);
  std::fputs("LC_NUMERIC\ndecimal_point \",\"\nthousands_sep \".\"\ngrouping 3;3\nEND LC_NUMERIC\n", file);
  std::fclose(file);
  // It complains of all that is left to its defaults.
  const int made_it = std::system(
      ("localedef --force --inputfile=" + source + " --charmap=ANSI_X3.4-1968 " + commas + " >/dev/null 2>&1").c_str());
  setenv("LOCPATH", folder, 1);
  const bool reads_commas = made_it != -1 && setlocale(LC_ALL, "commas") && std::strtod("1,5", nullptr) == 1.5;
  setlocale(LC_ALL, "C");
  assert_true(reads_commas);

  const auto expected = image_of(kOwn);
  for (const char* name : {"commas", "C.UTF-8", "tr_TR.UTF-8"}) {
    if (!setlocale(LC_ALL, name)) continue;
    const auto found = image_of(kOwn);
    const std::string after = setlocale(LC_ALL, nullptr);
    setlocale(LC_ALL, "C");
    assert_true(found == expected);
    assert_string_equal(after.c_str(), name);
    const locale_t own = newlocale(LC_ALL_MASK, name, nullptr), process = uselocale(own);
    const auto found_too = image_of(kOwn);
    const locale_t left = uselocale(process);
    assert_true(found_too == expected);
    assert_true(left == own);
    freelocale(own);
  }
  unsetenv("LOCPATH");
  std::system(("rm -r " + std::string(folder)).c_str());
}

// ---- Random numbers ----

void test_random_numbers(void**) {
  srand(7);
  std::vector<int> expected(100), found(100);
  for (int& number : expected) number = rand();
  srand(7);
  for (size_t i = 0; i < found.size(); ++i) {
    if (i % 10 == 0) image_of(kOwn);
    found[i] = rand();
  }
  assert_true(found == expected);
}

#ifdef MJENV_ENGINE_COMPILED_IN
// The random dots are the same while another thread draws numbers.
void test_random_dots(void**) {
  const auto expected = image_of(kOwn);
  std::atomic<bool> stop{false};
  std::thread other([&] {
    while (!stop) rand();
  });
  bool same = true;
  for (int i = 0; i < 50; ++i) same = same && image_of(kOwn) == expected;
  stop = true;
  other.join();
  assert_true(same);
}
#endif

// The dots are where the C library's rand() puts them after srand(123), row by row.
void test_dots_of_the_reference(void**) {
  srand(123);
  std::vector<double> expected;
  for (int i = 0; i < 64 * 64; ++i) expected.push_back(rand() < 0.125 * RAND_MAX ? 0 : 1);
  mjenv_env* env = made(kOwn);
  const auto colors = read(env, 0, "tex_rgb");
  mjenv_destroy(env);
  assert_int_equal(colors.size(), 3 * expected.size());
  for (size_t i = 0; i < expected.size(); ++i)
    assert_true((colors[3 * i] == colors[0]) == (expected[i] == expected[0]));
}

// ---- The rest ----

std::string folder_listing(const char* path) {
  std::vector<std::string> names;
  if (DIR* folder = opendir(path)) {
    while (const dirent* entry = readdir(folder)) names.emplace_back(entry->d_name);
    closedir(folder);
  }
  std::sort(names.begin(), names.end());
  std::string text;
  for (const auto& name : names) text += name + " ";
  return text;
}

std::string process_state() {
  std::string state;
  for (int signal = 1; signal < SIGRTMAX; ++signal) {
    struct sigaction action {};
    sigset_t blocked;
    pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
    if (sigaction(signal, nullptr, &action) == 0)
      state += std::to_string(reinterpret_cast<std::uintptr_t>(action.sa_sigaction)) + "/" +
               std::to_string(action.sa_flags) + "/" + std::to_string(sigismember(&blocked, signal)) + " ";
  }
  for (char** variable = environ; *variable; ++variable) state += std::string(*variable) + "\n";
  char folder[4096];
  state += getcwd(folder, sizeof folder);
  const mode_t mask = umask(0);
  umask(mask);
  state += " umask " + std::to_string(mask);
  state += " files " + folder_listing("/proc/self/fd") + " threads " + folder_listing("/proc/self/task");
  return state + " here " + folder_listing(".");
}

void test_the_rest(void**) {
  const std::string before = process_state();
  image_of(kOwn);
  mjenv_env* env = nullptr;
  assert_int_equal(create({"InvertedPendulum-v5", "<mujoco><nonsense/></mujoco>"}, &env), MJENV_E_MODEL);
  assert_string_equal(process_state().c_str(), before.c_str());
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_global_locale),
      cmocka_unit_test(test_changing_locale),
      cmocka_unit_test(test_c_locales),
      cmocka_unit_test(test_random_numbers),
#ifdef MJENV_ENGINE_COMPILED_IN
      cmocka_unit_test(test_random_dots),
#endif
      cmocka_unit_test(test_dots_of_the_reference),
      cmocka_unit_test(test_the_rest),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}

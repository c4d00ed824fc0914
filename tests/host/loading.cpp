// Loading models from many threads, around forks and on small stacks.
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "host.hpp"

namespace {

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// A model for InvertedPendulum that holds more.
std::string model_with(const std::string& assets, const std::string& bodies) {
  return "<mujoco><asset>" + assets +
         "</asset><worldbody><body><joint name='x' type='slide' axis='1 0 0'/><joint axis='0 1 0'/>"
         "<geom size='0.1' mass='1'/></body>" +
         bodies + "</worldbody><actuator><motor joint='x' ctrlrange='-1 1' ctrllimited='true'/></actuator></mujoco>";
}

// A mesh whose vertices are all corners of its convex hull.
std::string ball(int vertices) {
  std::string text = "<mesh name='m' vertex='";
  for (int i = 0; i < vertices; ++i) {
    const double z = 1 - (2 * i + 1.0) / vertices, r = std::sqrt(1 - z * z), turn = 2.399963229728653 * i;
    text +=
        std::to_string(r * std::cos(turn)) + " " + std::to_string(r * std::sin(turn)) + " " + std::to_string(z) + " ";
  }
  return text + "'/>";
}

// ---- One parse for many environments ----

void test_shared_models(void**) {
  const std::string xml = model_with(ball(4000), "");
  const double start = seconds();
  mjenv_env* first = made({"InvertedPendulum-v5", xml});
  const double alone = seconds() - start;
  std::vector<mjenv_env*> more;
  for (int i = 0; i < 20; ++i) more.push_back(made({"InvertedPendulum-v5", xml}));
  const double twenty = seconds() - start - alone;
  // The model outlives whoever made it, and each of them plays alike.
  const auto expected = played(first, 1, 0.5);
  mjenv_destroy(first);
  for (mjenv_env* env : more) {
    assert_true(same_bits(played(env, 1, 0.5), expected));
    mjenv_destroy(env);
  }
  assert_true(twenty < 10 * alone);
}

// The same name, but another text.
void test_other_text(void**) {
  mjenv_env* light = made({"InvertedPendulum-v5", model_with("", "<body><geom size='1' mass='1'/></body>")});
  mjenv_env* heavy = made({"InvertedPendulum-v5", model_with("", "<body><geom size='1' mass='2'/></body>")});
  assert_true(read(light, 0, "body_mass").back() == 1 && read(heavy, 0, "body_mass").back() == 2);
  mjenv_destroy(light);
  mjenv_destroy(heavy);
}

// Files may change: a model that refers to some is made anew each time.
void test_files(void**) {
  char folder[] = "/tmp/mjenv-loading-XXXXXX";
  assert_non_null(mkdtemp(folder));
  const std::string model = std::string(folder) + "/model.xml", part = std::string(folder) + "/part.xml";
  const auto write = [](const std::string& path, const std::string& text) {
    std::FILE* file = std::fopen(path.c_str(), "wb");
    assert_non_null(file);
    std::fputs(text.c_str(), file);
    std::fclose(file);
  };
  const auto mass = [&](const char* value) {
    write(part,
          std::string("<mujoco><worldbody><body><geom size='1' mass='") + value + "'/></body></worldbody></mujoco>");
    mjenv_options* options = nullptr;
    mjenv_env* env = nullptr;
    assert_ok(mjenv_options_create("InvertedPendulum-v5", &options));
    assert_ok(mjenv_options_set_string(options, "xml_file", model.c_str()));
    assert_ok(mjenv_create(options, 1, &env));
    mjenv_options_destroy(options);
    return env;
  };
  std::string xml = model_with("", "");
  write(model, xml.insert(xml.find("<asset>"), "<include file='part.xml'/>"));
  mjenv_env* light = mass("1");
  mjenv_env* heavy = mass("2");
  assert_true(read(light, 0, "body_mass")[1] == 1 && read(heavy, 0, "body_mass")[1] == 2);
  mjenv_destroy(light);
  mjenv_destroy(heavy);
  unlink(part.c_str());
  unlink(model.c_str());
  rmdir(folder);
}

// ---- What is refused ----

std::string refusal_of(const std::string& xml) {
  mjenv_env* env = nullptr;
  assert_int_equal(create({"InvertedPendulum-v5", xml}, &env), MJENV_E_MODEL);
  return mjenv_last_error();
}

// The reasons are MuJoCo's own texts, from its parser and its compiler.
void test_reasons(void**) {
  const auto refused_for = [](const std::string& bodies, const char* reason) {
    return refusal_of(model_with("", bodies)).find(reason) != std::string::npos;
  };
  assert_true(refused_for("<body><geom size='wide'/></body>", "problem reading attribute 'size'"));
  assert_true(
      refused_for("<body><geom name='ball' size='-1'/></body>",
                  "Error: sizes must be positive in object 'ball' (id = 1)\nObject name = ball, id = 1, line = 1"));
  assert_true(
      refused_for("<body name='empty'><joint/></body>",
                  "Error: mass and inertia of moving bodies must be larger than mjMINVAL\nObject name = empty"));
}

// A hull of 150,000 vertices would take a minute.
void test_large_hull(void**) {
  const double start = seconds();
  const std::string why = refusal_of(model_with(ball(150'000), ""));
  assert_true(seconds() - start < 30);
  assert_true(why.find("trust_xml") != std::string::npos);
}

// What newer versions of MuJoCo added.
void test_newer_models(void**) {
  for (const char* bodies : {"<body gravcomp='1'><geom size='1'/></body>", "<frame><geom size='1'/></frame>",
                             "<replicate count='2'><geom size='1'/></replicate>"}) {
    const std::string why = refusal_of(model_with("", bodies));
    assert_true(why.find("this is MuJoCo 2.2.2") != std::string::npos);
    assert_true(why.find("engine=\"4.0\" in Python") != std::string::npos);
  }
}

// ---- Threads ----

// While a stranger's model is compiled, built-in and cached models are created.
void test_waiting(void**) {
  const std::string own = model_with("", "");
  mjenv_env* cached = made({"InvertedPendulum-v5", own});
#ifndef MJENV_ENGINE_COMPILED_IN
  // A shared library compiles one model at a time, so the built-in model must be cached as well.
  mjenv_env* hopper = made({"Hopper-v5"});
#endif
  std::atomic<double> compiled{0};
  const std::string slow = model_with(ball(20'000), "");
  std::thread other([&] {
    mjenv_env* env = nullptr;
    const double start = seconds();
    create({"InvertedPendulum-v5", slow}, &env);
    mjenv_destroy(env);
    compiled = seconds() - start;
  });
  double longest = 0;
  int created = 0;
  while (compiled == 0) {
    const double start = seconds();
    mjenv_destroy(made({"Hopper-v5"}));
    mjenv_destroy(made({"InvertedPendulum-v5", own}));
    longest = std::max(longest, seconds() - start);
    ++created;
  }
  other.join();
  mjenv_destroy(cached);
#ifndef MJENV_ENGINE_COMPILED_IN
  mjenv_destroy(hopper);
#endif
  assert_true(created > 1 && longest < compiled / 2);
}

// Many threads compile models of their own at once.
void test_at_once(void**) {
  mjenv_env* alone = made({"InvertedPendulum-v5", model_with(ball(100), "")});
  const auto expected = played(alone, 1, 0.5);
  mjenv_destroy(alone);
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([&, i] {
      for (int turn = 0; turn < 5; ++turn) {
        const std::string comment = "<!--" + std::to_string(10 * i + turn) + "-->";
        mjenv_env* env = nullptr;
        if (create({"InvertedPendulum-v5", comment + model_with(ball(100), "")}, &env) != MJENV_OK) {
          ++wrong;
          continue;
        }
        wrong += !same_bits(played(env, 1, 0.5), expected);
        mjenv_destroy(env);
      }
    });
  for (auto& thread : threads) thread.join();
  assert_int_equal(wrong, 0);
}

// ---- Forks ----

#ifndef NO_THREADS_AFTER_FORK
// Children of a process that compiles models all the time compile models, too.
void test_forks(void**) {
  std::atomic<bool> stop{false};
  std::thread other([&] {
    for (int i = 0; !stop; ++i) {
      mjenv_env* env = nullptr;
      create({"InvertedPendulum-v5", "<!--" + std::to_string(i) + "-->" + model_with(ball(1000), "")}, &env);
      mjenv_destroy(env);
    }
  });
  int ended_well = 0;
  constexpr int kChildren = 20;
  for (int i = 0; i < kChildren; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const pid_t child = fork();
    if (child == 0) {
      alarm(5);  // ends a child that hangs
      mjenv_env* env = nullptr;
      if (create({"InvertedPendulum-v5", model_with(ball(100), "")}, &env) != MJENV_OK) _exit(1);
      mjenv_destroy(env);
      if (create({"Hopper-v5"}, &env) != MJENV_OK) _exit(2);
      mjenv_destroy(env);
      _exit(0);
    }
    int status = -1;
    waitpid(child, &status, 0);
    ended_well += status == 0;
  }
  stop = true;
  other.join();
  assert_int_equal(ended_well, kChildren);
}
#endif

// ---- Stacks ----

#ifndef __SANITIZE_ADDRESS__  // with which functions take several times as much of the stack
struct Creation {
  Setting setting;
  mjenv_status status = MJENV_E_INTERNAL;
};

mjenv_status created_on_a_stack_of(size_t bytes, const Setting& setting) {
  Creation creation{setting};
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  assert_int_equal(pthread_attr_setstacksize(&attributes, bytes), 0);
  pthread_t thread;
  const auto run = [](void* given) -> void* {
    auto& job = *static_cast<Creation*>(given);
    mjenv_env* env = nullptr;
    job.status = create(job.setting, &env);
    if (job.status == MJENV_OK) {
      job.status = mjenv_reset(env, nullptr, nullptr);
      const double action = 0;
      if (job.status == MJENV_OK) job.status = mjenv_step(env, nullptr, &action, 1, MJENV_DTYPE_FLOAT64, nullptr);
    }
    mjenv_destroy(env);
    return nullptr;
  };
  assert_int_equal(pthread_create(&thread, &attributes, run, &creation), 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
  return creation.status;
}

// The smallest stack that docs/reliability.md promises to be enough, for the deepest model there may be.
void test_small_stacks(void**) {
  constexpr size_t promised = 64 * 1024;
  constexpr int levels = 90;
  std::string deep;
  for (int i = 0; i < levels; ++i) deep += "<body><geom size='1' mass='1'/>";
  for (int i = 0; i < levels; ++i) deep += "</body>";
  assert_int_equal(created_on_a_stack_of(promised, {"InvertedPendulum-v5"}), MJENV_OK);
  assert_int_equal(created_on_a_stack_of(promised, {"InvertedPendulum-v5", model_with("", deep)}), MJENV_OK);
  assert_int_equal(created_on_a_stack_of(promised, {"InvertedPendulum-v5", "<mujoco><nonsense/></mujoco>"}),
                   MJENV_E_MODEL);
}
#endif

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_shared_models), cmocka_unit_test(test_other_text), cmocka_unit_test(test_files),
      cmocka_unit_test(test_reasons),       cmocka_unit_test(test_large_hull), cmocka_unit_test(test_newer_models),
      cmocka_unit_test(test_waiting),       cmocka_unit_test(test_at_once),
#ifndef NO_THREADS_AFTER_FORK
      cmocka_unit_test(test_forks),
#endif
#ifndef __SANITIZE_ADDRESS__
      cmocka_unit_test(test_small_stacks),
#endif
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}

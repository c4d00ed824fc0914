/* learn.hpp - learn.h for C++17, in the manner of mjenv.hpp: handles that destroy themselves, and exceptions.
 *
 * The header only calls the functions of learn.h, whose comments say what each does. A call that fails throws
 * mjenv::Error. This header itself refuses a text with a NUL inside (MJENV_E_ARGUMENT), an array of another length than
 * needed (MJENV_E_SIZE), and a library with another MJENV_LEARN_ABI_VERSION (MJENV_E_INTERNAL). Programs are linked
 * with libmjenv-learn and with the libmjenv whose environments they use. */
#ifndef MJENV_LEARN_HPP
#define MJENV_LEARN_HPP

#include <mjenv/learn.h>

#include <map>
#include <mjenv/mjenv.hpp>
#include <sstream>
#include <string>

namespace mjenv {

/* Throws unless the status, of a function of learn.h, is MJENV_OK. */
inline void check_learn(mjenv_status status) {
  if (status != MJENV_OK) throw Error(status, mjenv_learn_last_error());
}

/* Calls the function of learn.h with the text. Refuses a text with a NUL. */
template <typename Call>
void learn_with_text(const std::string &text, const Call &call) {
  if (text.find('\0') != std::string::npos) throw Error(MJENV_E_ARGUMENT, "a text has a NUL character inside");
  check_learn(call(text.c_str()));
}

/* The same for two texts. */
template <typename Call>
void learn_with_texts(const std::string &first, const std::string &second, const Call &call) {
  learn_with_text(first, [&](const char *one) {
    learn_with_text(second, [&](const char *other) { return call(one, other); });
    return MJENV_OK;
  });
}

/* The functions of the libmjenv that the program is linked with. */
inline const mjenv_learn_calls &learn_calls() {
  static const mjenv_learn_calls calls = MJENV_LEARN_CALLS_INIT;
  return calls;
}

/* Returns a text that the function of learn.h writes: call(text, capacity, size) passes its status. */
template <typename Call>
std::string learn_text(const Call &call) {
  return fetch<char>(
             [&](char *to, std::int64_t capacity, std::int64_t *size) { check_learn(call(to, capacity, size)); })
      .data();
}

/* The settings of an id by their names, of which the words NAME=VALUE in `settings` replace some. */
inline std::map<std::string, std::string> learn_settings(const std::string &id, const std::string &settings = "") {
  std::string words;
  learn_with_texts(id, settings, [&](const char *name, const char *given) {
    words = learn_text([&](char *to, std::int64_t capacity, std::int64_t *size) {
      return mjenv_learn_settings(name, given, to, capacity, size);
    });
    return MJENV_OK;
  });
  std::map<std::string, std::string> values;
  std::istringstream stream(words);
  for (std::string word; stream >> word;) values[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
  return values;
}

/* A deterministic policy. */
class Policy {
 public:
  /* Reads the text of a policy.txt. */
  static Policy parse(const std::string &text) {
    mjenv_policy *made = nullptr;
    check_learn(mjenv_policy_parse(text.data(), int64(text.size()), &made));
    return Policy(made);
  }
  /* Reads a policy.txt. */
  static Policy load(const std::string &path) {
    mjenv_policy *made = nullptr;
    learn_with_text(path, [&](const char *name) { return mjenv_policy_load(name, &made); });
    return Policy(made);
  }

  std::string id() const {
    const char *text = mjenv_policy_id(handle());
    if (!text) throw Error(MJENV_E_ARGUMENT, mjenv_learn_last_error());
    return text;
  }
  std::size_t observations() const { return sizes().first; }
  std::size_t actuators() const { return sizes().second; }
  /* Where the numbers that the policy sees are in an observation of the environment. */
  std::vector<std::int64_t> places(const Env &env) const {
    std::vector<const char *> names;
    std::vector<std::int64_t> counts, found(observations());
    for (const mjenv_field &term : env.fields(MJENV_ROLE_OBSERVATION)) {
      names.push_back(term.name);
      counts.push_back(term.count);
    }
    check_learn(mjenv_policy_find(handle(), names.data(), counts.data(), int64(counts.size()), found.data(),
                                  int64(found.size())));
    return found;
  }
  /* obs[rows][observations()], action[rows][actuators()] */
  void act(std::int64_t rows, Span<const double> obs, Span<float> action,
           mjenv_precision precision = MJENV_PRECISION_FLOAT64) const {
    check_learn(mjenv_policy_act(handle(), precision, rows, obs.data(), int64(obs.size()), action.data(),
                                 int64(action.size())));
  }

  mjenv_policy *handle() const { return handle_.get(); }

 private:
  std::unique_ptr<mjenv_policy, Destroy<mjenv_policy_destroy>> handle_;

  explicit Policy(mjenv_policy *handle) : handle_(handle) {}
  std::pair<std::size_t, std::size_t> sizes() const {
    std::int64_t inputs = 0, outputs = 0;
    check_learn(mjenv_policy_sizes(handle(), &inputs, &outputs));
    return {static_cast<std::size_t>(inputs), static_cast<std::size_t>(outputs)};
  }
};

/* Episodes that a policy has played: the sum of the rewards of each, and its steps. */
struct Evaluation {
  std::vector<double> returns;
  std::vector<std::int64_t> lengths;
};

/* Plays episodes in all rows of an environment whose option "autoreset_mode" is disabled. Episode k begins with a reset
 * by seed + k. */
inline Evaluation evaluate(Env &env, const Policy &policy, std::size_t episodes, std::uint64_t seed = 0,
                           mjenv_precision precision = MJENV_PRECISION_FLOAT64) {
  Evaluation played{std::vector<double>(episodes), std::vector<std::int64_t>(episodes)};
  check_learn(mjenv_evaluate(&learn_calls(), env.handle(), policy.handle(), precision, seed, int64(episodes),
                             played.returns.data(), played.lengths.data()));
  return played;
}

/* Trains a policy in the rows of an environment, which it seeds and resets. */
class Learner {
 public:
  /* The environment has this id and the option "autoreset_mode" same_step. Until the learner is destroyed, the
   * environment must not be destroyed or used by others. settings: words NAME=VALUE. */
  Learner(Env &env, const std::string &id, const std::string &settings = "") {
    if (mjenv_learn_abi_version() != MJENV_LEARN_ABI_VERSION)
      throw Error(MJENV_E_INTERNAL, "libmjenv-learn has another ABI version than this program was compiled for");
    learn_with_texts(id, settings, [&](const char *name, const char *words) {
      mjenv_learner *made = nullptr;
      const mjenv_status status = mjenv_learner_create(&learn_calls(), env.handle(), name, words, &made);
      handle_.reset(made);
      return status;
    });
  }

  /* Trains until at least `steps` more steps of all rows together are done. */
  void train(std::int64_t steps) { check_learn(mjenv_learner_train(handle(), steps)); }
  /* Changes the settings that the words name (mjenv_learner_set). */
  void set(const std::string &settings) {
    learn_with_text(settings, [&](const char *words) { return mjenv_learner_set(handle(), words); });
  }
  /* Continues in another environment with the same spaces and number of rows. */
  void set_env(Env &env) { check_learn(mjenv_learner_set_env(handle(), env.handle())); }

  mjenv_learn_report report() const {
    mjenv_learn_report found = MJENV_LEARN_REPORT_INIT;
    check_learn(mjenv_learner_report(handle(), &found));
    return found;
  }
  /* The learning curve: the report of each update. */
  std::vector<mjenv_learn_report> curve() const {
    std::vector<mjenv_learn_report> found(static_cast<std::size_t>(report().updates), MJENV_LEARN_REPORT_INIT);
    for (std::size_t i = 0; i < found.size(); ++i)
      check_learn(mjenv_learner_report_at(handle(), int64(i + 1), &found[i]));
    return found;
  }

  /* Saves a checkpoint, with a text that checkpoint_note reads. */
  void save(const std::string &path, const std::string &note = "") const {
    learn_with_texts(path, note,
                     [&](const char *name, const char *text) { return mjenv_learner_save(handle(), name, text); });
  }
  /* Continues from a checkpoint, bit for bit. */
  void load(const std::string &path) {
    learn_with_text(path, [&](const char *name) { return mjenv_learner_load(handle(), name); });
  }
  /* The text of the policy, as policy.txt contains it. */
  std::string policy_text(mjenv_learned which = MJENV_LEARNED_LAST) const {
    return learn_text([&](char *to, std::int64_t capacity, std::int64_t *size) {
      return mjenv_learner_policy(handle(), which, to, capacity, size);
    });
  }
  Policy policy(mjenv_learned which = MJENV_LEARNED_LAST) const { return Policy::parse(policy_text(which)); }
  /* Writes policy.txt. */
  void save_policy(const std::string &path, mjenv_learned which = MJENV_LEARNED_LAST) const {
    learn_with_text(path, [&](const char *name) { return mjenv_learner_save_policy(handle(), which, name); });
  }

  mjenv_learner *handle() const { return handle_.get(); }

 private:
  std::unique_ptr<mjenv_learner, Destroy<mjenv_learner_destroy>> handle_;
};

/* The note in a checkpoint, which may come from a stranger. */
inline std::string checkpoint_note(const std::string &path) {
  std::string note;
  learn_with_text(path, [&](const char *name) {
    note = learn_text([&](char *to, std::int64_t capacity, std::int64_t *size) {
      return mjenv_checkpoint_note(name, to, capacity, size);
    });
    return MJENV_OK;
  });
  return note;
}

}  // namespace mjenv

#endif

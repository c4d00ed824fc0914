// Does what `mjenv train ID` does before its first update: startup.py measures it beside the command.
#include <stdio.h>

#include "mjenv/learn.h"

int main(int count, char** words) {
  static const mjenv_learn_calls calls = MJENV_LEARN_CALLS_INIT;
  mjenv_learn_settings settings = MJENV_LEARN_SETTINGS_INIT;
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  mjenv_learner* learner = NULL;
  if (count != 2 || mjenv_learn_defaults(words[1], &settings) || mjenv_options_create(words[1], &options) ||
      mjenv_options_set_string(options, "autoreset_mode", "same_step") || mjenv_create(options, settings.rows, &env) ||
      mjenv_learner_create(&calls, env, &settings, &learner)) {
    fprintf(stderr, "%s%s\n", mjenv_last_error(), mjenv_learn_last_error());
    return 1;
  }
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return 0;
}

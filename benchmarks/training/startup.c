// Does what `mjenv train ID` does before its first update: startup.py measures it beside the command.
#include <stdio.h>

#include "mjenv/learn.h"

int main(int count, char** words) {
  static const mjenv_learn_calls calls = MJENV_LEARN_CALLS_INIT;
  char settings[4096];
  int64_t size = 0;
  int rows = 0;
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  mjenv_learner* learner = NULL;
  if (count != 2 || mjenv_learn_settings(words[1], NULL, settings, sizeof settings, &size) ||
      sscanf(settings, "rows=%d", &rows) != 1 || mjenv_options_create(words[1], &options) ||
      mjenv_options_set_string(options, "autoreset_mode", "same_step") || mjenv_create(options, rows, &env) ||
      mjenv_learner_create(&calls, env, words[1], NULL, &learner)) {
    fprintf(stderr, "%s%s\n", mjenv_last_error(), mjenv_learn_last_error());
    return 1;
  }
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return 0;
}

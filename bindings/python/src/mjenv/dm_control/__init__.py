"""dm_control's suite. Importing it loads the plug-in with the tasks, whose ids are "dm_control/cheetah-run-v0" and so
on, and makes Gymnasium know those that no other package has registered."""

import sys
from pathlib import Path

from mjenv._engine import ENGINES
from mjenv.registration import load_tasks

_FILE = "libmjenv-suite.dll" if sys.platform == "win32" else "libmjenv-suite.so"

load_tasks(Path(ENGINES.get().path).absolute().with_name(_FILE))

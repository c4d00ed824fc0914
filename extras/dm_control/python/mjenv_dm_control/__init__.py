"""dm_control's suite. Importing it registers the ids "dm_control/cheetah-run-v0" and so on with Gymnasium.

Their environments equal Shimmy's of the same ids, which they replace.
"""

import gymnasium

from mjenv.registration import ids, spec

SUITE = "dm_control/"
spec(f"{SUITE}cheetah-run-v0")  # the library loads the tasks when it is first asked for one of them
for _id in ids():
    if _id.startswith(SUITE):
        _entry = f"mjenv_dm_control.gym:{_id.removeprefix(SUITE).removesuffix('-v0')}"
        gymnasium.registry.pop(_id, None)
        # Without a limit of steps: the environment itself ends its episodes.
        gymnasium.register(_id, _entry, vector_entry_point=f"{_entry}/vector")

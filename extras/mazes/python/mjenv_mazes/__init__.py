"""Mazes. Importing it registers the ids "mazes/PointMaze_UMaze-v3" and so on with Gymnasium.

Their environments equal those of Gymnasium-Robotics whose ids lack "mazes/".
"""

import gymnasium

from mjenv.registration import ids, spec

_SPACE = "mazes/"
spec(f"{_SPACE}PointMaze_UMaze-v3")  # the library loads the tasks when it is first asked for one of them
for _id in ids():
    if _id.startswith(_SPACE):
        gymnasium.registry.pop(_id, None)
        gymnasium.register(
            _id,
            f"mjenv_mazes.maze:{_id.removeprefix(_SPACE)}",
            max_episode_steps=spec(_id).max_episode_steps,
            vector_entry_point=f"mjenv.gym.entry_points:{_id}/vector",
        )

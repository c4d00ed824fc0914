"""Registers the ids with Gymnasium."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import gymnasium

from mjenv.capi import handle
from mjenv.capi.engine import ENGINES, Engine

NAMESPACE = "mjenv"
UNLISTED = "Model-v0"  # an id that ids() leaves out, because it needs the option xml_file or xml_string


def description(engine: Engine, id: str) -> dict[str, Any]:
    """The arguments of Gymnasium's EnvSpec and register that describe an id."""
    found = handle.spec_of(engine, id)
    return {
        "entry_point": f"mjenv.gym.entry_points:{id}",
        "reward_threshold": None if math.isnan(found.reward_threshold) else found.reward_threshold,
        "max_episode_steps": found.max_episode_steps or None,
        "vector_entry_point": f"mjenv.gym.entry_points:{id}/vector",
    }


def register_ids() -> None:
    """Makes gymnasium.make("mjenv/Ant-v5"), gymnasium.make_vec and gymnasium.spec know all ids. An id that has a
    namespace of its own, such as "lab/Reach-v0", keeps it. The package of a plug-in beside the library registers
    those of the plug-in.
    """
    engine = ENGINES.get()
    for id in (*handle.ids(engine), UNLISTED):
        name = id if "/" in id else f"{NAMESPACE}/{id}"
        if not _is_of_plugin(engine, id) and name not in gymnasium.registry:
            gymnasium.register(name, **description(engine, id))


def _is_of_plugin(engine: Engine, id: str) -> bool:
    space, slash, _ = id.partition("/")
    return bool(slash) and any(Path(engine.path).parent.glob(f"libmjenv-{space}.*"))

"""Registers the ids with Gymnasium as soon as both mjenv and Gymnasium have been imported, in whichever order.

`import mjenv` does not import Gymnasium, because that takes longer than `mjenv train` needs until its first update.
"""

from __future__ import annotations

import math
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

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

    Does nothing before Gymnasium is imported. Raises ImportError for a Gymnasium older than 1.0, from whose classes
    those of mjenv cannot be derived.
    """
    if "gymnasium" not in sys.modules:
        return
    import gymnasium

    version = gymnasium.__version__
    if int(version.split(".")[0]) < 1:
        raise ImportError(f'mjenv needs Gymnasium 1.0 or newer, not {version}: pip install "gymnasium>=1.0"')
    engine = ENGINES.get()
    for id in (*handle.ids(engine), UNLISTED):
        name = id if "/" in id else f"{NAMESPACE}/{id}"
        if not _is_of_plugin(engine, id) and name not in gymnasium.registry:
            gymnasium.register(name, **description(engine, id))


def _is_of_plugin(engine: Engine, id: str) -> bool:
    space, slash, _ = id.partition("/")
    return bool(slash) and any(Path(engine.path).parent.glob(f"libmjenv-{space}.*"))


class _Finder:
    """Finds nothing but Gymnasium, and by the other finders, whose loader it wraps."""

    def find_spec(self, name: str, path: Any, target: ModuleType | None = None) -> ModuleSpec | None:
        if name != "gymnasium":
            return None
        # Finders for Python before 3.12 may lack find_spec.
        others = (finder for finder in sys.meta_path if finder is not self and hasattr(finder, "find_spec"))
        specs = (finder.find_spec(name, path, target) for finder in others)
        found = next((spec for spec in specs if spec is not None), None)
        if found is not None and found.loader is not None:
            wrapped: Any = _Loader(found.loader)
            found.loader = wrapped
        return found


class _Loader:
    """A loader that registers the ids when it has executed Gymnasium."""

    def __init__(self, loader: Any) -> None:
        self._loader = loader

    def __getattr__(self, name: str) -> Any:
        return getattr(self._loader, name)

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        created: ModuleType | None = self._loader.create_module(spec)
        return created

    def exec_module(self, module: ModuleType) -> None:
        assert module.__spec__ is not None
        module.__spec__.loader = module.__loader__ = self._loader  # as if this class did not exist
        self._loader.exec_module(module)
        register_ids()


def follow_gymnasium() -> None:
    """Registers the ids now, if Gymnasium has been imported, or else when it is."""
    if "gymnasium" in sys.modules:
        register_ids()
    else:
        sys.meta_path.insert(0, _Finder())

"""Records what Gymnasium declares for each id: schema.txt."""

from __future__ import annotations

import inspect

import gymnasium
import numpy as np

from cases import IDS, RENDER_OPTIONS, SEED
from episodes import learn_types, type_name
from machine import hexed, lines_of


def option_default(parameter: inspect.Parameter) -> str:
    """KIND DEFAULT..., where the kind comes from the annotation (v5) or else from the type of the default."""
    annotation, value = str(parameter.annotation), parameter.default
    if isinstance(value, bool):
        return f"flag {int(value)}"
    if isinstance(value, str):
        return f"string {value}"
    if "str" in annotation:
        return f"string_or_int {value}"
    if isinstance(value, int) and "float" not in annotation:
        return f"integer {value}"
    return f"reals {hexed(value if isinstance(value, tuple) else [value])}"


def bounds(values: np.ndarray) -> str:
    """One number if all are the same."""
    return hexed(values[:1] if len({value.tobytes() for value in values}) == 1 else values)


def schema(facts: dict[str, str]) -> bytes:
    lines = [
        "mjenv-schema 1",
        "# What Gymnasium declares for each id, without rendering. option NAME KIND DEFAULT..., in order.",
        "# space ROLE DTYPE COUNT, low ROLE X..., high ROLE X... (one X: all alike). structure: observation_structure",
        "# camera NAME X...: default_camera_config",
        "# info, reset_info NAME COUNT TYPE, in order: action_dtype is np.float32 if the action is, else np.float64.",
        *lines_of({key: facts[key] for key in ("gymnasium", "mujoco", "numpy", "python")}),
    ]
    for name in IDS:
        spec = gymnasium.spec(name)
        env = gymnasium.make(name, disable_env_checker=True)
        bare = env.unwrapped
        info_fields, reset_fields = learn_types(env, SEED)
        reward = env.step(env.action_space.sample())[1]
        lines += [
            f"id {name}",
            f"max_episode_steps {spec.max_episode_steps}",
            f"reward_threshold {'none' if spec.reward_threshold is None else hexed([spec.reward_threshold])}",
            f"render_fps {bare.metadata['render_fps']}",
            f"frame_skip {bare.frame_skip}",
            f"dt {hexed([bare.dt])}",
            f"reward {type_name(reward)}",
        ]
        for key, parameter in inspect.signature(type(bare).__init__).parameters.items():
            if parameter.default is not parameter.empty and key not in RENDER_OPTIONS:
                lines.append(f"option {key} {option_default(parameter)}")
        for role, space in (("observation", env.observation_space), ("action", env.action_space)):
            lines.append(f"space {role} {space.dtype} {space.shape[0]}")
            lines += [f"low {role} {bounds(space.low)}", f"high {role} {bounds(space.high)}"]
        lines += ["info {} {} {}".format(*field) for field in info_fields]
        lines += ["reset_info {} {} {}".format(*field) for field in reset_fields]
        for key, value in (bare.mujoco_renderer.default_cam_config or {}).items():
            lines.append(f"camera {key} {hexed(np.atleast_1d(value))}")
        lines += [f"structure {term} {count}" for term, count in getattr(bare, "observation_structure", {}).items()]
        env.close()
    return "\n".join(lines).encode() + b"\n"

"""mjenv convert: a model of MuJoCo 4.0 for the engine 2.2.2, with what changes."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import mjenv
from mjenv_command import terminal
from mjenv_command.arguments import Commands, add_json, not_negative, print_json

ENGINES = ("2.2.2",)
NEEDED = "4.0"
STEPS = (1, 10, 100)  # the numbers of steps after which --check compares
INSTALL = f'mjenv convert needs the Python package of MuJoCo {NEEDED}: pip install "mujoco=={NEEDED}.*"'


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "convert",
        help="rewrite a model of MuJoCo 4.0 for the engine 2.2.2",
        description="Writes a model in the MJCF of MuJoCo 4.0 as MJCF for the engine 2.2.2, which steps it fastest. "
        "Defaults, attached and replicated parts, damping ratios and inherited ranges become numbers. Lists what the "
        "engine computes differently, and refuses models that it cannot compute. Files of meshes stay where they are. "
        f'Needs the Python package of MuJoCo {NEEDED}: pip install "mujoco=={NEEDED}.*".',
    )
    command.add_argument("model", type=Path, metavar="FILE", help="a model that MuJoCo 4.0 reads")
    command.add_argument(
        "--engine", dest="target", choices=ENGINES, default=ENGINES[0], help="the engine to write for (default: 2.2.2)"
    )
    command.add_argument("--out", type=Path, required=True, metavar="FILE", help="the file to write")
    command.add_argument(
        "--check",
        action="store_true",
        help="drive MuJoCo 4.0 and the engine with the same random controls, and print how far positions and "
        f"velocities are apart after {', '.join(map(str, STEPS[:-1]))} and {STEPS[-1]} steps",
    )
    command.add_argument(
        "--trust-xml",
        choices=("no", "yes"),
        default="no",
        help="no (default): the model may come from a stranger, so it refers to no files outside of its folder, and "
        "has limits; yes: it may do anything that MuJoCo can",
    )
    command.add_argument("--seed", type=not_negative, default=0, help="seed of these controls (default: 0)")
    add_json(command)
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    try:
        import mujoco  # type: ignore[import-not-found, unused-ignore]

        from mjenv_convert import older_mjcf
    except ImportError as error:
        print(f"mjenv: {error}. {INSTALL}", file=sys.stderr)
        return 2
    if not f"{mujoco.__version__}.".startswith(f"{NEEDED}."):
        print(f"mjenv: the package mujoco has the version {mujoco.__version__}. {INSTALL}", file=sys.stderr)
        return 2
    if not arguments.model.is_file():
        raise FileNotFoundError(f"there is no file {arguments.model}")
    out = arguments.out.resolve()
    if out.exists() and (not out.is_file() or out.samefile(arguments.model)):
        raise mjenv.ModelError(
            f"{arguments.out} is the model itself or no file: write the converted model to another file"
        )
    _refuse_harmful(arguments.model, arguments.trust_xml)
    try:
        spec = mujoco.MjSpec.from_file(str(arguments.model))
        model = spec.compile()
        text, changes, actuators = older_mjcf.converted(spec, model, out.parent)
    except (ValueError, mujoco.FatalError) as error:
        raise mjenv.ModelError(f"model {str(arguments.model)!r}: {error}") from None
    found: dict[str, Any] = {"out": str(arguments.out), "changes": changes, "actuators": actuators}
    # In the same folder as the output, because the text has paths relative to that folder.
    partial = out.with_name(f"{out.name}.{os.getpid()}.partial")
    with partial.open("x", encoding="utf-8") as file:
        file.write(text)
    try:
        envs = mjenv.make_vec("Model-v0", 1, engine=arguments.target, xml_file=str(partial), frame_skip=1)
        with contextlib.closing(envs):
            changes += _compiled_otherwise(model, envs)
            partial.replace(out)
            if arguments.check:
                found["apart"] = _apart(model, envs, actuators, arguments.seed)
    finally:
        partial.unlink(missing_ok=True)
    print_json(found) if arguments.json else _show(found, arguments.target)
    return 0


def _refuse_harmful(file: Path, trust_xml: str) -> None:
    """Refuses the models that mjenv refuses, because MuJoCo itself crashes on some, and reads any file."""
    if NEEDED not in mjenv.engines():
        if trust_xml == "no":
            raise mjenv.ModelError(f"only the engine {NEEDED} can check {file}: if you trust it, pass --trust-xml yes")
        return
    try:
        mjenv.make("Model-v0", engine=NEEDED, xml_file=str(file.resolve()), frame_skip=1, trust_xml=trust_xml).close()
    except mjenv.ModelError as error:
        if "enables sleeping" not in error.message:  # which the conversion removes
            raise


def _compiled_otherwise(model: Any, envs: Any) -> list[dict[str, Any]]:
    """What differs in numbers that both engines compute from the model."""
    import mujoco

    for name in ("nq", "nv", "nu", "na", "nbody", "ngeom", "neq"):
        if getattr(model, name) != int(getattr(envs.envs[0].model, name)):
            raise mjenv.ModelError(f"the converted model has another {name}: {getattr(envs.envs[0].model, name)}")
    data, row = mujoco.MjData(model), envs.envs[0]
    mujoco.mj_forward(model, data)
    envs.reset(seed=0)
    places = [np.c_[one.geom_xpos.reshape(-1, 3), one.geom_xmat.reshape(-1, 9)] for one in (data, row.data)]
    weights = [one.body_invweight0.reshape(-1, 2) for one in (model, row.model)]
    found = {
        ("mesh", "its geoms' frames are at another place of the shape"): places,
        ("body_invweight0", "other numbers, so constraints are stiffer or softer"): weights,
    }
    differing = {line: ~np.isclose(one, other, 1e-6, 1e-6).all(axis=1) for line, (one, other) in found.items()}
    return [
        {"what": what, "effect": effect, "times": int(rows.sum())}
        for (what, effect), rows in differing.items()
        if rows.any()
    ]


def _apart(model: Any, envs: Any, actuators: Sequence[int], seed: int) -> list[dict[str, Any]]:
    """The differences between positions and velocities of both models after some steps with the same controls.

    Each step's controls are drawn uniformly from their ranges, from -1 to 1 where they have none.
    """
    import mujoco

    data, random = mujoco.MjData(model), np.random.default_rng(seed)
    low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, (-1.0, 1.0)).T
    envs.reset(seed=seed)
    envs.set_state(data.qpos[None], data.qvel[None])
    found = []
    for step in range(1, max(STEPS) + 1):
        data.ctrl = random.uniform(low, high).astype(np.float32)  # the dtype of actions
        mujoco.mj_step(model, data)
        observation = envs.step(data.ctrl[None, actuators].astype(np.float32))[0][0]
        if step in STEPS:
            qpos, qvel = np.split(observation, [model.nq])
            ends = {"qpos": np.abs(qpos - data.qpos), "qvel": np.abs(qvel - data.qvel)}
            found.append({"steps": step, **{name: float(numbers.max()) for name, numbers in ends.items()}})
    return found


def _show(found: dict[str, Any], engine: str) -> None:
    print(f"{found['out']}: for the engine {engine}")
    for change in found["changes"]:
        times = f" ({change['times']} times)" if change["times"] > 1 else ""
        print(f"  {change['what']}: {change['effect']}{times}")
    if "apart" in found:
        terminal.heading(f"How far MuJoCo {NEEDED} and the engine {engine} are apart, with the same random controls")
        rows = [[str(one["steps"]), *(f"{one[name]:.2g}" for name in ("qpos", "qvel"))] for one in found["apart"]]
        terminal.table(["steps", "qpos", "qvel"], rows, right="steps qpos qvel")

"""mjenv gallery: draws all robots on one sheet, or robots under their policies in one moving picture."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mjenv
from mjenv_command import terminal
from mjenv_command.arguments import Commands, add_groups, groups_of, known_id, not_negative, positive, seconds
from mjenv_command.play import FOLLOWING, Colours, needed, side_by_side
from mjenv_command.policies import learned, policy_of

STEPS = 15  # the random actions before a robot is drawn on the sheet
# Steps and cameras for ids for which STEPS or the id's own camera is unsuitable: some robots look small from
# Gymnasium's cameras, and the pendulums soon fall.
VIEWS: dict[str, tuple[int, dict[str, Any]]] = {
    "InvertedDoublePendulum-v5": (4, {"distance": 2.6, "lookat": (0.0, 0.0, 0.5), "elevation": -15.0}),
    "InvertedPendulum-v5": (4, {"distance": 1.8, "lookat": (0.0, 0.0, 0.2), "elevation": -20.0}),
    "Pusher-v5": (STEPS, {"distance": 2.2, "lookat": (0.3, -0.4, -0.2), "elevation": -40.0}),
    "Reacher-v5": (STEPS, {"distance": 0.75, "lookat": (0.0, 0.0, 0.0), "elevation": -50.0}),
}
# How Pillow writes moving pictures. Lossy WebP is a tenth of the size of a GIF, which has 256 colours.
WRITERS: dict[str, dict[str, Any]] = {".gif": {"optimize": True}, ".webp": {"quality": 50, "method": 6}}


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "gallery",
        help="draw all robots on one sheet, or in one moving picture",
        description="Draws each robot after a few random actions on one sheet (FILE.png), or robots that play their "
        'policies in one moving picture (FILE.webp, FILE.gif). Needs pip install "mjenv[video]".',
    )
    command.add_argument("file", type=picture_file, metavar="FILE")
    command.add_argument("ids", type=known_id, nargs="*", metavar="ID", help="the robots to draw (default: all)")
    command.add_argument(
        "--policies",
        type=Path,
        metavar="PATH",
        help="the policies of a moving picture: a folder with a file ID.txt, saved by the learner, for each robot, or "
        "the file of one policy",
    )
    command.add_argument("--seed", type=not_negative, default=0, help="seed of resets and actions (default: 0)")
    command.add_argument(
        "--size", type=positive, default=240, help="width and height of each robot's picture, in pixels (default: 240)"
    )
    command.add_argument("--columns", type=positive, default=4, help="robots side by side (default: 4)")
    command.add_argument(
        "--seconds", type=seconds, default=4.0, help="simulated time that a moving picture shows (default: 4)"
    )
    command.add_argument("--fps", type=positive, default=20, help="pictures per second (default: 20)")
    add_groups(command)
    command.set_defaults(run=run)


def picture_file(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in (".png", *WRITERS):
        raise argparse.ArgumentTypeError(f"{text!r} must end in .png, .gif or .webp")
    return path


def run(arguments: argparse.Namespace) -> int:
    needed("PIL")
    moves = arguments.file.suffix.lower() in WRITERS
    if moves != bool(arguments.policies):
        raise mjenv.OptionError("--policies belongs to a moving picture, FILE.webp or FILE.gif, which needs it")
    count = save_moving(arguments) if moves else save_still(arguments)
    print(f"{arguments.file}: {count} robots")
    return 0


def name_of(id: str) -> str:
    return id.removeprefix("dm_control/").rpartition("-")[0]


def camera_of(id: str) -> dict[str, Any]:
    """The arguments of make that choose an id's camera."""
    if id.startswith("dm_control/"):
        return {"camera_id": 2 if "quadruped" in id else 0}
    return {"default_camera_config": VIEWS[id][1]} if id in VIEWS else {"camera_name": FOLLOWING}


# ---- A sheet ----


def save_still(arguments: argparse.Namespace) -> int:
    ids = arguments.ids or [id for id in mjenv.ids(arguments.engine) if id.endswith("-v5")]
    pictures, labels, depths = [], [], []
    with terminal.progress(len(ids), "drawing") as advance:
        for id in ids:
            rgb, depth = portrait(id, arguments.seed, arguments.size, arguments.engine, groups_of(arguments))
            pictures.append(rgb)
            labels.append(name_of(id))
            if id == "Ant-v5":
                depths.append(in_grey(depth))
            advance()
    labels += ["Ant, depth"] * len(depths)
    side_by_side([*pictures, *depths], labels, arguments.columns).save(arguments.file, optimize=True)
    return len(ids)


def portrait(id: str, seed: int, size: int, engine: str | None, groups: dict[str, Any]) -> Any:
    """A robot after a few random actions: colours and depth."""
    steps = VIEWS[id][0] if id in VIEWS else STEPS
    view: dict[str, Any] = {"width": size, "height": size, **camera_of(id), "engine": engine}
    with mjenv.make(id, strict=False, render_mode="rgbd_tuple", **view, **groups) as env:
        env.action_space.seed(seed)
        env.reset(seed=seed)
        for _ in range(steps):
            env.step(env.action_space.sample())
        return env.render()


def in_grey(depth: NDArray[np.float32]) -> Colours:
    """A grey picture of a depth buffer. Near is bright."""
    distance = 1 / (1 - np.minimum(depth, 1 - 1e-4).astype(np.float64))  # increases with the distance in metres
    near, far = np.log(distance.min()), np.log(np.quantile(distance, 0.9))
    bright = np.clip((far - np.log(distance)) / (far - near), 0, 1)
    return np.repeat((255 * bright).astype(np.uint8)[..., None], 3, axis=2)


# ---- A moving picture ----


def save_moving(arguments: argparse.Namespace) -> int:
    files = policies_at(arguments.policies, arguments.ids)
    played = []
    with terminal.progress(len(files), "playing") as advance:
        for file in files:
            played.append(performance(file, arguments))
            advance()
    labels = [name_of(learned(file).id) for file in files]
    first, *others = (side_by_side([*at_once], labels, arguments.columns) for at_once in zip(*played, strict=True))
    first.save(
        arguments.file,
        save_all=True,
        append_images=others,
        duration=round(1000 / arguments.fps),
        loop=0,
        **WRITERS[arguments.file.suffix.lower()],
    )
    return len(files)


def policies_at(path: Path, ids: Sequence[str]) -> list[Path]:
    """The policies of these ids in a folder, or all of them; or the file that the path is."""
    if path.is_file():
        if ids:
            raise mjenv.OptionError(f"{path} is one policy, so there are no robots to choose, but {ids[0]} was given")
        return [path]
    files = [path / f"{id}.txt" for id in ids] or sorted(path.glob("*.txt"))
    if not files:
        raise mjenv.InvalidValueError(f"{path} has no policies, which are files ID.txt")
    return files


def performance(file: Path, arguments: argparse.Namespace) -> list[Colours]:
    """Pictures of a robot that plays its policy, episode after episode."""
    id = learned(file).id
    size, pictures = arguments.size, list[Any]()
    with mjenv.make(
        id,
        render_mode="rgb_array",
        width=size,
        height=size,
        engine=arguments.engine,
        **camera_of(id),
        **groups_of(arguments),
    ) as env:
        act = policy_of(file, env, "", None)
        obs, _ = env.reset(seed=arguments.seed)
        steps = 0
        for picture in range(round(arguments.seconds * arguments.fps)):
            while steps * env.dt < picture / arguments.fps - 1e-9:  # env.dt is rounded
                obs, _, terminated, truncated, _ = env.step(act(obs))
                steps += 1
                if terminated or truncated:
                    obs, _ = env.reset()
            pictures.append(env.render())
    return pictures

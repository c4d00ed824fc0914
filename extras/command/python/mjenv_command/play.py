"""mjenv play: writes an episode as a video or as a sheet of pictures."""

from __future__ import annotations

import argparse
import importlib
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mjenv
from mjenv_command import terminal
from mjenv_command.arguments import (
    GROUP_COUNT,
    SHOWN_GROUPS,
    Commands,
    add_groups,
    add_options,
    add_randomize,
    groups_of,
    known_id,
    not_negative,
    positive,
)
from mjenv_command.policies import Action, environment_of, policy_of
from mjenv_command.videos import Gif, Mp4

Colours = NDArray[np.uint8]

SHEET = 12  # pictures of an episode on a sheet
GAP = 6  # pixels between the pictures of a sheet
FOLLOWING = "track"  # the camera that moves with the robot, in most of Gymnasium's models


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "play",
        help="play an episode into a video or a sheet of pictures",
        description="Plays an episode and writes it as a video or as a sheet of pictures. Needs pip install "
        '"mjenv[video]". The actions are random, drawn from --seed, unless --actions or --policy gives them. Random '
        "actions are float32, as those of Gymnasium's action spaces. Recorded actions keep the dtype of their file.",
    )
    command.add_argument("id", type=known_id, nargs="?", help="an id (default: that of the learner's policy)")
    command.add_argument(
        "--seed", type=not_negative, default=0, help="seed of the reset and of random actions (default: 0)"
    )
    command.add_argument(
        "--video",
        type=output_file,
        required=True,
        metavar="FILE",
        help="the file to write: NAME.mp4, NAME.gif, or NAME.png for a sheet of 12 pictures of the episode",
    )
    command.add_argument("--steps", type=positive, help="maximum number of steps (default: to the end of the episode)")
    source = command.add_mutually_exclusive_group()
    source.add_argument("--actions", type=Path, metavar="FILE.npy", help="recorded actions, one in each row")
    source.add_argument(
        "--policy",
        type=Path,
        metavar="FILE",
        help="a policy: FILE.zip that Stable-Baselines3 saved, or FILE.txt that mjenv_learn.policy saved",
    )
    command.add_argument("--algorithm", default="PPO", help="the class of FILE.zip in stable_baselines3 (default: PPO)")
    command.add_argument(
        "--normalizer",
        type=Path,
        metavar="FILE",
        help="the VecNormalize that was saved with FILE.zip. Like FILE.zip, it can run any code: take both only from "
        "people whom you trust",
    )
    command.add_argument("--width", type=positive, default=480, help="width in pixels (default: 480)")
    command.add_argument("--height", type=positive, default=480, help="height in pixels (default: 480)")
    command.add_argument(
        "--camera",
        metavar="NAME|NUMBER",
        help=f'a camera of the model; -1 is the free camera (default: "{FOLLOWING}" if the model has it, else -1)',
    )
    add_groups(command)
    command.add_argument("--fast", action="store_true", help="draw without multisampling and shadows")
    command.add_argument(
        "--fps",
        type=positive,
        help="pictures per second (default: the simulation's steps per second); fewer make slow motion",
    )
    add_options(command)
    add_randomize(command)
    command.set_defaults(run=run)


def output_file(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in (".mp4", ".gif", ".png"):
        raise argparse.ArgumentTypeError(f"{text!r} must end in .mp4, .gif or .png")
    return path


def run(arguments: argparse.Namespace) -> int:
    writers: dict[str, type[Mp4 | Gif | Sheet]] = {".mp4": Mp4, ".gif": Gif, ".png": Sheet}
    writer_of = writers[arguments.video.suffix.lower()]
    needed("imageio", "imageio_ffmpeg" if writer_of is Mp4 else "PIL")
    if arguments.normalizer and not arguments.policy:
        raise mjenv.OptionError("--normalizer belongs to a --policy")
    id, keywords = environment_of(arguments)
    with mjenv.make(
        id,
        render_mode="rgb_array",
        width=arguments.width,
        height=arguments.height,
        render_fast=arguments.fast,
        **camera_of(arguments.camera),
        **groups_of(arguments),
        **keywords,
    ) as env:
        if arguments.camera and env.camera_name is not None:
            # Raises if the model has no such camera, because make, like Gymnasium, would take the free camera.
            env.model.camera(env.camera_name)
        if hint := hidden_robot(env, groups_of(arguments)):
            print(f"mjenv play: {hint}", file=sys.stderr)
        act, steps = actions_of(env, arguments)
        writer = writer_of(arguments.video, arguments.fps or env.metadata["render_fps"])
        with terminal.progress(steps, f"playing {id}") as advance:
            played = play(env, act, steps, arguments.seed, writer, advance)
        writer.close()
    print(f"{arguments.video}: {played[0]} steps, return {played[1]:.6g}")
    return 0


def play(
    env: mjenv.Environment, act: Action, steps: int, seed: int, writer: Mp4 | Gif | Sheet, advance: Callable[[], None]
) -> tuple[int, float]:
    """Plays an episode and returns the number of its steps and its return."""
    env.action_space.seed(seed)
    obs, _ = env.reset(seed=seed)
    writer.add(env)
    total = 0.0
    for step in range(1, steps + 1):
        action = np.reshape(act(obs), env.action_space.shape or ())
        obs, reward, terminated, truncated, _ = env.step(action)
        total += float(reward)
        writer.add(env)
        advance()
        if terminated or truncated:
            return step, total
    return steps, total


def actions_of(env: mjenv.Environment, arguments: argparse.Namespace) -> tuple[Action, int]:
    """The function that chooses the actions, and the maximum number of steps."""
    assert env.spec is not None
    limit = arguments.steps or env.spec.max_episode_steps or 1000
    if arguments.actions:
        return recorded(arguments.actions, env, limit)
    if arguments.policy:
        return policy_of(arguments.policy, env, arguments.algorithm, arguments.normalizer), limit
    return lambda obs: env.action_space.sample(), limit


def recorded(path: Path, env: mjenv.Environment, limit: int) -> tuple[Action, int]:
    try:
        found = np.load(path)
    except ValueError as error:
        raise mjenv.InvalidValueError(f"{path} is no .npy file of numbers: {error}") from None
    assert env.action_space.shape
    shape = env.action_space.shape
    if not isinstance(found, np.ndarray) or found.ndim != 2 or found.shape[1:] != shape or not len(found):
        raise mjenv.InvalidValueError(f"{path} must hold an action in each row, which is {shape[0]} numbers")
    following: Iterator[Any] = iter(found)
    return lambda obs: next(following), min(limit, len(found))


def camera_of(text: str | None) -> dict[str, Any]:
    if text is None:
        return {"camera_name": FOLLOWING}
    return {"camera_id": int(text)} if text.removeprefix("-").isdigit() else {"camera_name": text}


def hidden_robot(env: mjenv.Environment, chosen: dict[str, dict[int, bool]]) -> str | None:
    """Why the picture contains nothing of the robot, and what to do; None if it contains something."""
    hidden = []
    for kind in ("geom", "site", "tendon", "skin"):  # what MuJoCo draws unless visual_options say otherwise
        flags = chosen.get(f"{kind}group", {})
        shown = {group for group in range(GROUP_COUNT) if flags.get(group, group in SHOWN_GROUPS)}
        groups = set(np.clip(groups_of_robot(env.model, kind), 0, GROUP_COUNT - 1).tolist())
        if groups & shown:
            return None
        if groups:
            own, all_groups = (",".join(map(str, sorted(some))) for some in (groups, groups | shown))
            hidden.append(f"its {kind}s are in group {own}: add --{kind}group {all_groups}")
    return f"nothing that is drawn belongs to the robot; {'; '.join(hidden) or 'it has nothing that could be drawn'}"


def groups_of_robot(model: Any, kind: str) -> NDArray[Any]:
    """The groups of the objects that are not transparent and not part of the world."""
    colour, material = getattr(model, f"{kind}_rgba"), getattr(model, f"{kind}_matid")
    # An object without a colour of its own has that of its material.
    has_colour = (colour != (0.5, 0.5, 0.5, 1)).any(axis=1)
    alpha = np.where(has_colour, colour[:, 3], np.append(model.mat_rgba[:, 3], 1)[material])
    body = getattr(model, f"{kind}_bodyid") if kind in ("geom", "site") else np.ones(len(alpha))
    return getattr(model, f"{kind}_group")[(alpha > 0) & (body > 0)]  # type: ignore[no-any-return]


def needed(*modules: str) -> None:
    """Raises OptionError if one of these packages is missing."""
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise mjenv.OptionError(f'pictures and videos need pip install "mjenv[video]" ({error})') from None


# ---- What is written ----


class Sheet:
    """A sheet of pictures at equal intervals of an episode whose length is not known in advance."""

    def __init__(self, path: Path, rate: int) -> None:
        self._path, self._every, self._count = path, 1, 0
        self._kept: list[Colours] = []

    def add(self, env: mjenv.Environment) -> None:
        if self._count % self._every == 0:
            self._kept.append(env.render())  # type: ignore[arg-type]
            if len(self._kept) > 4 * SHEET:
                self._kept, self._every = self._kept[::2], 2 * self._every
        self._count += 1

    def close(self) -> None:
        chosen = np.linspace(0, len(self._kept) - 1, min(SHEET, len(self._kept))).round().astype(int)
        save_sheet(self._path, [self._kept[index] for index in chosen])


def save_sheet(path: Path, pictures: list[Colours]) -> None:
    """Writes pictures of one size side by side, four in a row."""
    from PIL import Image  # type: ignore[import-not-found, unused-ignore]

    height, width, _ = pictures[0].shape
    columns = min(4, len(pictures))
    rows = math.ceil(len(pictures) / columns)
    sheet = Image.new("RGB", (columns * (width + GAP) - GAP, rows * (height + GAP) - GAP), "white")
    for index, picture in enumerate(pictures):
        place = index % columns * (width + GAP), index // columns * (height + GAP)
        sheet.paste(Image.fromarray(picture), place)
    sheet.save(path, optimize=True)

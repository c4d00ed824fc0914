"""mjenv train: trains a policy by the library's own learner."""

from __future__ import annotations

import argparse
import math
import shlex
import shutil
import sys
import time
from pathlib import Path
from typing import Any

import mjenv
from mjenv_command.arguments import (
    Commands,
    add_options,
    add_randomize,
    known_engine,
    not_negative,
    options_of,
    positive,
    seconds,
)
from mjenv_learn.saved import stages_of
from mjenv_learn.settings import Settings, bounds_of, described
from mjenv_learn.training import (
    CHECKPOINT,
    MODEL_OPTIONS,
    PICTURE,
    POLICY,
    Description,
    Stage,
    Training,
    train,
)

BAR_WIDTH = 24


def add(commands: Commands) -> None:
    command = commands.add_parser(
        "train",
        help="train a policy",
        description="Trains a policy by PPO on this computer's CPU, without another library. Writes policy.txt, "
        "curve.csv, curve.svg and a checkpoint into a folder. Ctrl-C ends the training and leaves the best policy so "
        "far and a checkpoint, from which --resume continues. The same seed gives the same bits with any number of "
        "threads.",
    )
    command.add_argument("id", help="an id, also one of your own tasks or of dm_control's suite")
    command.add_argument("--engine", type=known_engine, default=argparse.SUPPRESS, metavar="NAME", help="2.2.2 or 4.0")
    command.add_argument("--seconds", type=seconds, help="end after so many seconds")
    command.add_argument("--seed", type=not_negative, help="default: 1")
    command.add_argument(
        "--threads", type=positive, default=1, help="threads; the results do not depend on them (default: 1)"
    )
    command.add_argument(
        "--stage",
        nargs="+",
        action="append",
        default=[],
        metavar=("STEPS", "NAME=VALUE"),
        help="a part of the training and its options, in addition to those of --option; repeatable",
    )
    command.add_argument(
        "--stages", type=Path, metavar="FILE", help="a JSON file of stages, which come before those of --stage"
    )
    command.add_argument("--out", type=Path, help="the folder that is written (default: trained/ID)")
    command.add_argument(
        "--resume",
        action="store_true",
        help="continue from the checkpoint in the folder, with its seed, and with its settings, stages and options "
        "where the command names no others",
    )
    command.add_argument("--overwrite", action="store_true", help="replace the training in the folder")
    command.add_argument(
        "--view", action="store_true", help='show the training in a browser (pip install "mjenv[view]")'
    )
    add_options(command)
    add_randomize(command)
    settings = command.add_argument_group("settings of the learner", "Their defaults depend on the id.")
    for name, one in _described().items():
        text = f"{one.doc.decode()} ({bounds_of(one)})".replace("%", "%%")
        settings.add_argument(f"--{name.replace('_', '-')}", metavar="VALUE", help=text)
    command.set_defaults(run=run)


def _described() -> dict[str, Any]:
    """The settings; none without the library, whose absence train reports."""
    try:
        return described()
    except mjenv.Error:
        return {}


def run(arguments: argparse.Namespace) -> int:
    folder = arguments.out or Path("trained") / arguments.id.replace("/", "-")
    try:
        options = options_of(arguments.id, arguments.option, arguments.engine)
    except mjenv.UnknownIdError as error:
        if not arguments.resume:
            raise
        raise mjenv.UnknownIdError(f"{error}; {resuming(folder)}") from None
    if arguments.engine is not None:
        options["engine"] = arguments.engine
    options |= arguments.randomize
    stages = stages_of(arguments.stages) if arguments.stages else []
    stages += [stage_of(arguments.id, words, arguments.engine) for words in arguments.stage]
    given = {name: getattr(arguments, name) for name in _described()}
    settings = {name: value for name, value in given.items() if value is not None}
    steps = settings.pop("steps", None)
    display = Display(arguments.seconds)
    try:
        training = train(
            arguments.id,
            steps=None if steps is None else Settings(arguments.id, f"steps={steps}").steps,
            seconds=arguments.seconds,
            seed=arguments.seed,
            threads=arguments.threads,
            settings=settings,
            stages=stages,
            out=folder,
            resume=arguments.resume,
            overwrite=arguments.overwrite,
            callback=display.show,
            view=arguments.view,
            **options,
        )
    except KeyboardInterrupt:
        display.clear()
        if (folder / CHECKPOINT).exists():
            print(f"stopped: {folder / POLICY} is the best policy so far; {resuming(folder)}")
        return 130
    except BaseException:
        display.clear()
        raise
    display.clear()
    last = training.curve[-1] if training.curve else None
    if last is not None:
        print(
            f"{training.id}: {last.steps:,} steps in {display.seconds():.1f} s, "
            f"mean return {last.mean_return:,.6g} and length {last.mean_length:,.6g} of the exploring policy "
            f"in its last {training.settings.window} episodes"
        )
    print(f"{folder / POLICY}, {folder / PICTURE}; watch it: {watching(folder, training.description())}")
    return 0


def watching(folder: Path, training: Description) -> str:
    """The command that shows the policy, which names its environment, in it. Files of models are trusted only if the
    command names them."""
    options = {name: value for name, value in training.present_options().items() if name in MODEL_OPTIONS}
    return shlex.join(["mjenv", "view", "--policy", str(folder / POLICY), *words_of(training, options)])


def resuming(folder: Path) -> str:
    """How a training continues. The checkpoint's options need not be repeated, but files of tasks and models do: they
    are only read, and trusted, if the command names them."""
    training = Description.read(folder)
    options = {name: value for name, value in training.present_options().items() if name in MODEL_OPTIONS}
    words = ["mjenv", "train", training.id, "--out", str(folder), "--resume", *words_of(training, options)]
    return f"it continues by {shlex.join(words)}"


def words_of(training: Description, options: dict[str, Any]) -> list[str]:
    """The files of tasks, the engine and the options of a training as arguments of a command."""
    words = [word for file in training.tasks for word in ("--tasks", file)]
    engine = options.pop("engine", None)
    if engine not in (None, mjenv.engine().name):
        words += ["--engine", engine]
    return words + [word for name in options for word in ("--option", f"{name}={text_of(options[name])}")]


def text_of(value: Any) -> str:
    """The value of an option as options_of reads it."""
    if isinstance(value, bool):
        return str(value).lower()
    return ",".join(map(text_of, value)) if isinstance(value, (list, tuple)) else str(value)


def stage_of(id: str, words: list[str], engine: str | None) -> Stage:
    if not words[0].isdigit():
        raise mjenv.OptionError(f"--stage begins with its number of steps, not {words[0]!r}")
    return Stage(int(words[0]), options_of(id, words[1:], engine))


class Display:
    """A line on stderr, if it is a terminal: how much is done, the last episodes, the speed and the time left."""

    def __init__(self, limit: float | None) -> None:
        self._start, self._limit, self._first = time.perf_counter(), limit, -1
        self._on = sys.stderr.isatty()

    def seconds(self) -> float:
        return time.perf_counter() - self._start

    def show(self, training: Training) -> None:
        if not self._on:
            return
        point, total = training.curve[-1], training.settings.steps
        if self._first < 0:  # a training that continues has already done some steps
            self._first = point.steps - training.settings.rows * training.settings.rollout_steps
        speed = (point.steps - self._first) / self.seconds()
        share = min(1.0, point.steps / total)
        left = (total - point.steps) / speed
        if self._limit is not None:
            share, left = max(share, self.seconds() / self._limit), min(left, self._limit - self.seconds())
        filled = round(BAR_WIDTH * min(1.0, share))
        text = f"{training.id} [{'#' * filled}{'.' * (BAR_WIDTH - filled)}] {point.steps:,} steps"
        if not math.isnan(point.mean_return):
            text += f"  return {point.mean_return:,.5g}  length {point.mean_length:,.4g}"
        text += f"  {speed:,.0f} steps/s  {max(0, left):.0f} s left"
        print(f"\r\033[K{text[: shutil.get_terminal_size().columns - 1]}", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        if self._on:
            print("\r\033[K", end="", file=sys.stderr, flush=True)

"""Training by the native learner (libmjenv-learn), and playing policies: mjenv.train and mjenv.evaluate."""

from __future__ import annotations

import csv
import io
import json
import math
import operator
import os
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv import errors
from mjenv.capi.declarations import Role, Status
from mjenv.capi.dtypes import Float64Array
from mjenv.capi.handle import Options, Rows, spec_of
from mjenv.capi.keywords import RANDOMIZING
from mjenv.capi.schema import Field
from mjenv.gym.make_vec import make_vec
from mjenv.gym.vector import VectorEnv
from mjenv.registration import loaded_tasks, own_id
from mjenv_learn import saved, svg, vectors
from mjenv_learn.declarations import Learned, Precision
from mjenv_learn.learner import Learner, PolicyHandle, space_of, terms_of
from mjenv_learn.policy import Policy
from mjenv_learn.saved import CHECKPOINT as CHECKPOINT
from mjenv_learn.saved import CURVE, DESCRIPTION
from mjenv_learn.saved import MODEL_OPTIONS as MODEL_OPTIONS
from mjenv_learn.saved import PICTURE as PICTURE
from mjenv_learn.saved import POLICY as POLICY
from mjenv_learn.saved import Description as Description
from mjenv_learn.saved import Stage as Stage
from mjenv_learn.settings import Settings as Settings
from mjenv_learn.settings import words_of

SAVE_SECONDS = 10.0  # how often a training with a folder saves


@dataclass(frozen=True)
class Point:
    """A point of the learning curve: the results of one update, and of the episodes before it."""

    updates: int
    steps: int
    episodes: int
    mean_return: float  # of the last episodes of the exploring policy; nan if none has ended
    mean_length: float
    learning_rate: float
    policy_loss: float
    value_loss: float
    entropy: float
    approx_kl: float
    clip_fraction: float
    grad_norm: float
    explained_variance: float
    std: float
    epochs: int


@dataclass(frozen=True)
class Evaluation:
    """Episodes that a policy has played."""

    returns: Float64Array
    lengths: NDArray[np.int64]

    @property
    def mean_return(self) -> float:
        return float(self.returns.mean())

    @property
    def std_return(self) -> float:
        return float(self.returns.std())

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % confidence interval of the mean return, for normally distributed means; nan for one episode."""
        count = len(self.returns)
        error = 1.959964 * self.std_return / math.sqrt(count - 1) if count > 1 else math.nan
        return self.mean_return - error, self.mean_return + error

    def __str__(self) -> str:
        """A table with a line for returns and one for lengths."""
        lines = [
            f"{name}  mean {x.mean():.6g}  std {x.std():.6g}  least {x.min():.6g}  most {x.max():.6g}"
            for name, x in (("return", self.returns), ("length", self.lengths))
        ]
        low, high = self.interval
        return f"{lines[0]}  95 % interval of the mean {low:.6g} to {high:.6g}\n{lines[1]}"


class Training:
    """A training: its environments, its learner and its curve. mjenv.train makes and runs one.

    settings: those of now. curve: a Point for each update.
    """

    def __init__(
        self,
        envs: VectorEnv,
        settings: Settings,
        *,
        seed: int = 1,
        threads: int = 1,
        stepped_here: bool = False,
    ) -> None:
        """stepped_here: the environments are stepped by Python, as for mjenv.view, with the same bits."""
        self._envs = envs
        self.settings, self.seed, self.threads = settings, _seed_of(seed), threads
        # The options of make_vec in all stages, the present stage, and the options that set_options has changed in it.
        self.options: dict[str, Any] = {}
        self.stages: Sequence[Stage] = ()
        self.stage = 0
        self.changed: dict[str, Any] = {}
        self.stopped = False
        self.interrupted = False  # whether an error or Ctrl-C has ended the training
        rows = envs.handle
        self._here = stepped_here or type(rows) is not Rows
        _check_mode(envs)
        words = f"{words_of(settings)} seed={self.seed} threads={threads}"
        self._learner = Learner(rows, words, self._first() if self._here else None)
        self.curve: list[Point] = []

    def close(self) -> None:
        self._learner.close()

    @property
    def envs(self) -> VectorEnv:
        """The environments. A callback may write their live parameters and rows."""
        return self._envs

    @property
    def id(self) -> str:
        return self._envs.handle.id

    @property
    def steps(self) -> int:
        """The steps of all rows so far."""
        return self.curve[-1].steps if self.curve else 0

    def update(self) -> Point:
        """Plays a rollout and updates the networks."""
        if self._here:
            self._play()
        else:
            self._learner.train()
        self.curve.append(_point(self._learner.report()))
        return self.curve[-1]

    def set(self, **values: Any) -> None:
        """Changes settings from the next rollout on. The settings of the networks and the number of rows cannot
        change."""
        settings = self.settings.with_values(values)
        self._learner.set(words_of(values))
        self.settings = settings

    def set_options(self, **options: Any) -> None:
        """Continues in new environments with other options: the next lesson of a curriculum."""
        spec = self.envs.spec
        if spec is None or not isinstance(self.envs, VectorEnv):
            raise errors.OptionError("options can change in environments of mjenv alone", Status.E_TYPE)
        given = {name: value for name, value in spec.kwargs.items() if name not in ("vectorization_mode", "num_envs")}
        self.set_envs(_made(self.id, self.settings.rows, {**given, **options}))
        self.changed.update(options)

    def set_envs(self, envs: VectorEnv) -> None:
        """Continues in other environments with the same spaces and number of rows."""
        _check_mode(envs)
        if not self._here:
            self._learner.set_rows(envs.handle)
        self._envs = envs
        if self._here:
            self._learner.restart(self._first())

    def stop(self) -> None:
        """Ends the training after this update."""
        self.stopped = True

    def policy(self, *, best: bool = False) -> Policy:
        """The deterministic policy of the last update. best: that of the rollout with the greatest mean return."""
        return Policy.parse(self._policy_text(best))

    def _policy_text(self, best: bool) -> str:
        rows = self._envs.handle
        if not isinstance(rows, Rows):  # the observation's terms have no names
            return self._learner.policy(Learned.BEST if best else Learned.LAST)
        known = {*Options(rows.engine, rows.id).schema(), *RANDOMIZING}
        about = {
            "engine": rows.engine.name,
            "options": {
                name: value
                for name, value in self.description().present_options().items()
                if name in known and name not in saved.RUNNING
            },
            "revision": spec_of(rows.engine, rows.id).revision,
        }
        self._learner.describe(json.dumps(about, default=saved.plain), terms_of(rows))
        return self._learner.policy(Learned.BEST if best else Learned.LAST)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Saves a checkpoint. It contains the image of all rows, unless Python steps them."""
        self._learner.save(path, self.description().text())

    def load(self, path: str | os.PathLike[str]) -> None:
        """Continues from a checkpoint. If Python steps the rows, new episodes begin."""
        self._learner.load(path)
        if self._here:
            self._learner.restart(self._first())
        count = _point(self._learner.report()).updates
        self.curve[:] = [_point(self._learner.report(update)) for update in range(1, count + 1)]

    def description(self) -> Description:
        """What a checkpoint and training.json keep of the training."""
        tasks, settings = loaded_tasks(), dict(self.settings)
        rows = self._envs.handle
        engine = {"engine": rows.engine.name} if isinstance(rows, Rows) else {}
        options, stages = {**self.options, **engine}, [*self.stages]
        return Description(self.id, self.seed, tasks, options, stages, self.stage, self.changed, settings)

    def write(self, folder: Path) -> None:
        """Writes the checkpoint, what it says of the training, the policy, and the curve as CSV and as a picture."""
        self.save(folder / CHECKPOINT)
        saved.replace(folder / DESCRIPTION, self.description().text())
        saved.replace(folder / POLICY, self._policy_text(best=self.interrupted))
        names = [one.name for one in fields(Point)]
        curve = io.StringIO()
        writer = csv.writer(curve, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([getattr(point, name) for name in names] for point in self.curve)
        saved.replace(folder / CURVE, curve.getvalue())
        saved.replace(folder / PICTURE, self._picture())

    def _picture(self) -> str:
        # Without nan, and what is too large to be drawn.
        played = [(point.steps / 1e6, point.mean_return) for point in self.curve if abs(point.mean_return) < 1e300]
        line = svg.Line(self.id, played or [(self.steps / 1e6 or 1.0, 0.0)])
        return svg.drawing(
            [svg.Panel(self.id, "steps, million", f"mean return of {self.settings.window} episodes", [line])]
        )

    def _first(self) -> Float64Array:
        """Begins new episodes, with the seeds that the library's learner uses. Returns their first observations."""
        self.envs.reset(seed=self.seed)
        return np.array(self.envs.outputs.obs)

    def _play(self) -> None:
        outputs = self.envs.outputs
        try:
            for _ in range(self.settings.rollout_steps):
                self.envs.step(self._learner.act())
                self._learner.feed(
                    outputs.obs, outputs.final_obs, outputs.reward, outputs.terminated, outputs.truncated
                )
        except BaseException:  # also KeyboardInterrupt: the rollout under way is given up
            self._learner.restart(self._first())
            raise


def train(
    id: str | VectorEnv,
    *,
    steps: int | None = None,
    seconds: float | None = None,
    seed: int | None = None,
    threads: int = 1,
    settings: Settings | Mapping[str, Any] | None = None,
    stages: Sequence[Stage] = (),
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    overwrite: bool = False,
    callback: Callable[[Training], None] | None = None,
    every: int = 1,
    view: bool = False,
    **options: Any,
) -> Training:
    """Trains a policy by PPO in the library's own learner, and returns the Training, with its curve and policy.

    id: one of ids(), or a gymnasium.vector.VectorEnv of any library, whose autoreset mode is SAME_STEP. steps: of all
    rows together; the default depends on the id. seconds: stop after so many seconds. seed: by default 1. threads: of
    the environments and the networks; they change no bit. settings: a Settings, or some of its values. stages: parts of
    the training, whose options are added to `options`; their steps replace `steps`. out: a folder. It receives
    policy.txt, curve.csv, curve.svg and a checkpoint from time to time and at the end. If Ctrl-C or an error ends the
    training, policy.txt is the best policy so far. resume: continue from the checkpoint in `out`, with its seed and
    with the settings, stages and options that are not given here; a model that only the checkpoint names is read with
    trust_xml="no", and a NumPy task begins new episodes. overwrite: replace the training in `out`, which is otherwise
    refused. callback: called with the Training after each `every` updates; it may change its settings, options and
    environments, or stop it. view: show the environments in a browser. options: those of make_vec.
    """
    envs: VectorEnv | None = None if isinstance(id, str) else vectors.taken(id)
    if envs is not None and (options or stages):
        raise errors.OptionError("options and stages need an id, not environments", Status.E_TYPE)
    name = own_id(envs.handle.id if envs is not None else id)
    folder = Path(out) if out is not None else None
    if resume and folder is None:
        raise errors.OptionError("resume needs the folder `out`", Status.E_TYPE)
    if resume and overwrite:
        raise errors.OptionError("a training is either resumed or overwritten", Status.E_TYPE)
    with ExitStack() as held:
        kept = None
        if resume and folder is not None:
            held.enter_context(saved.locked(folder))
            kept = _kept(folder, name, seed, options)
        if envs is not None:
            options = _given_to(envs)
        elif kept is not None:
            options = kept.options
        chosen = _settings_of(name, settings, kept)
        if envs is not None:
            chosen = chosen.with_values({"rows": envs.num_envs})
        parts = _parts_of(stages, steps, kept) or [Stage(chosen.steps)]
        if any(part.steps < 1 for part in parts):
            raise errors.InvalidValueError("a training, and each of its stages, needs at least one step")
        chosen = chosen.with_values({"steps": sum(part.steps for part in parts)})

        def make(part: Stage, changed: Mapping[str, Any]) -> VectorEnv:
            if envs is not None:
                return envs
            return _made(name, chosen.rows, {"num_threads": threads, **options, **part.options, **changed})

        first, changed = (min(kept.stage, len(parts) - 1), kept.changed) if kept is not None else (0, {})
        first_envs = make(parts[first], changed)
        chosen = _with_groups(chosen, first_envs.handle)
        number = kept.seed if kept is not None else 1 if seed is None else seed
        training = Training(first_envs, chosen, seed=number, threads=threads, stepped_here=view)
        training.options, training.stages, training.stage, training.changed = options, parts, first, changed
        if folder is not None and resume:
            training.load(folder / CHECKPOINT)
        elif folder is not None:
            description = training.description().text()
            folder.mkdir(parents=True, exist_ok=True)
            held.enter_context(saved.locked(folder))
            saved.clear(folder, overwrite)
            saved.replace(folder / DESCRIPTION, description)
        _Run(training, parts, first, make, seconds, callback, every, folder, view).run()
    return training


class _Run:
    """The work of one call of train."""

    def __init__(
        self,
        training: Training,
        parts: Sequence[Stage],
        first: int,
        make: Callable[[Stage, Mapping[str, Any]], VectorEnv],
        seconds: float | None,
        callback: Callable[[Training], None] | None,
        every: int,
        folder: Path | None,
        view: bool,
    ) -> None:
        self.training, self._parts, self._make, self._callback = training, parts, make, callback
        self._first, self._every, self._folder, self._view = first, max(1, every), folder, view
        self._end = math.inf if seconds is None else time.perf_counter() + seconds
        self._next_save = time.perf_counter() + SAVE_SECONDS

    def run(self) -> None:
        try:
            self._stages()
        except BaseException:
            self.training.interrupted = True
            raise
        finally:
            if self._folder is not None:
                self.training.write(self._folder)

    def _stages(self) -> None:
        training = self.training
        for index in range(self._first, len(self._parts)):
            if index > self._first:
                training.set_envs(self._make(self._parts[index], {}))
                training.stage, training.changed = index, {}
            before = self._episodes_before(index)
            with self._shown():
                while not self._is_over() and not (
                    training.curve and self._has_ended(index, before, training.curve[-1])
                ):
                    self._update()
            if self._is_over():  # resumed in this stage
                return

    def _has_ended(self, index: int, before: int, point: Point) -> bool:
        """Whether a stage, before which there were so many episodes, has ended with this point."""
        until = self._parts[index].until
        enough = point.episodes - before >= self.training.settings.window
        has_learnt = until is not None and enough and point.mean_return >= until
        return has_learnt or point.steps >= sum(part.steps for part in self._parts[: index + 1])

    def _episodes_before(self, stage: int) -> int:
        """How many episodes had ended when the stage began. It may have begun before this call of train."""
        index = before = 0
        for point in self.training.curve:
            if index < stage and self._has_ended(index, before, point):
                index, before = index + 1, point.episodes
        return before

    def _shown(self) -> Any:
        """A context in which a browser shows the environments, if it is to."""
        if self._view:
            from mjenv_viewer import view

            return view(self.training.envs)
        return nullcontext()

    def _is_over(self) -> bool:
        return self.training.stopped or time.perf_counter() >= self._end

    def _update(self) -> None:
        point = self.training.update()
        if self._folder is not None and time.perf_counter() >= self._next_save:
            self.training.write(self._folder)
            self._next_save = time.perf_counter() + SAVE_SECONDS
        if self._callback is not None and point.updates % self._every == 0:
            self._callback(self.training)


def evaluate(
    policy: Policy | str | os.PathLike[str],
    episodes: int = 1000,
    *,
    id: str | None = None,
    seed: int = 0,
    rows: int = 64,
    threads: int = 1,
    precision: str = "float64",
    **options: Any,
) -> Evaluation:
    """Plays whole episodes of a deterministic policy without Python between the steps.

    policy: a Policy, or the path of a policy.txt. id: another id than the policy's. Episode k is the first one of a new
    environment, with reset(seed=seed + k), so the result does not depend on rows and threads. precision: "float64"
    gives the bits of Policy.act, "float32" is faster and computes as the learner does. options: those of make_vec; the
    others are those with which the policy was trained, if it names them.
    """
    chosen = policy if isinstance(policy, Policy) else Policy.load(policy)
    precisions = {"float64": Precision.FLOAT64, "float32": Precision.FLOAT32}
    if precision not in precisions:
        raise errors.InvalidValueError(f"precision is {precision!r}, not one of {', '.join(precisions)}")
    if episodes < 1:
        raise errors.InvalidValueError(f"episodes is {episodes}, less than 1")
    seed = _seed_of(seed)
    handle = PolicyHandle(chosen.text())
    name = own_id(id or chosen.id)
    if name == own_id(chosen.id):
        options = chosen.keywords(**options)
    envs = VectorEnv(
        name,
        max(1, min(rows, episodes)),
        num_threads=threads,
        autoreset_mode="disabled",
        **{"lanes": "max", **options},
    )
    try:
        plays = _evaluate if type(envs.handle) is Rows else _evaluate_here
        return Evaluation(*plays(envs, handle, precisions[precision], seed, episodes))
    finally:
        envs.close()


def _evaluate(
    envs: VectorEnv, handle: PolicyHandle, precision: Precision, seed: int, episodes: int
) -> tuple[Float64Array, NDArray[np.int64]]:
    return handle.evaluate(envs.handle, precision, seed, episodes)


def _evaluate_here(
    envs: VectorEnv, handle: PolicyHandle, precision: Precision, seed: int, episodes: int
) -> tuple[Float64Array, NDArray[np.int64]]:
    """The same for tasks in NumPy, whose rows Python steps: groups of episodes, one episode in each row."""
    returns, lengths = np.zeros(episodes), np.zeros(episodes, np.int64)
    actuators, obs = envs.single_action_space.shape[0], envs.outputs.obs
    places = handle.find(terms_of(envs.handle))
    image = envs.snapshot()  # an episode may leave things that resets keep
    for first in range(0, episodes, envs.num_envs):
        envs.restore(image)
        count = min(envs.num_envs, episodes - first)
        envs.reset(seed=[seed + first + min(row, count - 1) for row in range(envs.num_envs)])
        playing = np.arange(envs.num_envs) < count
        while playing.any():
            _, reward, terminated, truncated, _ = envs.step(handle.act(obs[:, places], actuators, precision))
            returns[first : first + count] += np.where(playing, reward, 0)[:count]
            lengths[first : first + count] += playing[:count]
            ended = terminated | truncated
            playing &= ~ended
            if ended.any():  # ended rows play another episode, because a step needs all rows
                envs.reset(options={"reset_mask": ended})
    return returns, lengths


def _point(report: Any) -> Point:
    return Point(**{one.name: getattr(report, one.name) for one in fields(Point)})


def _with_groups(settings: Settings, rows: Rows) -> Settings:
    """Lets each network see its own group, if the observation has the groups policy (or actor) and critic.

    Settings that say what a network sees are not changed.
    """
    groups = {group.name: group for group in rows.fields(Role.GROUPS)}
    policy, critic = groups.get("policy", groups.get("actor")), groups.get("critic")
    if policy is None or critic is None:
        return settings
    count = space_of(rows, Role.OBSERVATION).count

    def mask(group: Field) -> tuple[bool, ...]:
        return tuple(group.offset <= index < group.offset + group.count for index in range(count))

    masks = {"actor_obs": settings.actor_obs or mask(policy), "critic_obs": settings.critic_obs or mask(critic)}
    return settings.with_values(masks)


def _seed_of(seed: Any) -> int:
    """The seed of a training or an evaluation, whose rows or episodes have this seed + i."""
    try:
        number = operator.index(seed)
    except TypeError:
        raise errors.OptionError(f"a seed is an int, not {seed!r}", Status.E_TYPE) from None
    if not 0 <= number < 2**63:
        raise errors.InvalidValueError(f"a seed is at least 0 and less than 2**63, not {number}", Status.E_VALUE)
    return number


def _check_mode(envs: VectorEnv) -> None:
    mode = envs.metadata.get("autoreset_mode")
    if (mode := getattr(mode, "name", mode)) != "SAME_STEP":
        what = f"the environments have the autoreset mode {mode}; training needs SAME_STEP"
        raise errors.OptionError(what, Status.E_VALUE)
    if envs.outputs.obs.dtype != np.float64:
        raise errors.OptionError("training needs observations of dtype float64", Status.E_VALUE)


def _made(id: str, count: int, options: Mapping[str, Any]) -> VectorEnv:
    # max: as many lanes as the CPU has. Their memory is small beside the learner's.
    return make_vec(id, count, **{"lanes": "max", **options, "autoreset_mode": "same_step"})


def _given_to(envs: VectorEnv) -> dict[str, Any]:
    """The options with which environments were made."""
    kwargs = envs.spec.kwargs if envs.spec is not None and isinstance(envs, VectorEnv) else {}
    return {name: value for name, value in kwargs.items() if name not in ("vectorization_mode", "num_envs")}


def _kept(folder: Path, id: str, seed: int | None, options: Mapping[str, Any]) -> Description:
    """What the checkpoint in a folder says of its training. Raises InvalidValueError if this is another one."""
    kept = Description.read(folder)
    if kept.id != id:
        raise errors.InvalidValueError(f"{folder} holds a training of {kept.id}, not of {id}")
    if seed is not None and seed != kept.seed:
        raise errors.InvalidValueError(f"{folder} holds a training with the seed {kept.seed}, not {seed}")
    names_model = any(name in options for name in MODEL_OPTIONS)

    def merged(theirs: Mapping[str, Any]) -> dict[str, Any]:
        safe = theirs if names_model else saved.without_trust(theirs)
        return {name: options.get(name, value) for name, value in safe.items()}

    return replace(
        kept,
        options={**merged(kept.options), **options},
        stages=[replace(stage, options=merged(stage.options)) for stage in kept.stages],
        changed=merged(kept.changed),
    )


def _settings_of(id: str, given: Settings | Mapping[str, Any] | None, kept: Description | None) -> Settings:
    """The settings of a training. kept: of the training that continues; settings that are not given are its."""
    if isinstance(given, Settings):
        return given
    if kept is None:
        return Settings.of(id).with_values(given or {})
    return Settings.of(id).with_values(kept.settings).with_values(given or {})


def _parts_of(stages: Sequence[Stage], steps: int | None, kept: Description | None) -> list[Stage]:
    """The stages of a training, of which `steps` sets the end if they are not given; [] for the settings' steps."""
    parts = [*stages] or (kept.stages if kept is not None else [])
    if stages or steps is None:
        return parts
    before, last = parts[:-1], parts[-1] if parts else Stage(steps)
    left = steps - sum(part.steps for part in before)
    if left < 1 and before:
        raise errors.InvalidValueError(f"steps is {steps}, but the last stage begins after {steps - left} steps")
    return [*before, replace(last, steps=left)]

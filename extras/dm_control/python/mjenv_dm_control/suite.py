"""dm_control.suite: from mjenv_dm_control import suite instead of from dm_control import suite.

Needs dm_env (pip install "mjenv[dm_control]"). dm_control itself is only needed for tasks that mjenv lacks.
"""

from __future__ import annotations

import difflib
import numbers
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjenv.capi.declarations import Role
from mjenv.capi.handle import Rows
from mjenv.capi.schema import Field
from mjenv.gym.env import Environment as MujocoEnv
from mjenv.gym.make import make
from mjenv_dm_control._dm_env import dm_env, specs
from mjenv_dm_control.physics import Physics
from mjenv_dm_control.streams import random_state, set_random_state

Observation = OrderedDict[str, Any]
TaskName = tuple[str, str]

# The tasks of each domain, in dm_control's order. *: part of BENCHMARKING.
_TASKS = {
    "acrobot": "swingup* swingup_sparse*",
    "ball_in_cup": "catch*",
    "cartpole": "balance* balance_sparse* swingup* swingup_sparse* two_poles three_poles",
    "cheetah": "run*",
    "finger": "spin* turn_easy* turn_hard*",
    "fish": "upright* swim*",
    "hopper": "stand* hop*",
    "humanoid": "stand* walk* run* run_pure_state",
    "humanoid_CMU": "stand walk run",
    "lqr": "lqr_2_1 lqr_6_2",
    "manipulator": "bring_ball* bring_peg insert_ball insert_peg",
    "pendulum": "swingup*",
    "point_mass": "easy* hard",
    "quadruped": "walk run escape fetch",
    "reacher": "easy* hard*",
    "stacker": "stack_2 stack_4",
    "swimmer": "swimmer6* swimmer15*",
    "walker": "stand* walk* run*",
}
_LISTED = [(domain, task) for domain, tasks in _TASKS.items() for task in tasks.split()]

ALL_TASKS: tuple[TaskName, ...] = tuple((domain, task.rstrip("*")) for domain, task in _LISTED)
BENCHMARKING: tuple[TaskName, ...] = tuple((domain, task[:-1]) for domain, task in _LISTED if task.endswith("*"))
EASY: tuple[TaskName, ...] = (("ball_in_cup", "catch"), ("point_mass", "easy"), ("reacher", "easy"))
HARD: tuple[TaskName, ...] = tuple(task for task in ALL_TASKS if task[0] in ("manipulator", "stacker"))
EXTRA: tuple[TaskName, ...] = tuple(sorted({*ALL_TASKS} - {*BENCHMARKING}))
TASKS_BY_DOMAIN: dict[str, tuple[str, ...]] = {
    domain: tuple(task.replace("*", "") for task in tasks.split()) for domain, tasks in _TASKS.items()
}

# mjenv's own tasks. Programs add others to ALL_TASKS, which dm_control then loads.
_OURS = frozenset(ALL_TASKS)

# Domains whose episodes never end. All other episodes end after 1,000 steps of the task's own length.
_ENDLESS = {"lqr"}
# The task_kwargs of single tasks, or of all tasks of a domain, besides random and time_limit.
_OPTIONS = {
    ("cartpole", "three_poles"): {"sparse"},
    ("manipulator", ""): {"fully_observable"},
    ("stacker", ""): {"fully_observable"},
}
_OF_ENVIRONMENTS = {"flat_observation", "n_sub_steps", "control_timestep"}
# Terms of the observation that are numbers and not vectors.
_NUMBERS = {"dist_to_target", "head_height", "height", "upright"}
_SHAPES: dict[str, tuple[int, ...]] = {"arm_pos": (-1, 2), "box_pos": (-1, 4), "torso_upright": ()}


def load(
    domain_name: str,
    task_name: str,
    task_kwargs: Mapping[str, Any] | None = None,
    environment_kwargs: Mapping[str, Any] | None = None,
    visualize_reward: bool = False,
) -> dm_env.Environment:
    """Builds the environment of a task, as dm_control's suite.load does.

    task_kwargs: random (a seed, a numpy.random.RandomState that resets then draw from, or None for any seed),
    time_limit (s), fully_observable (manipulator, stacker), sparse (cartpole's three_poles). environment_kwargs:
    flat_observation, n_sub_steps, control_timestep. visualize_reward: pictures show the reward by the colours of
    materials. Tasks that mjenv lacks, and other numbers of poles than 3, come from dm_control, which must be installed
    then.
    """
    for name, given in (("task_kwargs", task_kwargs), ("environment_kwargs", environment_kwargs)):
        if not isinstance(given, Mapping | None):
            raise TypeError(f"{name} is a mapping of keywords, or None, not {given!r}")
    kwargs = dict(task_kwargs or {})
    has_more_poles = (domain_name, task_name) == ("cartpole", "three_poles") and kwargs.pop("num_poles", 3) != 3
    if (domain_name, task_name) not in _OURS or has_more_poles:
        return _load_original(domain_name, task_name, task_kwargs, environment_kwargs, visualize_reward)
    if "environment_kwargs" in kwargs:
        environment_kwargs = kwargs.pop("environment_kwargs")
    of_environment = dict(environment_kwargs or {})
    known = _OPTIONS.get((domain_name, task_name), _OPTIONS.get((domain_name, ""), set()))
    for given, names in ((kwargs, {"random", "time_limit", *known}), (of_environment, _OF_ENVIRONMENTS)):
        if unknown := {*given} - names:
            raise TypeError(
                f"{domain_name} {task_name} got an unexpected keyword argument {min(map(str, unknown))!r}; it takes "
                f"{', '.join(sorted(names))} here"
            )
    env = Environment(domain_name, task_name, **kwargs, **of_environment)
    env.task.visualize_reward = visualize_reward
    return env


def _load_original(domain: str, task: str, *arguments: Any) -> dm_env.Environment:
    """What mjenv lacks, from dm_control."""
    is_known = domain in TASKS_BY_DOMAIN
    known = TASKS_BY_DOMAIN[domain] if is_known else tuple(TASKS_BY_DOMAIN)
    # As dm_control says it.
    message = (
        f"Level {task!r} does not exist in domain {domain!r}." if is_known else f"Domain {domain!r} does not exist."
    )
    near = difflib.get_close_matches(str(task if is_known else domain), known, 1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    try:
        load_original = import_module("dm_control.suite").load
    except ImportError:
        if is_known and task in known:
            raise ValueError(f"{domain} {task} with these arguments needs dm_control: pip install dm_control") from None
        raise ValueError(
            f"{message}{hint} mjenv has {', '.join(known)}; others need dm_control (pip install dm_control)."
        ) from None
    try:
        return load_original(domain, task, *arguments)
    except ValueError as error:
        if str(error) != message:
            raise
        raise ValueError(message + hint) from None


# What steps need, without the time that looking it up or calling Python code would take.
_FLOAT64, _MID, _LAST = np.dtype(np.float64), dm_env.StepType.MID, dm_env.StepType.LAST
_new_tuple = tuple.__new__  # the constructor of a TimeStep without the code that names its arguments

# The materials whose colour shows the reward. NAME_default is the colour for 0, and NAME_highlight that for 1.
_COLOURED = ("self", "effector", "target")


class Terms:
    """Where each term is in the library's observation, and its shape."""

    def __init__(self, fields: Sequence[Field]) -> None:
        self._parts: list[tuple[str, Any]] = [
            (f.name, f.offset if f.name in _NUMBERS else slice(f.offset, f.offset + f.count)) for f in fields
        ]
        # Of the terms whose shape is not that of their part.
        self._shapes = [(field.name, _SHAPES[field.name]) for field in fields if field.name in _SHAPES]

    def of(self, values: NDArray[np.float64]) -> Observation:
        """The terms of an observation."""
        terms: Observation = OrderedDict()
        for name, part in self._parts:
            terms[name] = values[part]
        for name, shape in self._shapes:
            terms[name] = terms[name].reshape(shape)
        return terms


class Task:
    """env.task: the random numbers of the episodes, the terms of observations, and whether pictures show the reward."""

    def __init__(self, rows: Rows, random: Any) -> None:
        self._rows = rows
        self.terms = Terms(rows.fields(Role.OBSERVATION))
        self._visualize_reward = False
        # The library holds the stream. If the program has the RandomState, each reset first writes its state to the
        # library, and afterwards reads it back.
        self._random: np.random.RandomState | None = None
        if not isinstance(random, np.random.RandomState):
            # NumPy refuses what is no seed of RandomState.
            state = np.random.RandomState(random)
            if random is None or isinstance(random, numbers.Integral):
                rows.seed(0, int(np.random.SeedSequence().generate_state(1)[0]) if random is None else int(random))
                return
            random = state
        self._random, self._is_new = random, True

    @property
    def random(self) -> np.random.RandomState:
        """The stream from which resets draw. Draws from it advance the stream."""
        if self._random is None:
            self._random = np.random.RandomState(0)
            self.take_stream()
        return self._random

    @random.setter
    def random(self, value: np.random.RandomState) -> None:
        self._random, self._is_new = value, False

    @property
    def visualize_reward(self) -> bool:
        """The colours of materials show the reward, from the next step or reset on."""
        return self._visualize_reward

    @visualize_reward.setter
    def visualize_reward(self, value: bool) -> None:
        if not isinstance(value, bool):
            raise ValueError(f"Expected a boolean, got {type(value)}.")
        self._visualize_reward = value

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(
            f"task has no {name!r}: the library computes rewards and begins episodes itself, in env.step and env.reset"
        )

    def action_spec(self, physics: Physics | MujocoEnv) -> specs.BoundedArray:
        """The bounds of the motors; 1e10 for those without."""
        limited = np.asarray(physics.model.actuator_ctrllimited).astype(bool).ravel()
        low, high = np.asarray(physics.model.actuator_ctrlrange).T
        largest = 1e10  # MuJoCo's mjMAXVAL
        return specs.BoundedArray(
            limited.shape, float, np.where(limited, low, -largest), np.where(limited, high, largest)
        )

    def get_observation(self, physics: Physics) -> Observation:
        """The observation of the present state, of env.physics or of a copy of it."""
        return self.terms.of(physics.observe())

    def show(self, reward: float, physics: Physics) -> None:
        """Colours the materials by a reward."""
        colours = physics.named.model.mat_rgba
        default, highlight = (colours[[f"{name}_{kind}" for name in _COLOURED]] for kind in ("default", "highlight"))
        share = np.clip(reward, 0.0, 1.0) ** 4
        colours[[*_COLOURED]] = share * highlight + (1.0 - share) * default

    def give_stream(self) -> None:
        """Writes the stream to the library, if the program may have drawn from it."""
        if self._random is not None:
            set_random_state(self._rows, self._random.get_state(), self._is_new)

    def take_stream(self) -> None:
        """Reads the stream back after draws of the library."""
        if self._random is not None:
            state, self._is_new = random_state(self._rows)
            self._random.set_state(state)


class Environment(dm_env.Environment):  # type: ignore[misc, unused-ignore]
    """A task of the suite, as dm_control.rl.control.Environment.

    physics: the simulation. task: the random numbers. mjenv: the environment of the library that computes it.
    """

    def __init__(
        self,
        domain_name: str,
        task_name: str,
        random: int | np.random.RandomState | None = None,
        time_limit: float | None = None,
        n_sub_steps: int | None = None,
        control_timestep: float | None = None,
        flat_observation: bool = False,
        **options: Any,
    ) -> None:
        id = f"dm_control/{domain_name}-{task_name}-v0"
        # Actions need not be finite: MuJoCo warns of them.
        options |= {"max_episode_steps": -1, "visualize_reward": True, "arrays": "warnings", "strict": False}
        self.mjenv = make(id, **options)
        timestep = self.mjenv.handle.timestep()
        # If the task itself sets the length of a step, dm_control refuses n_sub_steps.
        if n_sub_steps is not None and (control_timestep is not None or self.mjenv.frame_skip > 1):
            raise ValueError("Both n_sub_steps and control_timestep were supplied.")
        if control_timestep is not None:
            if self.mjenv.frame_skip > 1:
                raise TypeError(
                    f"{domain_name} {task_name} got multiple values for keyword argument 'control_timestep'"
                )
            n_sub_steps = _timesteps(control_timestep, timestep)
        natural = float("inf") if domain_name in _ENDLESS else round(1000 * self.mjenv.dt)
        if n_sub_steps is not None and n_sub_steps != self.mjenv.frame_skip:
            self.mjenv.close()
            self.mjenv = make(id, frame_skip=n_sub_steps, **options)
        seconds = natural if time_limit is None else time_limit
        self._limit = seconds / (timestep * self.mjenv.frame_skip)
        self._domain = domain_name
        self._controls = np.empty(self.mjenv.action_space.shape)
        self._physics: Physics | None = None
        _ = self.mjenv.np_random_seed  # it is seeded, so that resets go on with the stream, which the task sets
        self.task = Task(self.mjenv.handle, random)
        self._observe: Callable[[NDArray[np.float64]], Observation] = _flat if flat_observation else self.task.terms.of
        self._no_warnings = bytes(self.mjenv.arrays["warnings"].nbytes)
        self._steps = 0
        self._ended, self._is_begun = True, False

    def reset(self) -> dm_env.TimeStep:
        """Begins an episode."""
        self._ended, self._steps = False, 0
        if self._physics is not None:
            self._physics.pointers.release(model=True)
        self.task.give_stream()
        values, info = self.mjenv.reset()
        self.task.take_stream()
        self._is_begun = True
        if self.mjenv.arrays["warnings"].tobytes() != self._no_warnings:
            self._report()
        if self.task.visualize_reward:
            self.task.show(info["visualized_reward"], self.physics)
        return dm_env.restart(self._observe(values))

    def step(self, action: ArrayLike) -> dm_env.TimeStep:
        """Takes a step, or begins an episode if the last one has ended."""
        if self._ended:
            return self.reset()
        controls = self._controls
        # NumPy's function converts lists, other types and broadcast shapes, and takes its time.
        if isinstance(action, np.ndarray) and action.dtype is _FLOAT64 and action.shape == controls.shape:
            controls = action
        else:
            np.copyto(controls, action)
        if self._physics is not None and self._physics.pointers.exist:
            self._physics.pointers.release()
        mjenv, task = self.mjenv, self.task
        values, reward, terminated, _, _ = mjenv.step(controls)
        # Comparing bytes takes less time than NumPy's functions.
        if mjenv.arrays["warnings"].tobytes() != self._no_warnings:
            self._report()
        if task._visualize_reward:
            task.show(reward, self.physics)
        self._steps += 1
        observation = self._observe(values)
        kind, discount = _MID, 1.0
        if self._steps >= self._limit:
            self._ended, kind = True, _LAST
        elif terminated:
            self._ended, kind, discount = True, _LAST, 0.0
        return _new_tuple(dm_env.TimeStep, (kind, reward, discount, observation))

    def action_spec(self) -> specs.BoundedArray:
        """The bounds of the motors; 1e10 for those without."""
        return self.task.action_spec(self.mjenv)

    def observation_spec(self) -> Mapping[str, specs.Array]:
        """The shapes of the observations."""
        terms = self._observe(np.zeros(self.mjenv.observation_space.shape))
        return OrderedDict((name, specs.Array(np.shape(value), np.dtype(float), name)) for name, value in terms.items())

    @property
    def physics(self) -> Physics:
        """The simulation."""
        if self._physics is None:
            self._physics = Physics(self.mjenv, self._domain)
            if not self._is_begun:
                self._physics.reset()
        return self._physics

    def control_timestep(self) -> float:
        """The seconds between two actions."""
        return float(self.mjenv.dt)

    def __getstate__(self) -> dict[str, Any]:
        if self._physics is not None:
            self._physics.pointers.commit()
        return {**self.__dict__, "_physics": None}  # OpenGL stays in its process

    def close(self) -> None:
        """Frees the simulation."""
        if self._physics is not None:
            self._physics.free()
        self.mjenv.close()

    def _report(self) -> None:
        self.physics.report(self.mjenv.arrays["warnings"])


def _flat(values: NDArray[np.float64]) -> Observation:
    return OrderedDict(observations=values)


def _timesteps(control_timestep: float, timestep: float) -> int:
    """How many timesteps a step of that length has."""
    ratio = control_timestep / timestep
    if control_timestep < timestep:
        raise ValueError(f"Control timestep ({control_timestep}) cannot be smaller than physics timestep ({timestep}).")
    if abs(ratio - round(ratio)) > 1e-8:
        raise ValueError(
            f"Control timestep ({control_timestep}) must be an integer multiple of physics timestep ({timestep})"
        )
    return round(ratio)


def __getattr__(name: str) -> Any:
    """What else dm_control.suite has, if it is installed: its domains and REWARD_VIZ, for example."""
    if not name.startswith("__"):
        try:
            return getattr(import_module("dm_control.suite"), name)
        except ImportError:
            pass
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

"""Draws of resets for arrays of the model (Value, Scale, Offset, Same), and noise, delays and pushes.

make, make_vec and gymnasium.make take them as the keywords randomize, noise, delay and push. All are plain values: they
can be pickled, and the keywords also take the JSON that gymnasium.spec(...).to_json() makes of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

Name = str | int
Names = Name | Sequence[Name] | None
Numbers = float | Sequence[float] | Mapping[str, float | Sequence[float]]
DistributionName = Literal["uniform", "log_uniform", "normal", "truncated_normal", "choice"]


@dataclass(frozen=True, kw_only=True)
class _Drawn:
    body: Names = None
    geom: Names = None
    joint: Names = None
    actuator: Names = None
    site: Names = None
    tendon: Names = None
    elements: Sequence[int] | None = None
    columns: int | Sequence[int] | None = None
    set_constants: bool = False


@dataclass(frozen=True)
class Value(_Drawn):
    """Resets draw the values of an array.

    low, high: the bounds of uniform, log_uniform and truncated_normal. mean, std: of normal and truncated_normal.
    choices: the values to choose from; the distribution is then a choice. body, geom, joint, actuator, site, tendon:
    names or numbers of the objects whose elements are drawn. elements: numbers of elements of the flattened array.
    Without any of these, all elements are drawn. columns: the columns of the array that are drawn; geom_friction has
    the sliding friction in column 0. shared: one draw for all elements instead of one each. set_constants: after all
    draws mj_setConst computes anew what MuJoCo derives from masses and, in MuJoCo 4.0, from sizes.

    Draw body_inertia with body_mass, and geom_rbound with geom_size (Same): a geom that grows alone loses contacts.
    """

    low: float | None = None
    high: float | None = None
    distribution: DistributionName = "uniform"
    mean: float | None = None
    std: float | None = None
    choices: Sequence[float] | None = None
    shared: bool = False
    kind: str = field(default="value", init=False, repr=False)


@dataclass(frozen=True)
class Scale(Value):
    """Resets multiply the model's own values by what they draw. The arguments are those of Value."""

    kind: str = field(default="scale", init=False, repr=False)


@dataclass(frozen=True)
class Offset(Value):
    """Resets add what they draw to the model's own values. The arguments are those of Value."""

    kind: str = field(default="offset", init=False, repr=False)


@dataclass(frozen=True)
class Same(_Drawn):
    """Uses the draws of the item before it in randomize for another array, too.

    Element i takes draw i, or the shared draw, times factor, as a value, a scale or an offset like the item before. If
    there are several elements in each row of the array, all of row i take draw i: {"body_mass": Scale(0.8, 1.2),
    "body_inertia": Same(set_constants=True)}. An actuator's kp, for example, is in two arrays: {"actuator_gainprm":
    Value(20, 40, columns=0), "actuator_biasprm": Same(factor=-1, columns=1)}. body, geom, joint, actuator, site,
    tendon, elements, columns and set_constants are those of Value.
    """

    factor: float = 1.0
    kind: str = field(default="same", init=False, repr=False)


@dataclass(frozen=True)
class Noise:
    """Normal noise that is added to actions and observations, with these standard deviations; or uniform noise from
    minus to plus these numbers. There is one for all elements, or one for each; or they are those of the actuators,
    terms and groups that are named: observation={"policy": 0.1}."""

    action: Numbers = 0.0
    observation: Numbers = 0.0
    distribution: Literal["normal", "uniform"] = "normal"


@dataclass(frozen=True)
class Delay:
    """The numbers of steps by which actions and observations are delayed; observation={"policy": 2} delays the terms
    and groups that are named alone.

    Until the first one arrives, zeros take its place. For actions, first_action can replace the zeros: one number for
    all actuators, or one for each. For observations, first_observation="reset" puts the reset's own there.

    A pair such as (0, 2) is a range with both ends, from which the delay is drawn: at each reset, or with
    redraw="step" anew for each step.
    """

    action: int | tuple[int, int] = 0
    observation: int | tuple[int, int] | Mapping[str, int | tuple[int, int]] = 0
    first_action: Numbers = 0.0
    redraw: Literal["reset", "step"] = "reset"
    first_observation: Literal["zero", "reset"] = "zero"


@dataclass(frozen=True)
class Push:
    """Pushes of a body at random times: a force (N) and a torque (N m), or a kick, which changes the velocity.

    force, torque: the bounds (low, high) of each of the three components in the world's axes, which are written to
    xfrc_applied. velocity, angular_velocity: the bounds of a kick, which is added to qvel of the body's free joint
    before a step: m/s in the world's axes, and rad/s in the body's own. every: the fewest and the most steps from
    the reset, or the last step of a push, to the next push. duration: how many steps a force lasts, or the fewest and
    the most.
    """

    body: Name
    force: Sequence[Sequence[float]] = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    torque: Sequence[Sequence[float]] = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    every: tuple[int, int] = (100, 200)
    velocity: Sequence[Sequence[float]] | None = None
    angular_velocity: Sequence[Sequence[float]] | None = None
    duration: int | tuple[int, int] = 1


Draws = Mapping[str, Value | Same | Sequence[Value | Same]]

"""Checks of the numbers of rows and steps that callers pass."""

from __future__ import annotations

import operator
from numbers import Integral
from typing import Any

from mjenv import errors
from mjenv.capi.declarations import Status


def count_of(num_envs: Any) -> int:
    try:
        count = operator.index(num_envs)
    except TypeError:
        raise errors.OptionError(f"num_envs is an int, not {num_envs!r}", Status.E_TYPE) from None
    if not 1 <= count < 2**63:
        raise errors.InvalidValueError(f"num_envs is {count}, less than 1 or more than can be counted", Status.E_VALUE)
    return count


def seed_of(seed: Any) -> int:
    """The seed of a training or an evaluation, whose rows or episodes have this seed + i."""
    try:
        number = operator.index(seed)
    except TypeError:
        raise errors.OptionError(f"a seed is an int, not {seed!r}", Status.E_TYPE) from None
    if not 0 <= number < 2**63:
        raise errors.InvalidValueError(f"a seed is at least 0 and less than 2**63, not {number}", Status.E_VALUE)
    return number


def time_limit_of(max_episode_steps: Any) -> int:
    """The library's option for Gymnasium's keyword: 0 means no limit."""
    if not isinstance(max_episode_steps, Integral) or (max_episode_steps < 1 and max_episode_steps != -1):
        raise errors.InvalidValueError(
            f"max_episode_steps is an int >= 1, or -1 for no limit, not {max_episode_steps!r}"
        )
    return max(0, int(max_episode_steps))

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


def time_limit_of(max_episode_steps: Any) -> int:
    """The library's option for Gymnasium's keyword: 0 means no limit."""
    if not isinstance(max_episode_steps, Integral) or (max_episode_steps < 1 and max_episode_steps != -1):
        raise errors.InvalidValueError(
            f"max_episode_steps is an int >= 1, or -1 for no limit, not {max_episode_steps!r}"
        )
    return max(0, int(max_episode_steps))

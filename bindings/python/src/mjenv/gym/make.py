"""Builds an Environment from an id or a spec, as gymnasium.make does."""

from __future__ import annotations

import copy
from typing import Any

from gymnasium.envs.registration import EnvSpec
from gymnasium.wrappers import RenderCollection

from mjenv.gym.env import Environment
from mjenv.registration import spec
from mjenv.rows.pictures import RENDER_MODES


def spec_asked(id: str | EnvSpec, engine: str | None) -> EnvSpec:
    """The spec for the arguments of make and make_vec."""
    return id if isinstance(id, EnvSpec) else spec(id, engine)


def make(
    id: str | EnvSpec, max_episode_steps: int | None = None, disable_env_checker: bool | None = None, **options: Any
) -> Environment:
    """Builds an environment as gymnasium.make does, with the same keywords.

    id: one of ids(), or an EnvSpec. max_episode_steps: None for the id's own limit, -1 for none. disable_env_checker:
    has no effect, because there is no checking wrapper. options: see options(id), and Gymnasium's keywords for
    rendering; with "rgb_array_list" and the like the environment comes inside Gymnasium's wrapper RenderCollection.
    render_fast=True draws without multisampling and shadows. engine="4.0" computes with MuJoCo 4.0; see engines().
    randomize, noise, delay and push: draws at resets and in steps, for instance {"body_mass": mjenv.Scale(0.5, 1.5)}.
    """
    asked = spec_asked(id, options.get("engine"))
    chosen = {**copy.deepcopy(asked.kwargs), **options}
    own = spec(asked.id, chosen.get("engine"))
    limits = [max_episode_steps, asked.max_episode_steps, chosen.pop("max_episode_steps", None)]
    if chosen.get("time_aware"):
        limits.append(own.max_episode_steps)  # for the spec of an environment within gymnasium.make's TimeLimit
    limit = next((limit for limit in limits if limit is not None), None)
    mode = chosen.get("render_mode")
    single = mode.removesuffix("_list") if isinstance(mode, str) else mode
    listed = single != mode and single in RENDER_MODES
    given = {**chosen, "render_mode": single} if listed else chosen
    env = Environment(own.id, -1 if limit is None else limit, **given)
    own.max_episode_steps = None if limit == -1 else limit
    own.disable_env_checker = asked.disable_env_checker if disable_env_checker is None else disable_env_checker
    # gymnasium.make(env.spec) passes no limit to the environment, but the time needs it.
    own.kwargs = {**given, "max_episode_steps": limit} if given.get("time_aware") else given
    env.spec = own
    if listed:
        return RenderCollection(env)  # type: ignore[return-value]
    return env

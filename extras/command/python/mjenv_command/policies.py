"""The policies that mjenv play and mjenv view take: Stable-Baselines3's .zip files, and text files of the learner."""

from __future__ import annotations

import argparse
import importlib
import pickle
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import flatdim, unflatten
from numpy.typing import NDArray

import mjenv
from mjenv.registration import own_id
from mjenv_command.arguments import options_of

Action = Callable[[Any], Any]  # of an observation

_NORMALIZER = "normalizer.pkl"  # as extras/curricula/python/train_sb3.py saves it


def policy_of(path: Path, env: mjenv.Environment, algorithm: str, normalizer: Path | None) -> Action:
    """The deterministic actions of a saved policy, for one or many rows.

    normalizer: the file of the VecNormalize with which Stable-Baselines3 trained the policy. It can run code, as the
    policy's .zip can, so it is not looked for.
    """
    act = _zipped(path, algorithm, normalizer) if _is_zip(path) else _text(path, env, normalizer)
    try:
        act(unflatten(env.observation_space, np.zeros(flatdim(env.observation_space))))
    except (AttributeError, TypeError, ValueError) as error:
        raise mjenv.InvalidValueError(f"{path} cannot act on observations of {_id(env)}: {error}") from None
    return act


def environment_of(arguments: argparse.Namespace, **given: Any) -> tuple[str, dict[str, Any]]:
    """The id and the keywords of make: what the command gives (also in `given`), and for the rest that with which its
    --policy was trained, if the policy names it."""
    path = arguments.policy
    policy = learned(path) if path is not None and not _is_zip(path) else None
    name = arguments.id or (policy.id if policy is not None else None)
    if name is None:
        raise mjenv.OptionError("name an id, or a --policy of the learner, which has one")
    id = own_id(name)
    given = options_of(id, arguments.option, arguments.engine) | arguments.randomize | given
    if arguments.engine is not None:
        given["engine"] = arguments.engine
    return id, policy.keywords(**given) if policy is not None and policy.id == id else given


def learned(path: Path) -> Any:
    """The policy of a text file, which the learner reads if it is installed."""
    try:
        from mjenv_learn.policy import Policy
    except ImportError:
        raise mjenv.OptionError(f"{path} is a policy of the learner, mjenv_learn, which is not installed") from None
    return Policy.load(path)


def _is_zip(path: Path) -> bool:
    return path.is_file() and zipfile.is_zipfile(path)  # which would wait for a pipe


def _text(path: Path, env: mjenv.Environment, normalizer: Path | None) -> Action:
    policy = learned(path)
    if normalizer:
        raise mjenv.OptionError(f"{path} holds its normalization itself: leave --normalizer out")
    if policy.id != _id(env):
        raise mjenv.InvalidValueError(f"{path} is a policy for {policy.id}, not for {_id(env)}")
    act: Action = policy.acting_in(env)
    return act


def _id(env: mjenv.Environment) -> str:
    assert env.spec
    return env.spec.id


def _zipped(path: Path, algorithm: str, normalizer: Path | None) -> Action:
    try:
        sb3: Any = importlib.import_module("stable_baselines3")
    except ImportError as error:
        raise mjenv.OptionError(
            f"{path} is a policy of Stable-Baselines3, which is missing: pip install stable-baselines3 ({error})"
        ) from None
    kind: Any = getattr(sb3, algorithm, None)
    if not hasattr(kind, "load"):
        raise mjenv.OptionError(
            f"stable_baselines3 has no algorithm {algorithm!r}; --algorithm takes PPO, SAC, TD3, ..."
        )
    try:
        model = kind.load(path, device="cpu")
    except (AssertionError, KeyError, RuntimeError, TypeError, ValueError) as error:
        raise mjenv.InvalidValueError(f"{path} is no policy of {algorithm}: {error}") from None
    if normalizer is None:
        if (beside := path.with_name(_NORMALIZER)).exists():
            print(f"mjenv: {beside} is not used; if {path.name} was trained with it, add --normalizer", file=sys.stderr)
        return lambda obs: model.predict(obs, deterministic=True)[0]
    normalize = _normalization(normalizer)
    return lambda obs: model.predict(normalize(obs), deterministic=True)[0]


def _normalization(path: Path) -> Callable[[NDArray[Any]], NDArray[Any]]:
    content = path.read_bytes()
    try:
        normalize: Callable[[NDArray[Any]], NDArray[Any]] = pickle.loads(content).normalize_obs
    except Exception as error:  # a file that holds something else can raise anything
        raise mjenv.InvalidValueError(f"{path} is no saved VecNormalize: {error}") from None
    return normalize

"""Environments inside of functions that JAX compiles, without Python between the steps (extras/jax/README.md)."""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Mapping
from functools import cache, cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import mjenv
from mjenv.capi.declarations import Role
from mjenv_jax.build import library

_CALLS = ("reset", "step", "begin", "advance", "finish")
_FUNCTIONS = ("seed", *_CALLS, "error_of")
_POINTER, _COUNT = ctypes.c_void_p, ctypes.c_int64


class _Environment(ctypes.Structure):
    _fields_ = (
        ("env", _POINTER),
        *((name, _COUNT) for name in ("rows", "obs_count", "info_count", "action_count")),
        *((name, _POINTER) for name in _FUNCTIONS),
        *((name, _COUNT) for name in ("arrays_count", "qpos_count", "qvel_count", "given_count")),
    )


@cache
def _loaded() -> ctypes.CDLL:
    """The handlers, which it makes known to XLA."""
    code = ctypes.CDLL(str(library()))
    for name in _CALLS:
        handler = getattr(code, f"mjenv_jax_{name}")
        jax.ffi.register_ffi_target(f"mjenv_jax_{name}", jax.ffi.pycapsule(handler), platform="cpu")
    code.mjenv_jax_add.restype, code.mjenv_jax_remove.restype = ctypes.c_int32, None
    return code


def _closed(code: ctypes.CDLL, number: int, envs: mjenv.VectorEnv) -> None:
    code.mjenv_jax_remove(number)
    envs.close()


class Step(NamedTuple):
    """The results of a step or reset of all rows."""

    obs: Any  # (rows, ...)
    reward: Any  # (rows,)
    terminated: Any  # (rows,) bool
    truncated: Any  # (rows,) bool
    was_reset: Any  # (rows,) bool: the row begins a new episode, which the step or the caller has begun
    info: dict[str, Any]


def make(id: str, rows: int, **options: Any) -> Env:
    """Makes an environment of so many rows. options: those of mjenv.make_vec."""
    return Env(mjenv.make_vec(id, rows, **options))


class Env:
    """Rows whose functions can be called in jax.jit, lax.scan and lax.while_loop.

    Each function takes the handle that the last call has returned, and returns the next one: so the steps keep their
    order. Observations and rewards have the dtype float64 if JAX has enabled it, otherwise float32.
    """

    def __init__(self, envs: mjenv.VectorEnv) -> None:
        rows = self._rows = envs.handle
        if type(rows).__module__ != "mjenv.capi.handle":
            raise mjenv.TaskError(f"{rows.id} is a NumPy task: its methods are Python, which a compiled program lacks")
        self.envs, self.rows = envs, rows.count
        fields = {role.name.lower(): rows.fields(role) for role in Role}
        self._info, self._arrays = ({f.name: f for f in fields[role]} for role in ("info", "arrays"))
        self._obs_shape = envs.single_observation_space.shape
        if self._obs_shape is None:
            raise mjenv.OptionError(f"{rows.id}: observations are a Dict: make it with observation='array'")
        counts = {
            "rows": rows.count,
            "obs_count": int(np.prod(self._obs_shape)),
            "info_count": sum(f.count for f in fields["info"]),
            "action_count": int(np.prod(envs.single_action_space.shape or ())),
            "arrays_count": sum(f.count for f in fields["arrays"]),
            "qpos_count": int(envs.data.qpos.shape[1]),
            "qvel_count": int(envs.data.qvel.shape[1]),
            "given_count": sum(f.count for f in fields["observation"]),
        }
        self._counts = counts
        functions = {name: ctypes.cast(rows.engine[f"mjenv_{name}"], _POINTER).value for name in _FUNCTIONS}
        code = _loaded()
        self.number = int(code.mjenv_jax_add(ctypes.byref(_Environment(env=rows.pointer, **counts, **functions))))
        self._close = weakref.finalize(self, _closed, code, self.number, envs)

    def close(self) -> None:
        """Waits for a call under way. Compiled programs that use this environment then fail."""
        self._close()

    # ---- what can be compiled ----

    def reset(self, seed: Any, after: Any = None) -> tuple[Any, Any]:
        """Begins new episodes in all rows. Returns a handle and the observations.

        seed: an integer, to which each row adds its index; or one for each row. after: the handle of the last call, if
        the same program has stepped before.
        """
        seeds = jnp.asarray(seed, jnp.uint32)
        seeds = seeds + jnp.arange(self.rows, dtype=jnp.uint32) if seeds.ndim == 0 else seeds
        handle = jnp.array([self.number, 0], jnp.int32) if after is None else after
        handle, obs = self._call("reset", [self._real(self._shape("obs"))], handle, seeds)
        return handle, obs

    def step(self, handle: Any, action: Any) -> tuple[Any, Step]:
        """Steps all rows. action: (rows, n)."""
        handle, *found = self._call("step", self._results(), handle, self._given("action", action))
        return handle, self._step(found)

    def begin(self, handle: Any, mask: Any, qpos: Any, qvel: Any) -> tuple[Any, dict[str, Any]]:
        """The first half of a reset of the rows of the mask, for Batch-v0. Returns the arrays of the option `arrays`,
        of which those of other rows are undefined."""
        given = jnp.asarray(mask, bool), self._given("qpos", qpos), self._given("qvel", qvel)
        handle, block = self._call("begin", [self._real((self.rows * self._counts["arrays_count"],))], handle, *given)
        return handle, self._parts(block, self._arrays)

    def advance(self, handle: Any, action: Any) -> tuple[Any, dict[str, Any], Any]:
        """The first half of a step, for Batch-v0. Returns the arrays and was_reset, the rows to begin before finish."""
        types = [self._real((self.rows * self._counts["arrays_count"],)), self._flags]
        handle, block, was_reset = self._call("advance", types, handle, self._given("action", action))
        return handle, self._parts(block, self._arrays), was_reset

    def finish(self, handle: Any, obs: Any, reward: Any = None, terminated: Any = None) -> tuple[Any, Step]:
        """The second half, with what the program has computed of the arrays. obs: (rows, n) of the task's own."""
        reward = jnp.zeros(self.rows) if reward is None else reward
        terminated = jnp.zeros(self.rows, bool) if terminated is None else terminated
        given = self._given("given", obs), jnp.asarray(reward, float), jnp.asarray(terminated, bool)
        handle, *found = self._call("finish", self._results(), handle, *given)
        return handle, self._step(found)

    # ---- shapes ----

    def _call(self, name: str, types: list[Any], handle: Any, *given: Any) -> Any:
        turn = jax.ShapeDtypeStruct((2,), jnp.int32)
        return jax.ffi.ffi_call(f"mjenv_jax_{name}", (turn, *types), has_side_effect=True)(handle, *given)

    def _shape(self, name: str) -> tuple[int, ...]:
        return (self.rows, *self._obs_shape) if name == "obs" else (self.rows, self._counts[f"{name}_count"])

    def _given(self, name: str, values: Any) -> Any:
        array = jnp.asarray(values)
        array = array if array.dtype in (jnp.float32, jnp.float64) else array.astype(float)
        if array.shape != self._shape(name):
            raise mjenv.InvalidValueError(f"{name} has the shape {array.shape}, not {self._shape(name)}")
        return array

    def _real(self, shape: tuple[int, ...]) -> Any:
        return jax.ShapeDtypeStruct(shape, jax.dtypes.canonicalize_dtype(float))

    @cached_property
    def _flags(self) -> Any:
        return jax.ShapeDtypeStruct((self.rows,), jnp.bool_)

    def _results(self) -> list[Any]:
        info = self._real((self.rows * self._counts["info_count"],))
        return [self._real(self._shape("obs")), self._real((self.rows,)), *[self._flags] * 3, info]

    def _step(self, found: list[Any]) -> Step:
        obs, reward, terminated, truncated, was_reset, info = found
        return Step(obs, reward, terminated, truncated, was_reset, self._parts(info, self._info))

    def _parts(self, block: Any, fields: Mapping[str, Any]) -> dict[str, Any]:
        """The arrays of a block that the library lays out field by field."""
        return {
            name: block[f.offset * self.rows : (f.offset + f.count) * self.rows].reshape(self.rows, *f.shape)
            for name, f in fields.items()
        }

"""Observations that are pictures of any id, for agents that learn from pixels."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

import mjenv
from mjenv import AutoresetMode
from mjenv.gym.vector import Results
from mjenv.rows.arguments import autoreset_mode_of, reset_mask_of
from mjenv.rows.step import Info

Frames = NDArray[np.uint8]
_COLOURS = 3


class PixelVectorEnv(mjenv.VectorEnv):
    """A VectorEnv whose observations are the last frame_stack pictures of each row, the oldest first.

    They are uint8[num_envs, frame_stack * 3, height, width]. After a reset, all pictures of a row are the first one.

    A step repeats the action of each row action_repeat times, or until the row's episode ends, and adds up the rewards.
    infos["state"] has what a VectorEnv of the same id observes. send, recv, rollout and resets of single rows are those
    of VectorEnv and return no pictures. After them, and after restore or copy_row, call observe(): it replaces the
    rows' pictures by those of their present states.
    """

    def __init__(
        self,
        id: str,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        *,
        pixels: tuple[int, int],
        camera: int | str | None = None,
        action_repeat: int = 1,
        frame_stack: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        """pixels: height and width. camera: the index or name of a camera of the model; None: that of "rgb_array"."""
        height, width = (operator.index(side) for side in pixels)
        self._repeat = _at_least_one("action_repeat", action_repeat)
        stack = _at_least_one("frame_stack", frame_stack)
        mode = autoreset_mode_of(autoreset_mode)
        named: dict[str, Any] = {"camera_name" if isinstance(camera, str) else "camera_id": camera}
        # This class resets the rows, because an episode may end before all repetitions of an action.
        super().__init__(
            mjenv.spec(id).id,
            num_envs,
            max_episode_steps,
            autoreset_mode=AutoresetMode.DISABLED,
            render_mode="rgb_array",
            height=height,
            width=width,
            **named,
            **options,
        )
        self.autoreset_mode = mode
        self.metadata = {**self.metadata, "autoreset_mode": mode}
        shape = (stack * _COLOURS, height, width)
        self.single_observation_space = Box(0, 255, shape, np.uint8)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._frames: Frames = np.zeros((self.num_envs, *shape), np.uint8)
        self._ended: NDArray[np.bool_] = np.zeros(self.num_envs, np.bool_)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Frames, Info]:
        """Begins episodes, as VectorEnv.reset does. Returns the pictures and the infos."""
        mask = reset_mask_of(options, self.num_envs)
        state, infos = super().reset(seed=seed, options=options)
        rows = np.arange(self.num_envs) if mask is None else np.flatnonzero(mask)
        self._ended[rows] = False
        self._fill(rows)
        return self._pictures(), {**infos, "state": state}

    def step(self, actions: ArrayLike) -> Results:
        """Takes a step in every row. Returns the pictures, the sums of rewards, terminations, truncations and infos."""
        chosen, count = np.asarray(actions), self.num_envs
        if chosen.shape != self.action_space.shape:
            raise mjenv.InvalidValueError(f"the actions have the shape {chosen.shape}, not {self.action_space.shape}")
        is_late = self.autoreset_mode == AutoresetMode.NEXT_STEP
        resets: NDArray[np.bool_] = self._ended if is_late else np.zeros(count, np.bool_)
        active = ~resets
        rewards = np.zeros(count)
        ended = np.zeros((2, count), np.bool_)  # terminated, truncated
        for _ in range(self._repeat):
            rows = np.flatnonzero(active)
            if not len(rows):
                break
            self.send(chosen[rows], rows)
            _, _, reward, *flags, _ = self.recv()
            rewards[rows] += reward
            ended[:, rows] = flags
            active[rows] = ~ended[:, rows].any(axis=0)
        for row in np.flatnonzero(~resets):
            self._push(int(row))
        self._ended = np.logical_or(*ended)
        infos: Info = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            resets = self._ended
            if resets.any():
                infos |= {"final_obs": self._final(resets), "_final_obs": resets}
        if resets.any():
            super().reset(options={"reset_mask": resets})
            self._fill(np.flatnonzero(resets))
        infos["state"] = super().observe()
        return self._pictures(), rewards, ended[0], ended[1], infos

    def observe(self) -> Frames:
        """The pictures of the rows' present states. They replace the pictures that the rows remembered."""
        self._fill(np.arange(self.num_envs))
        return self._pictures()

    def _push(self, row: int) -> None:
        """Appends the row's present picture, and drops the oldest."""
        self._frames[row, :-_COLOURS] = self._frames[row, _COLOURS:]
        picture: Any = self.envs[row].render()
        self._frames[row, -_COLOURS:] = picture.transpose(2, 0, 1)

    def _fill(self, rows: NDArray[np.int64]) -> None:
        """Replaces all pictures of the rows by the present one."""
        stack = self._frames.shape[1] // _COLOURS
        for row in rows:
            self._push(int(row))
            self._frames[row] = np.tile(self._frames[row, -_COLOURS:], (stack, 1, 1))

    def _final(self, ended: NDArray[np.bool_]) -> NDArray[Any]:
        """The pictures of rows that are about to be reset; None for the others."""
        final = np.full(self.num_envs, None, dtype=object)
        for row in np.flatnonzero(ended):
            final[row] = self._frames[row].copy()
        return final

    def _pictures(self) -> Frames:
        return self._frames.copy() if self.copy else self._frames


def _at_least_one(name: str, value: int) -> int:
    count = operator.index(value)
    if count < 1:
        raise mjenv.InvalidValueError(f"{name} is {count}, but must be at least 1")
    return count

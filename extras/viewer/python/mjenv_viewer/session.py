"""An environment that the viewer itself steps, in real time, slower, faster or step by step."""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mjenv
from mjenv_viewer.picture import Picture
from mjenv_viewer.poses import Pose
from mjenv_viewer.server import Server
from mjenv_viewer.smooth import between

Array = NDArray[Any]
Policy = Callable[[Array], Any]  # the actions of all rows for their observations

HISTORY = 1000  # the user can go back by so many steps
PICTURES = 60  # a second at most
_SHARE = 0.25  # the greatest part of the time that pictures may take
_STEPPING = 1 / 30  # seconds at most from picture to picture
_LATE = 0.25  # seconds; a greater delay is not caught up
_UNWATCHED = 1.0  # seconds from picture to picture while no browser shows the page


@dataclass(frozen=True)
class Moment:
    """The data with which the session can go back to a moment."""

    image: bytes
    steps: int
    total: float
    ended: bool


class Session:
    """Owns an environment and the page that shows it, to which Page of controls.py adds the panel.

    One thread calls run, or start makes one. All other threads, those of the page among them, use do and ask.
    """

    def __init__(
        self,
        id: str,
        rows: int = 1,
        options: dict[str, Any] | None = None,
        *,
        policy: Policy | None = None,
        seed: int = 0,
        port: int | None = None,
        host: str = "127.0.0.1",
    ) -> None:
        self.id, self.count, self.options, self.policy, self.seed = id, rows, dict(options or {}), policy, seed
        self.envs = self._made(self.options)
        self.playing = True
        self.speed = 1.0
        self.source = "policy" if policy else "zero"
        self.sliders: Array = np.zeros(self.envs.single_action_space.shape)
        self.random = np.random.default_rng(seed)
        self.saved: dict[str, Moment] = {}
        self.on_step: list[Callable[[], None]] = []
        self.on_change: Callable[[], None] = lambda: None
        self.on_back: Callable[[int], None] = lambda steps: None
        self.on_tick: Callable[[], None] = lambda: None
        self._commands: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._closing = False
        self._thread: threading.Thread | None = None
        self._following: Array = np.zeros(0)
        try:
            self.server = Server(port, host, label=f"mjenv: {id}")
        except BaseException:
            self.envs.close()
            raise
        try:
            self._begin()
        except BaseException:
            self.close()
            raise

    @property
    def address(self) -> str:
        return self.server.address

    def _made(self, options: dict[str, Any]) -> mjenv.VectorEnv:
        return mjenv.make_vec(self.id, self.count, **options)

    def _begin(self) -> None:
        """Resets the environment and draws it."""
        self.obs, _ = self.envs.reset(seed=self.seed)
        self.picture = Picture(self.server, self.envs, self.count, self.do)
        self._start()

    def _start(self) -> None:
        """Clears the sums over episodes, because all rows have begun new ones."""
        self.steps = np.zeros(self.count, int)
        self.totals = np.zeros(self.count)
        self.rewards = np.zeros(self.count)
        self.ended = np.zeros(self.count, bool)
        self.infos: dict[str, Any] = {}
        self.history: deque[Moment] = deque(maxlen=HISTORY)
        self._last: list[Pose] | None = None
        self._now: list[Pose] | None = None
        self._stale, self._read_at = True, 0.0

    # ---- for other threads ----

    def do(self, function: Callable[[], None]) -> None:
        """Runs a function on the thread that steps, and returns at once."""
        self._commands.put(function)

    def ask(self, function: Callable[[], Any], timeout: float = 300.0) -> Any:
        """Runs a function on the thread that steps, waits for it, and returns what it returns."""
        done = threading.Event()
        found: list[Any] = []

        def run() -> None:
            try:
                found.append((function(), None))
            except BaseException as error:
                found.append((None, error))
            finally:
                done.set()

        self.do(run)
        if not done.wait(timeout):
            raise TimeoutError("the viewer did not answer")
        result, error = found[0]
        if error is not None:
            raise error
        return result

    def start(self) -> None:
        """Runs in a thread of its own."""
        self._thread = threading.Thread(target=self.run, name="mjenv view", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Ends the thread, the page and the environment. Closing twice is fine."""
        self._closing = True
        self.do(lambda: None)
        if self._thread and self._thread is not threading.current_thread():
            self._thread.join()
        self.server.close()
        self.envs.close()

    def __enter__(self) -> Session:
        self.start()
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    # ---- the loop ----

    def run(self) -> None:
        """Steps and draws until close is called."""
        due = picture = time.monotonic()
        while not self._closing:
            now = time.monotonic()
            interval = self.envs.dt / self.speed
            if self.playing:
                due = max(due, now - _LATE)
                # If steps take longer than the time that they simulate, the simulation slows down.
                end = now + _STEPPING
                while self.playing and due <= now < end and not self._closing:
                    self.step()
                    due += interval
                    now = time.monotonic()
            else:
                due = now
            if picture <= now:
                begun = time.monotonic()
                with self.server.reporting():
                    self._draw(begun, interval)
                    self.on_tick()
                now = time.monotonic()
                least = 1 / PICTURES if self.server.is_watched else _UNWATCHED
                picture = now + max(least - (now - begun), (now - begun) * (1 / _SHARE - 1))
            self._wait(min(picture, due) if self.playing else picture)

    def _wait(self, until: float) -> None:
        """Runs commands, and waits for more of them until a time."""
        while not self._closing:
            left = until - time.monotonic()
            try:
                command = self._commands.get(timeout=left) if left > 0 else self._commands.get_nowait()
            except queue.Empty:
                return
            with self.server.reporting():
                command()

    def _draw(self, now: float, interval: float) -> None:
        """Draws the rows; if steps are long, at poses between those of the last two steps."""
        if self._stale:
            self._last, self._now = self._now, self.picture.read()
            self._read_at, self._stale = now, False
        assert self._now is not None
        place = (now - self._read_at) / interval if self.playing and interval > 2 / PICTURES else 1.0
        if self._last is None or place >= 1:
            self.picture.show(self._now)
        else:
            self.picture.show([between(a, b, place) for a, b in zip(self._last, self._now, strict=True)])

    def changed(self) -> None:
        """Called when the state has changed other than by a step."""
        self.picture_anew()
        self.obs = self.envs.observe()

    def picture_anew(self) -> None:
        """Makes the next picture read everything again."""
        self._now, self._stale = None, True

    @property
    def flat_obs(self) -> Array:
        """The observations (rows, n), also if they are dicts."""
        return self.envs.outputs.obs

    # ---- what a user can do ----

    def step(self) -> None:
        """Takes a step in every row. An error pauses the session, and the page shows it."""
        with self.server.reporting():
            try:
                self._step()
            except Exception:
                self.playing = False
                raise

    def _step(self) -> None:
        moment = self._moment()
        self.picture.pull.apply(self.picture.rows, self.envs.dt)
        self.obs, self.rewards, terminated, truncated, self.infos = self.envs.step(self.actions())
        self.history.append(moment)
        begun = self.ended  # these rows were reset instead
        self.steps = np.where(begun, 0, self.steps + 1)
        self.totals = np.where(begun, 0.0, self.totals + self.rewards)
        self.ended = terminated | truncated
        if begun[: len(self.picture.rows)].any():
            self._now = None  # no poses between the end of an episode and the beginning of the next
        self._stale = True
        for function in self.on_step:
            function()

    def actions(self) -> Array:
        """The actions of all rows. The sliders' values are added to the policy's action in the row that is followed."""
        shape = (self.count, *self.sliders.shape)
        space = self.envs.single_action_space
        if self.source == "policy" and self.policy:
            found = np.array(self.policy(self.obs), space.dtype).reshape(shape)
        elif self.source == "random":
            low, high = np.nan_to_num(space.low, neginf=-1), np.nan_to_num(space.high, posinf=1)
            found = self.random.uniform(low, high, shape).astype(space.dtype)
        else:
            found = np.clip(np.zeros(shape), space.low, space.high).astype(space.dtype)
        if self.sliders.any():
            row = self.picture.follow
            found[row] = np.clip(found[row] + self.sliders, space.low, space.high)
        return found

    def _moment(self) -> Moment:
        """The row that is followed, as it is now."""
        row = self.picture.follow
        return Moment(self.envs.snapshot(row), int(self.steps[row]), float(self.totals[row]), bool(self.ended[row]))

    def _return_to(self, moment: Moment) -> None:
        row = self.picture.follow
        self.envs.restore(moment.image, row)
        self.steps[row], self.totals[row], self.ended[row] = moment.steps, moment.total, moment.ended
        self.changed()

    def back(self, steps: int = 1) -> None:
        """Goes back by up to so many steps in the row that is followed, as far as its history reaches."""
        steps = min(steps, len(self.history))
        if not steps:
            return
        for _ in range(steps):
            moment = self.history.pop()
        self._return_to(moment)
        self.on_back(steps)

    def reset(self, seed: int | None = None) -> None:
        """Begins episodes in all rows: row i with seed + i."""
        self.seed = self.seed if seed is None else seed
        self.picture.pull.release()
        self.obs, _ = self.envs.reset(seed=self.seed)
        self._start()
        self.on_change()

    def choose_row(self, row: int) -> None:
        """Follows another row, whose history begins now."""
        if row != self.picture.follow:
            self.picture.choose(row)
            self.history.clear()
            self.picture_anew()
            self.on_change()

    def save(self) -> str:
        """Saves the row that is followed, and returns the name under which it can be restored."""
        row = self.picture.follow
        name = f"{len(self.saved) + 1}: row {row}, step {int(self.steps[row])}"
        self.saved[name] = self._moment()
        return name

    def restore(self, name: str) -> None:
        """Returns to a saved state in the row that is followed, whose history begins now."""
        self._return_to(self.saved[name])
        self.history.clear()
        self.on_change()

    def rebuild(self, options: dict[str, Any]) -> None:
        """Builds a new environment with other options. If this fails, the old one stays."""
        envs = self._made(options)
        old, settings = self.envs, self.picture
        self.envs = envs
        try:
            stage = self.picture.stage
            stage.remove()
            self._begin()
        except BaseException:
            envs.close()
            self.envs = old
            self.picture = Picture(self.server, old, self.count, self.do)
            self._start()
            raise
        self.picture.take_settings(settings)
        self.options = dict(options)
        self.saved.clear()  # snapshots belong to the options that they were taken with
        old.close()
        self.on_change()

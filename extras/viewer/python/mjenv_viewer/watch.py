"""Shows an environment while a program, a training for example, steps it."""

from __future__ import annotations

import contextlib
import functools
import queue
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from mjenv.errors import Error, OptionError
from mjenv_viewer.picture import Picture, rows_of
from mjenv_viewer.server import Server

PICTURES = 60  # a second at most
# After a call of these methods, the rows are drawn if it is time. The last one is Stable-Baselines3's.
_SHOWN = ("step", "reset", "recv", "rollout", "restore", "step_wait")
_STEPS = ("step", "send", "rollout", "step_wait")  # before these, writes forces, and waits while paused
_LOOK = 0.1  # seconds between two checks whether a browser shows the page


class View:
    """Shows an environment until it is closed: ``with mjenv.view(envs):``. See mjenv.view.

    The program's own thread reads the poses between two steps, for at most `share` of its time, and does nothing else
    for the viewer. While no browser shows the page, it reads nothing.
    """

    def __init__(
        self,
        env: Any,
        *,
        rows: int = 16,
        port: int | None = None,
        host: str = "127.0.0.1",
        share: float = 0.02,
        quiet: bool = False,
    ) -> None:
        if not 0 < share <= 1:
            raise OptionError(f"share is {share!r}; it is a part of the time, above 0 and at most 1")
        self._env = getattr(env, "unwrapped", env)
        shown = rows_of(self._env)
        if not shown or not hasattr(shown[0], "model"):
            raise OptionError(f"the viewer shows environments of mjenv, not {env!r}")
        if isinstance(self._env, _Viewed):
            raise OptionError("this environment is shown already: close its other viewer first")
        self.paused = self.real_time = False
        self.steps = 0
        self.on_draw: Callable[[], None] = lambda: None
        self._share, self._single = share, 0
        self._commands: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._due = self._looked = self._stepped = 0.0
        self._closed = self._watched = False
        self._clock = _Clock()
        owner = self._env if hasattr(self._env, "spec") else self._env.envs  # Stable-Baselines3's have no spec
        self.id: str = owner.spec.id
        self.server = Server(port, host, label=f"mjenv: {self.id}")
        try:
            self._clock.measure_new_threads()
            self.picture = Picture(self.server, self._env, rows, self.do)
            self.picture.show(self.picture.read())
        except BaseException:
            self.server.close()
            raise
        self._dt = float(shown[0].dt)
        # Only this environment's methods are replaced: its class becomes one that is derived from its own.
        self._kind = type(self._env)
        self._env.__class__ = _viewed(self._kind, self)
        if not quiet:
            print(f"mjenv view: {self.address}", file=sys.stderr)

    @property
    def address(self) -> str:
        return self.server.address

    @property
    def rows(self) -> tuple[Any, ...]:
        """All rows, also those that are not drawn."""
        return rows_of(self._env)

    def do(self, function: Callable[[], None]) -> None:
        """Runs a function on the program's thread, between two steps."""
        self._commands.put(function)

    def go_one_step(self) -> None:
        self.paused, self._single = True, 1

    def close(self) -> None:
        """Closes the page and restores the environment's class. Closing twice is fine."""
        if self._closed:
            return
        self._closed, self.paused = True, False
        if isinstance(self._env, _Viewed):
            self._env.__class__ = self._kind
        self.picture.pull.release()
        with contextlib.suppress(Error):  # the environment may be closed
            self.picture.pull.apply(self.picture.rows, self._dt)
        self.server.close()

    def __enter__(self) -> View:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _repr_html_(self) -> str:
        from mjenv_viewer.notebook import frame

        return frame(self.address)

    # ---- called by the environment's methods ----

    def before(self) -> None:
        """Before a step."""
        self._run_commands()
        while self.paused and not self._closed and not self._single:
            self._draw(force=True)
            with contextlib.suppress(queue.Empty):
                self._run(self._commands.get(timeout=1 / 30))
        self._single = 0
        if self._closed:
            return
        self.steps += 1
        if self.real_time:
            time.sleep(max(0.0, min(self._stepped + self._dt - time.monotonic(), self._dt)))
        self._stepped = time.monotonic()
        with self.server.reporting(), contextlib.suppress(Error):
            self.picture.pull.apply(self.picture.rows, self._dt)

    def after(self) -> None:
        """After a step or a reset."""
        if not self._commands.empty():
            self._run_commands()
        if not self._closed and time.monotonic() >= self._due:
            self._draw()

    def _run_commands(self) -> None:
        while not self._closed:
            try:
                command = self._commands.get_nowait()
            except queue.Empty:
                return
            self._run(command)

    def _run(self, command: Callable[[], None]) -> None:
        with self.server.reporting():
            command()

    def _draw(self, force: bool = False) -> None:
        now = time.monotonic()
        if now - self._looked >= _LOOK:
            self._looked, self._watched = now, self.server.is_watched
        if not self._watched:
            self._due = now + _LOOK
            return
        self._clock.start()
        with self.server.reporting():
            with contextlib.suppress(Error):  # of rows that are between send and recv, for example
                self.picture.show(self.picture.read())
            self.on_draw()
        spent = self._clock.stop()
        self._due = now + max(1 / PICTURES, 0.0 if force else spent / self._share)


class _Viewed:
    """Marks environments that are shown."""

    _view: View


def _viewed(kind: type[Any], view: View) -> type[Any]:
    """A class like `kind` whose methods tell the viewer. Copies and pickles of its objects are of `kind`."""

    def wrapped(name: str) -> Callable[..., Any]:
        method = getattr(kind, name)
        waits, shows = name in _STEPS, name in _SHOWN

        @functools.wraps(method)  # Gymnasium looks at the arguments
        def call(self: Any, *arguments: Any, **keywords: Any) -> Any:
            if waits:
                view.before()
            results = method(self, *arguments, **keywords)
            if shows:
                view.after()
            return results

        return call

    def reduce(self: Any, protocol: Any) -> Any:
        found: Any = kind.__reduce_ex__(self, max(protocol, 2))  # type: ignore[call-arg]
        _, (_, *arguments), *rest = found  # copyreg.__newobj__ and its arguments
        return (_new, (kind, *arguments), *rest)

    names = {name for name in (*_SHOWN, *_STEPS) if hasattr(kind, name)}
    if "step_wait" in names:  # which step calls
        names.remove("step")
    methods = {name: wrapped(name) for name in names}
    return type(kind.__name__, (kind, _Viewed), {**methods, "__reduce_ex__": reduce, "__module__": kind.__module__})


def _new(kind: type[Any], *arguments: Any) -> Any:
    return kind.__new__(kind, *arguments)


class _Clock:
    """The time that the viewer takes from the program: for drawing on its thread, and the CPU time of viser's threads.

    Python runs one thread at a time, so viser's threads take their CPU time from the program, too. It is converted to
    wall time, because on a busy machine a second of CPU time takes more than a second.
    """

    def __init__(self) -> None:
        self._before = set(threading.enumerate())
        self._clocks: list[int] = []
        self._others = self._begun = self._begun_cpu = 0.0
        self._seconds = self._cpu = 0.0  # of the last pictures

    def measure_new_threads(self) -> None:
        """Counts the threads that have been started since this object was made."""
        if hasattr(time, "pthread_getcpuclockid"):
            found = [thread.ident for thread in threading.enumerate() if thread not in self._before]
            self._clocks = [time.pthread_getcpuclockid(ident) for ident in found if ident is not None]

    def start(self) -> None:
        self._begun, self._begun_cpu = time.perf_counter(), time.thread_time()

    def stop(self) -> float:
        """The seconds since start, and those of the other threads since the last stop."""
        seconds, cpu = time.perf_counter() - self._begun, time.thread_time() - self._begun_cpu
        self._seconds, self._cpu = 0.9 * self._seconds + seconds, 0.9 * self._cpu + cpu
        others = 0.0
        with contextlib.suppress(OSError):  # a thread has ended
            others = sum(time.clock_gettime(clock) for clock in self._clocks)
        taken, self._others = max(others - self._others, 0.0), others
        return seconds + taken * max(self._seconds / max(self._cpu, 1e-9), 1.0)

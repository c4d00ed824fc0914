"""The engines: libmjenv.so is built on MuJoCo 2.2.2, and libmjenv-mujoco4.so on MuJoCo 4.0.

An engine's name is its version of MuJoCo. A process can use several engines at once. The environment variable
MJENV_LIBRARY names the file of one of them; the others are beside that file or inside the package.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib.util
import os
import sys
from collections.abc import Callable
from ctypes import byref, c_void_p
from itertools import filterfalse
from pathlib import Path

from mjenv import errors
from mjenv.capi import declarations
from mjenv.capi.declarations import Status
from mjenv.capi.owned import Owned
from mjenv.capi.turns import Lock

# The library of each engine, the default engine first. Windows has only one engine.
_ELSEWHERE = {"win32": {"2.2.2": "mjenv.dll"}}
FILES = _ELSEWHERE.get(sys.platform, {"2.2.2": "libmjenv.so", "4.0": "libmjenv-mujoco4.so"})
# The names of MuJoCo's library, for engines that open it when they are used.
_MUJOCO = {"4.0": ("libmujoco.so.4.0.1", "libmujoco.so.4.0.0")}
_VARIABLE = "MJENV_MUJOCO"  # the environment variable with the path of that library


def name_of(mujoco: str) -> str:
    """The name of the engine for a version of MuJoCo, "4.0" for "4.0.1"; the version itself if no engine has it."""
    return next((name for name in FILES if f"{mujoco}.".startswith(f"{name}.")), mujoco)


class Engine(declarations.Library):
    """A loaded library: its functions, and its errors."""

    def __init__(self, path: str) -> None:
        try:
            super().__init__(path)
        except OSError as error:
            raise errors.EngineError(f"cannot load {path}: {error}") from error
        except AttributeError as error:
            raise errors.EngineError(f"{path} is not the library of this package: {error}") from error
        number = self.mjenv_abi_version()
        if number != declarations.ABI_VERSION:
            raise errors.EngineError(f"{path} has ABI version {number}; this package needs {declarations.ABI_VERSION}")
        self.path: str = path
        mujoco, *details = self.version().partition("MuJoCo ")[2].rstrip(")").split(", ")
        self.name: str = name_of(mujoco)
        # As in CMake's MJENV_MATH and MJENV_ARCH.
        self.math: str = "portable" if "portable math" in details else "system"
        self.arch: str = next((detail for detail in details if detail != "portable math"), "")
        self.registrations: list[Callable[[Engine], None]] = []  # those of Engines.register that succeeded

    def version(self) -> str:
        """The library's version and that of its MuJoCo."""
        return str(self.mjenv_version().decode())

    def check(self, status: int, *, names_id: bool = False) -> None:
        """Raises an exception unless the status is MJENV_OK. names_id: MJENV_E_NAME means that there is no such id."""
        if status:
            raise self.last_error(status, names_id=names_id)

    def last_error(self, status: int, *, names_id: bool = False) -> errors.Error:
        """The exception for the call that has just failed."""
        message = self.mjenv_last_error().decode("utf-8", "replace")
        return errors.error_of(status, message, names_id=names_id)

    def open_mujoco(self, installed: Path | None) -> None:
        """Opens MuJoCo's library: `installed`, or if it is None the one that the engine finds.

        Raises EngineError if that fails. The engine opens it, and not ctypes, because the engine refuses a truncated
        file, which would crash the process.
        """
        if installed is None:
            return self._check_mujoco()
        os.environ[_VARIABLE] = str(installed)
        try:
            self._check_mujoco()
        except errors.EngineError as error:
            reason, found, _ = error.message.partition(f"{_VARIABLE}: ")[2].partition("; install MuJoCo")
            if not found:
                raise
            raise errors.EngineError(
                f"cannot load {installed}: {reason}; install it again (pip install --force-reinstall mujoco-core), or "
                f"set {_VARIABLE} to the path of another libmujoco.so.4.0.x"
            ) from None
        finally:
            del os.environ[_VARIABLE]

    def _check_mujoco(self) -> None:
        """Builds a model: the first one opens MuJoCo's library."""
        options, env = c_void_p(), c_void_p()
        owned = Owned(self.mjenv_options_destroy, options), Owned(self.mjenv_destroy, env)
        self.check(self.mjenv_options_create(b"InvertedPendulum-v5", byref(options)))
        status = self.mjenv_create(options, 1, byref(env))
        if status:
            raise errors.EngineError(f"engine {self.name}: {self.last_error(status)}", status)
        del owned


class Engines:
    """The engines of this process. An engine is loaded when `get` first returns it, and never unloaded."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._ready: dict[str, Engine] = {}
        self._opened: dict[str, Engine] = {}  # also those without MuJoCo's library or a registration
        self._registrations: list[Callable[[Engine], None]] = []
        self._folders = [Path(__file__).parents[1]]
        self.default = next(iter(FILES))
        file = os.environ.get("MJENV_LIBRARY")
        if file:
            given = Engine(file)
            self._opened[given.name] = given
            if os.path.dirname(file):
                self._folders.insert(0, Path(file).absolute().parent)
            self.default = given.name
        self.default = os.environ.get("MJENV_ENGINE") or self.default

    def get(self, name: str | None = None) -> Engine:
        """The engine with this name; None: the default engine. Raises EngineError if it cannot be used."""
        if name is None:
            name = self.default
        if not isinstance(name, str):
            raise errors.OptionError(
                f"engine is a str, {next(reversed(FILES))!r} for example, not {name!r}", Status.E_TYPE
            )
        engine = self._ready.get(name)
        return engine or self._load(name)

    def names(self) -> tuple[str, ...]:
        """The names of all engines, also of those that cannot be used."""
        return tuple(dict.fromkeys((*FILES, *self._opened)))

    def register(self, registration: Callable[[Engine], None]) -> None:
        """Calls a function for every engine: now, or when the engine is loaded.

        If the function fails now, it is not called again. After an interrupt the next `get` goes on, and may call the
        function again for an engine for which it has succeeded.
        """
        turn = self._lock.take()
        try:
            names = [*self._ready]
            self._ready.clear()
            self._registrations.append(registration)
            try:
                for name in names:
                    self._load(name)
            except errors.Error:
                self._forget(registration)
                raise
        finally:
            del turn

    def _load(self, name: str) -> Engine:
        turn = self._lock.take()
        try:
            if name not in self._opened:
                self._opened[name] = self._open(name)
            engine = self._opened[name]
            if name not in self._ready:
                if name in _MUJOCO:
                    engine.open_mujoco(_installed_mujoco(_MUJOCO[name]))
                # filterfalse runs in C; a comprehension would run Python code for each old registration.
                for registration in tuple(filterfalse(engine.registrations.__contains__, self._registrations)):
                    self._register(registration, engine)
                self._ready[name] = engine
            return engine
        finally:
            del turn

    def _register(self, registration: Callable[[Engine], None], engine: Engine) -> None:
        try:
            registration(engine)
        except errors.Error:
            # An interrupt has hidden the error from the caller of `register`.
            if not any(registration in other.registrations for other in self._opened.values()):
                self._forget(registration)
            raise
        engine.registrations.append(registration)

    def _forget(self, registration: Callable[[Engine], None]) -> None:
        self._registrations = [one for one in self._registrations if one is not registration]

    def _open(self, name: str) -> Engine:
        if name not in FILES:
            raise errors.EngineError(f"there is no engine {name!r}; there are {', '.join(self.names())}", Status.E_NAME)
        files = [folder / FILES[name] for folder in self._folders]
        file = next((file for file in files if file.exists()), None)
        if file is None:
            needs = " with MuJoCo's headers (pip install mjenv[mujoco4])" if name in _MUJOCO else ""
            raise errors.EngineError(
                f"this installation has no engine {name}, which is {files[-1]}. Install a wheel of mjenv, or build the "
                f"package from source{needs}, or set the environment variable MJENV_LIBRARY to the path of a built "
                f"{FILES[name]}."
            )
        engine = Engine(str(file))
        if engine.name != name:
            raise errors.EngineError(f"{file} is engine {engine.name}, not {name}")
        return engine


def _installed_mujoco(names: tuple[str, ...]) -> Path | None:
    """The path of MuJoCo's library in the installed package.

    None if MJENV_MUJOCO names a library, if the process has loaded one, or if no package is installed: the engine then
    finds the library itself, or its error says what to install.
    """
    if os.environ.get(_VARIABLE):
        return None
    for name in names:
        with contextlib.suppress(OSError):
            ctypes.CDLL(name, os.RTLD_NOW | os.RTLD_NOLOAD)
            return None
    try:
        package = importlib.util.find_spec("mujoco")
    except ValueError:  # another module has this name, and no spec
        package = None
    folders = (package.submodule_search_locations or ()) if package else ()
    return next((file for folder in folders for name in names if (file := Path(folder, name)).exists()), None)


ENGINES = Engines()

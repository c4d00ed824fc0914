"""viser's server, which prints nothing, serves this machine alone by default, and leaves no threads when it stops."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import socket
import sys
import time
import webbrowser
from collections.abc import Iterator
from typing import Any

from mjenv.errors import InvalidValueError, OptionError
from mjenv_viewer.gate import Gate

FIRST_PORT = 8080


def viser_module() -> Any:
    """The package viser. Raises OptionError that says what to install."""
    try:
        return importlib.import_module("viser")
    except ImportError as error:
        raise OptionError(f'the viewer needs pip install "mjenv[view]" ({error})') from None


class Server:
    """A page at an address."""

    def __init__(self, port: int | None = None, host: str = "127.0.0.1", label: str | None = None) -> None:
        """port: None for the first free one from 8080 on. Raises InvalidValueError if the port is in use."""
        viser = viser_module()
        _check(host, port or 0)
        gate = Gate(host)
        with _silent(), gate.guarding():
            self.viser: Any = viser.ViserServer(
                host=host, port=FIRST_PORT if port is None else port, label=label, verbose=False
            )
        if not gate.is_shut:
            self.close()
            raise OptionError('the viewer cannot guard a page of this version of viser: pip install "mjenv[view]"')
        gate.inputs = self.viser.gui._gui_input_handle_from_uuid
        self._reported: tuple[str, float] = "", 0.0
        found = self.viser.get_port()
        if port not in (None, 0, found):  # another program has taken it in the meantime
            self.close()
            raise InvalidValueError(f"port {port} of {host} is in use: choose another, or none")
        self.viser.gui.main_panel.dock_right()  # beside the picture, where the panel hides nothing
        name = "localhost" if host in ("127.0.0.1", "0.0.0.0", "::") else f"[{host}]" if ":" in host else host
        self.address = f"http://{name}:{found}/{gate.token}"
        self.port: int = found

    def close(self) -> None:
        """Closes the port and ends the threads. Closing twice is fine."""
        with _silent():
            self.viser.stop()

    def report(self, text: str) -> None:
        """Shows a message on every page, once a second at most if it stays the same."""
        now = time.monotonic()
        if self._reported[0] == text and now - self._reported[1] < 1:
            return
        self._reported = text, now
        for client in self.viser.get_clients().values():
            client.add_notification("mjenv", text, color="red", auto_close_seconds=20)

    @contextlib.contextmanager
    def reporting(self) -> Iterator[None]:
        """Shows errors on every page instead of raising them."""
        try:
            yield
        except Exception as error:
            self.report(f"{type(error).__name__}: {error}")

    @property
    def is_watched(self) -> bool:
        """Whether a browser shows the page."""
        return bool(self.viser.get_clients())


def _check(host: str, port: int) -> None:
    """Raises InvalidValueError if the server cannot listen at the address, because viser would wait forever."""
    if not 0 <= port < 2**16:
        raise InvalidValueError(f"there is no port {port}; ports are 0 to 65535")
    try:
        (family, kind, _, _, address), *_ = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        with socket.socket(family, kind) as tried:
            if os.name == "posix":
                tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind(address)
            tried.listen()
    except OSError as error:
        raise InvalidValueError(f"port {port} of {host} cannot be used: {error}: choose another, or none") from None


def open_browser(address: str) -> None:
    """Opens the address in a browser, except over ssh and without a display."""
    remote = any(name in os.environ for name in ("SSH_CONNECTION", "SSH_TTY"))
    shown = sys.platform == "win32" or any(name in os.environ for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    if shown and not remote:
        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(address)


@contextlib.contextmanager
def _silent() -> Any:
    """Hides viser's messages about its start and stop. In a notebook, rich does not print them to stdout."""
    console = importlib.import_module("rich").get_console()  # viser needs rich
    quiet, console.quiet = console.quiet, True
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            yield
    finally:
        console.quiet = quiet

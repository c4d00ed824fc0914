"""viser's server: started without a word, on this machine alone unless asked otherwise, and stopped without a trace."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import sys
import webbrowser
from typing import Any

from mjenv.errors import InvalidValueError, OptionError

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
        with _silent():
            try:
                self.viser: Any = viser.ViserServer(
                    host=host, port=FIRST_PORT if port is None else port, label=label, verbose=False
                )
            except OverflowError as error:
                raise InvalidValueError(f"there is no port {port}: {error}") from None
        found = self.viser.get_port()
        if port not in (None, 0, found):
            self.close()
            raise InvalidValueError(f"port {port} of {host} is in use or not allowed: choose another, or none")
        self.address = f"http://{'localhost' if host in ('127.0.0.1', '0.0.0.0') else host}:{found}"
        self.port: int = found

    def close(self) -> None:
        """Closes the port and ends the threads. Closing twice is fine."""
        with _silent():
            self.viser.stop()

    @property
    def is_watched(self) -> bool:
        """Whether a browser shows the page."""
        return bool(self.viser.get_clients())


def open_browser(address: str) -> None:
    """Opens the address where a browser can show it: not over ssh, and not without a display."""
    remote = any(name in os.environ for name in ("SSH_CONNECTION", "SSH_TTY"))
    shown = sys.platform in ("win32", "darwin") or any(name in os.environ for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    if shown and not remote:
        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(address)


@contextlib.contextmanager
def _silent() -> Any:
    """viser prints where it listens, and that it has stopped."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield

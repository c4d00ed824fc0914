"""The command mjenv view in a process of its own."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from typing import Any
from urllib.parse import urlsplit

from waiting import HANGS


class Command:
    """Runs it until the end of a with block, where Ctrl-C has to end it, and to leave its port free."""

    def __init__(self, *arguments: Any) -> None:
        command = [sys.executable, "-m", "mjenv", "view", *map(str, arguments), "--no-browser", "--port", "0"]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert self._process.stdout
        self.address = self._process.stdout.readline().strip()
        if not self.address.startswith("http://"):
            raise AssertionError(self._process.communicate()[1])

    def __enter__(self) -> Command:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: Any) -> None:
        self._process.send_signal(signal.SIGINT)
        try:
            out, errors = self._process.communicate(timeout=HANGS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            raise
        if kind is None:
            assert (self._process.returncode, out, errors) == (0, "", "closed\n")
            port = urlsplit(self.address).port
            with socket.socket() as again:
                again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                again.bind(("127.0.0.1", port))
                again.listen()

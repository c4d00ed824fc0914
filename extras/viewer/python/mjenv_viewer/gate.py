"""Who may open a page, and what a page may send. viser itself answers everybody, and believes what it is sent.

A page of a stranger, open in the same browser, can reach every port of this computer. So the address has a random token
that such a page does not know, and requests from other pages and for other hosts are refused. Of the messages, those
that the viewer needs pass, with values that its inputs can have.
"""

from __future__ import annotations

import contextlib
import importlib
import ipaddress
import logging
import math
import secrets
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

LONGEST = 2**16  # bytes of a message, and so of a text
FARTHEST = 1e6  # metres; also bounds the other numbers of cameras and drags
_EVERYWHERE = ("0.0.0.0", "::")  # to listen at these addresses means at all of the computer's
_starting = threading.Lock()  # held while `guarding` replaces a function for viser


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= FARTHEST


def _are_numbers(count: int) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, list) and len(value) == count and all(map(_is_number, value))


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_update(value: Any) -> bool:
    return isinstance(value, dict) and value.keys() == {"value"}


# viser's messages that may come from a page, and what each of their fields can be.
MESSAGES: dict[str, dict[str, Callable[[Any], bool]]] = {
    "ViewerCameraMessage": {
        **dict.fromkeys(("fov", "near", "far", "image_height", "image_width"), _is_number),
        **dict.fromkeys(("position", "look_at", "up_direction"), _are_numbers(3)),
        "wxyz": _are_numbers(4),
    },
    "GuiUpdateMessage": {"uuid": _is_text, "updates": _is_update},
    "SceneNodeDragMessage": {
        **dict.fromkeys(("name", "owner", "button"), _is_text),
        "modifier": lambda value: value is None or _is_text(value),
        "phase": lambda value: value in ("start", "update", "end"),
        "instance_index": lambda value: value is None or (type(value) is int and value >= 0),
        **dict.fromkeys(("start_position", "end_position"), _are_numbers(3)),
        **dict.fromkeys(("start_screen_pos", "end_screen_pos"), _are_numbers(2)),
    },
}


def valid(handle: Any, value: Any) -> Any:
    """What an input of the panel takes for a value from a page. Raises ValueError for one that no user can choose."""
    viser = importlib.import_module("viser")
    if isinstance(handle, (viser.GuiSliderHandle, viser.GuiNumberHandle)):
        number = float(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
        if math.isfinite(number):
            low = -math.inf if handle.min is None else handle.min
            high = math.inf if handle.max is None else handle.max
            return type(handle.value)(min(max(number, low), high))  # pages round the bounds to some digits
    elif isinstance(handle, (viser.GuiDropdownHandle, viser.GuiButtonGroupHandle)):
        if value in tuple(handle.options):
            return value
    elif isinstance(handle, (viser.GuiCheckboxHandle, viser.GuiButtonHandle, viser.GuiTextHandle)):
        if type(value) is type(handle.value):
            return value
    raise ValueError(f"{value!r} is no value of {handle!r}")


class Gate:
    """Guards one page."""

    def __init__(self, host: str) -> None:
        self.token = secrets.token_urlsafe(16)
        self.is_shut = False  # whether viser asks this object, so that the page is guarded
        self.inputs: Mapping[str, Any] = {}  # the panel's, by the names that messages have for them
        self._names = {"localhost", "127.0.0.1", "::1", host.lower()}
        self._everywhere = host in _EVERYWHERE
        if self._everywhere:
            self._names.add(socket.gethostname().lower())

    # ---- requests ----

    def refusal(self, connection: Any, request: Any) -> Any:
        """The answer to a request that may not come in. None for others, which then ask for viser's own path."""
        hosts, origins = request.headers.get_all("Host"), request.headers.get_all("Origin")
        own = len(hosts) == 1 and self._is_own(hosts[0])
        # A browser says with each WebSocket which page opens it. The port may be another one, that ssh forwards.
        own = own and all(origin in (f"http://{hosts[0]}", f"https://{hosts[0]}") for origin in origins)
        path, question, search = request.path.partition("?")
        token, _, rest = path.removeprefix("/").partition("/")
        if not own or not secrets.compare_digest(token.encode(errors="replace"), self.token.encode()):
            return connection.respond(HTTPStatus.FORBIDDEN, "Open the whole address that mjenv has printed.\n")
        request.path = f"/{rest}{question}{search}"
        return None

    def _is_own(self, host: str) -> bool:
        """Whether this is a name or number of this computer. A stranger can point other names to it."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
            return name in self._names or (self._everywhere and bool(ipaddress.ip_address(name)))
        except ValueError:
            return False

    # ---- messages ----

    def checked(self, raw: Any) -> bytes | None:
        """A message as viser may get it, with valid values; None for one that no page of the viewer sends."""
        messages = importlib.import_module("msgspec.msgpack")  # which viser brings
        try:
            message = messages.decode(raw)
            fields = MESSAGES[message["type"]]
            if message.keys() != {"type", *fields} or not all(check(message[name]) for name, check in fields.items()):
                return None
            if "updates" in fields:
                message["updates"] = {"value": valid(self.inputs[message["uuid"]], message["updates"]["value"])}
            found: bytes = messages.encode(message)
        except Exception:  # anything can be in a stranger's bytes
            return None
        return found

    # ---- how viser is made to ask ----

    @contextlib.contextmanager
    def guarding(self) -> Iterator[None]:
        """Guards the server that viser starts meanwhile, which has no setting for this."""
        module: Any = importlib.import_module("websockets.asyncio.server")
        serve = module.serve

        def serve_guarded(handler: Any, *arguments: Any, process_request: Any, **settings: Any) -> Any:
            if not handler.__module__.startswith("viser."):  # a server of another thread
                return serve(handler, *arguments, process_request=process_request, **settings)
            self.is_shut = True

            async def handle(connection: Any) -> None:
                receive = connection.recv

                async def receive_checked() -> bytes:
                    while (message := self.checked(await receive())) is None:
                        pass
                    return message

                connection.recv = receive_checked
                await handler(connection)

            def process(connection: Any, request: Any) -> Any:
                return self.refusal(connection, request) or process_request(connection, request)

            silent = logging.Logger("mjenv view", logging.CRITICAL + 1)  # about requests that are no HTTP, for example
            settings |= {"process_request": process, "max_size": LONGEST, "logger": silent}
            return serve(handle, *arguments, **settings)

        with _starting:
            module.serve = serve_guarded
            try:
                yield
            finally:
                module.serve = serve

"""What a page of a stranger can do to the viewer, and to the program whose environment it shows: nothing."""

from __future__ import annotations

import gc
import http.client
import math
import os
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from viser._messages import Message
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

import mjenv
from mjenv_viewer.controls import Page
from mjenv_viewer.gate import LONGEST, MESSAGES, valid
from mjenv_viewer.server import Server
from waiting import wait_until

PLUGINS = Path(os.environ["MJENV_LIBRARY"]).resolve().parent / "tests" / "tasks"
UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "MDEyMzQ1Njc4OTAxMjM0NQ==",
    "Sec-WebSocket-Protocol": f"viser-v{viser.__version__}",
}

# ---- requests ----


def status(server: Server, headers: dict[str, str], path: str | None = None) -> int:
    own = "/" + server.address.rpartition("/")[2]
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    connection.putrequest("GET", own if path is None else path.replace("TOKEN", own[1:]), skip_host=True)
    for name, value in headers.items():
        connection.putheader(name, value.replace("PORT", str(server.port)))
    connection.endheaders()
    found = connection.getresponse().status
    connection.close()
    return found


OWN = [
    {"Host": "localhost:PORT"},
    {"Host": "localhost:PORT", "Origin": "http://localhost:PORT"},
    {"Host": "127.0.0.1:PORT", "Origin": "http://127.0.0.1:PORT"},
    {"Host": "[::1]:9", "Origin": "https://[::1]:9"},  # another port, that ssh forwards
]
FOREIGN = [
    {},
    {"Host": "evil.example:PORT"},
    {"Host": "evil.example:PORT", "Origin": "http://evil.example:PORT"},  # its name was pointed to this computer
    {"Host": "localhost.evil.example"},
    {"Host": "192.0.2.1:PORT"},  # the page is served at 127.0.0.1
    {"Host": "[localhost"},
    {"Host": "localhost:PORT", "Origin": "http://evil.example"},
    {"Host": "localhost:PORT", "Origin": "http://localhost:1"},  # a page of another program on this computer
    {"Host": "localhost:PORT", "Origin": "null"},
]


def test_only_the_own_page_may_ask() -> None:
    server = Server(0)
    for more, welcome in (({}, 200), (UPGRADE, 101)):
        assert [status(server, {**headers, **more}) for headers in OWN] == [welcome] * len(OWN)
        assert {status(server, {**headers, **more}) for headers in FOREIGN} == {403}
        paths = ["/", "/index.html", "/TOKE", "/TOKENN", "/?TOKEN", "//TOKEN", "/x/TOKEN"]
        assert {status(server, {**OWN[1], **more}, path) for path in paths} == {403}
        assert {status(server, {**OWN[1], **more}, path) for path in ("/TOKEN/", "/TOKEN?darkMode")} == {welcome}
    assert status(server, OWN[0], "/TOKEN/../server.py") == 404
    other = Server(0)
    assert other.address.rpartition("/")[2] != server.address.rpartition("/")[2]
    other.close()
    server.close()


def test_a_page_that_all_computers_may_see_is_asked_for_by_number_or_by_name() -> None:
    server = Server(0, "0.0.0.0")
    hosts = ["192.0.2.1", "[2001:db8::1]:7", os.uname().nodename, "localhost", "evil.example"]
    assert [status(server, {"Host": host, **UPGRADE}) for host in hosts] == [101] * 4 + [403]
    server.close()


# ---- messages ----


class Socket:
    """A WebSocket that knows the token, and sends what no page of viser does."""

    def __init__(self, server: Server) -> None:
        self._inputs = server.viser.gui._gui_input_handle_from_uuid
        address = server.address.replace("http://", "ws://")
        self._socket = connect(address, subprotocols=[UPGRADE["Sec-WebSocket-Protocol"]], max_size=None)  # type: ignore[list-item]
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        self.send("ViewerCameraMessage", **CAMERA)
        wait_until(lambda: server.is_watched, "the page")

    def _read(self) -> None:
        try:
            for _ in self._socket:
                pass
        except ConnectionClosed:
            pass

    def uuid(self, label: str) -> str:
        return next(uuid for uuid, handle in self._inputs.items() if handle.label == label)

    def send(self, type: str, **fields: Any) -> None:
        self.send_raw(msgspec.msgpack.encode({"type": type, **fields}))

    def send_raw(self, raw: bytes | str) -> None:
        self._socket.send(raw)

    def choose(self, label: str, value: Any) -> None:
        self.send("GuiUpdateMessage", uuid=self.uuid(label), updates={"value": value})

    def close(self) -> None:
        self._socket.close()
        self._reader.join()


CAMERA = {"wxyz": [1, 0, 0, 0], "position": [3.0, 3, 3], "look_at": [0, 0, 0], "up_direction": [0, 0, 1.0]}
CAMERA |= {"fov": 0.8, "near": 0.01, "far": 1000, "image_height": 480, "image_width": 640}
BAD = [math.nan, math.inf, -math.inf, 1e300, -1e300, 2**64 - 1, -(2**63), -1, 99, 2.5, None, True, False, "", "99", "²"]
BAD += ["é" * 9999, b"\xff", [], [[]], {}, [math.nan] * 3, [1e300] * 3, [0, 0], [None] * 3, ["0"] * 4, {"value": 1}]


def drag(server: Server) -> dict[str, Any]:
    """The start of a pull at the first body that can be pulled."""
    names = server.viser.scene._handle_from_node_name.items()
    name = next(name for name, handle in names if getattr(handle._impl, "drag_cb", None))
    places = {"start_position": [0.0, 0, 1], "end_position": [0, 0, 1.5]}
    places |= {"start_screen_pos": [0.5, 0.5], "end_screen_pos": [0.5, 0.25]}
    kind = {"phase": "start", "button": "left", "modifier": None, "owner": ""}
    return {"name": name, "instance_index": 0, **kind, **places}


def attack(page: Socket, server: Server) -> None:
    """Sends each value of each message out of range, and whatever else a stranger can think of."""
    good = {"ViewerCameraMessage": CAMERA, "SceneNodeDragMessage": drag(server)}
    for kind, fields in good.items():
        assert MESSAGES[kind].keys() == fields.keys()
        for name in fields:
            for value in BAD:
                page.send(kind, **{**fields, name: value})
            page.send(kind, **{key: value for key, value in fields.items() if key != name})
        page.send(kind, **fields, more=1)
    for row in (4, 10**6, 2**63):  # there are four
        page.send("SceneNodeDragMessage", **{**good["SceneNodeDragMessage"], "instance_index": row})
    for uuid, handle in [*server.viser.gui._gui_input_handle_from_uuid.items()]:
        for value in BAD:
            page.send("GuiUpdateMessage", uuid=uuid, updates={"value": value})
        for name in (*vars(handle._impl), *vars(handle._impl.props), "unknown"):
            page.send("GuiUpdateMessage", uuid=uuid, updates={name: True})
        page.send("GuiUpdateMessage", uuid=uuid, updates=[])
    for value in BAD:
        page.send("GuiUpdateMessage", uuid=value, updates={"value": 1})
        page.send(value, uuid="")
        page.send_raw(msgspec.msgpack.encode(value))
    for kind in {kind.__name__: kind for kind in Message.get_subclasses()}:
        page.send(kind)
    for raw in (b"", b"\xc1", b"\x91" * 50000, "text", "{}", b"\xdf\xff\xff\xff\xff"):
        page.send_raw(raw)


@pytest.fixture(autouse=True)
def _quiet(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, capfd: Any) -> Iterator[None]:
    """Nothing is printed, no thread ends with an error, and nobody asks for a public address."""
    asked: list[None] = []
    for name in ("request_share_url", "disconnect_share_url"):
        monkeypatch.setattr(viser.ViserServer, name, lambda server: asked.append(None))
    yield
    gc.collect()  # asyncio reports lost errors then
    assert not caplog.records
    assert capfd.readouterr() == ("", "")
    assert not asked


def check_inputs(server: Server) -> None:
    """Every input has a value that a user could have chosen, and can still be drawn."""
    for handle in server.viser.gui._gui_input_handle_from_uuid.values():
        assert valid(handle, handle.value) == handle.value
        assert not handle._impl.removed
        assert handle.label != "True"
        assert handle.visible is True


def test_a_session_survives_each_message() -> None:
    mjenv.load_tasks(PLUGINS / "liblive.so")
    for id in ("CppLive-v0", "Ant-v5"):
        with Page(id, 4, port=0) as session:
            page = Socket(session.server)
            attack(page, session.server)
            page.choose("Row", 0)
            page.choose("Row", 2)
            wait_until(lambda session=session: session.picture.follow == 2, "the row")
            check_inputs(session.server)
            page.choose("Actions", "zero")
            page.choose("Reset", True)
            before = session.ask(lambda session=session: session.steps[0])
            session.ask(lambda session=session: session.step())
            assert session.ask(lambda session=session: session.steps[0]) >= before
            page.close()


def test_a_program_survives_each_message(monkeypatch: pytest.MonkeyPatch) -> None:
    envs = mjenv.make_vec("Hopper-v5", 4)
    envs.reset(seed=0)
    with mjenv.view(envs, port=0, quiet=True) as view:
        monkeypatch.setattr(view, "_share", math.inf)
        page = Socket(view.server)
        page.choose("Row", 99)
        step = lambda: envs.step(np.zeros((4, 3), np.float32))  # noqa: E731
        wait_until(lambda: [step(), view.picture.follow == 3][1], "the last row")
        attacking = threading.Thread(target=attack, args=(page, view.server))
        attacking.start()
        while attacking.is_alive():
            view.paused = False  # one of the messages' clicks
            step()
        page.choose("Row", 1)
        wait_until(lambda: [setattr(view, "paused", False), step(), view.picture.follow == 1][2], "the row")
        check_inputs(view.server)
        assert np.isfinite(envs.data.qpos).all()
        page.close()
    assert step()[0].shape == (4, 11)


def test_an_error_in_drawing_is_shown_and_not_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    envs = mjenv.make_vec("Hopper-v5", 4)
    envs.reset(seed=0)
    with mjenv.view(envs, port=0, quiet=True) as view:
        page = Socket(view.server)
        said: list[str] = []
        monkeypatch.setattr(view.server, "report", said.append)
        view.do(lambda: view.picture.choose(99))
        wait_until(lambda: [envs.step(np.zeros((4, 3), np.float32)), said][1], "the error")
        assert "IndexError" in said[0]
        page.close()
    with Page("Hopper-v5", 4, port=0) as session:
        monkeypatch.setattr(session.server, "report", said.append)
        said.clear()
        session.do(lambda: session.picture.choose(99))
        wait_until(lambda: said, "the error")
        session.ask(lambda: session.picture.choose(0))


def test_a_long_message_ends_the_connection() -> None:
    with Page("Hopper-v5", 1, port=0) as session:
        page = Socket(session.server)
        page.send_raw(bytes(LONGEST + 1))
        wait_until(lambda: not session.server.is_watched, "the end")
        page.close()


def test_numbers_keep_to_the_bounds_of_their_inputs() -> None:
    server = Server(0)
    gui = server.viser.gui
    slider, row = gui.add_slider("slider", -0.5, 0.5, 0.01, 0.0), gui.add_slider("row", 0, 3, 1, 0)
    number = gui.add_number("number", 1.5, min=0)
    values = [(slider, 0.3), (slider, 1), (slider, -7.0), (row, 2.0), (row, 99), (number, -3), (number, 1e300)]
    assert [valid(*pair) for pair in values] == [0.3, 0.5, -0.5, 2, 3, 0.0, 1e300]
    assert type(valid(row, 2.0)) is int
    server.close()


def test_a_page_chooses_no_files() -> None:
    """What reads files, or trusts them, only the command line sets."""
    spider = str(Path(__file__).parents[3] / "tests" / "golden" / "custom" / "spider.xml")
    options = {"xml_file": spider, "trust_xml": "no"}
    with Page("Model-v0", 1, options, port=0) as session:
        labels = {handle.label for handle in session.server.viser.gui._gui_input_handle_from_uuid.values()}
        assert "frame_skip" in labels
        assert not {"xml_file", "xml_string", "trust_xml", "arrays"} & labels
        before = session.envs
        page = Socket(session.server)
        page.choose("frame_skip", "3")
        page.choose("Apply", True)
        wait_until(lambda: session.envs is not before, "the new environment")
        assert session.ask(lambda: session.options) == {**options, "frame_skip": 3}
        page.close()

"""The pages of the environments, made from what the library says of itself (python -m mjenv info ID --json)."""

from __future__ import annotations

import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

import mjenv
from mjenv_command import catalogue

CORE = Path(__file__).resolve().parents[2] / "core" / "robots"
# How many elements of mjData's arrays belong to a joint: free, ball, slide, hinge.
POSITIONS = ("x, m", "y, m", "z, m", "quaternion w", "quaternion x", "quaternion y", "quaternion z")
VELOCITIES = ("x, m/s", "y, m/s", "z, m/s", "around x, rad/s", "around y, rad/s", "around z, rad/s")
FREE, BALL, SLIDE, HINGE = range(4)


def robots() -> dict[str, list[str]]:
    """The ids of each robot, the newest first."""
    found: dict[str, list[str]] = {}
    for id in mjenv.ids():
        found.setdefault(id.rpartition("-")[0], []).insert(0, id)
    return found


def uris() -> dict[str, str]:
    return {robot: f"environments/{_snake(robot)}.md" for robot in robots()}


def pages() -> dict[str, str]:
    described = {id: catalogue.describe(id, {}) for id in mjenv.ids()}
    made = {uris()[robot]: _robot(robot, [described[id] for id in ids]) for robot, ids in robots().items()}
    return {"environments/index.md": _index(described), **made}


def pictures() -> dict[str, bytes]:
    """A picture of each robot a few steps into an episode, as PNG files."""
    return {uri.replace(".md", ".png"): _picture(f"{robot}-v5") for robot, uri in uris().items()}


def _picture(id: str) -> bytes:
    with mjenv.make(id, render_mode="rgb_array", width=480, height=360) as env:
        env.reset(seed=1)
        env.action_space.seed(1)
        for _ in range(5):
            env.step(env.action_space.sample())
        return _png(np.asarray(env.render()))


def _png(rgb: np.ndarray) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width, _ = rgb.shape
    unfiltered = np.pad(rgb.reshape(height, -1), ((0, 0), (1, 0)))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(unfiltered.tobytes(), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def _snake(robot: str) -> str:
    return re.sub(r"(?<=[a-z])(?=[A-Z0-9])(?!\d)", "_", robot).lower()


def _about(robot: str) -> str:
    """The line above the function that defines the robot."""
    name = _snake(robot)
    match = re.search(r"((?:^//.*\n)+)^void \w+\(Robot& r\)", (CORE / f"{name}.cpp").read_text(), re.MULTILINE)
    if not match:
        raise ValueError(f"{name}.cpp does not say what the robot is")
    return " ".join(line.removeprefix("//").strip() for line in match[1].splitlines())


def _index(described: dict[str, dict[str, Any]]) -> str:
    rows = []
    for id, about in described.items():
        robot = id.rpartition("-")[0]
        spaces = about["spaces"]
        sizes = [str(spaces[role]["shape"][0]) for role in ("observation", "action")]
        limit, solved = str(about["max_episode_steps"]), catalogue._short(about["reward_threshold"])
        link = f"[{id}]({Path(uris()[robot]).name}#{id.lower()})"
        rows.append((link, *sizes, f"{about['model']['dt']:.12g}", limit, solved))
    return "\n".join(
        [
            "# Environments",
            "",
            "Gymnasium's eleven MuJoCo robots, each as v4 and v5. New work should use v5; v4 is there to repeat older",
            "results. [Fidelity](../fidelity.md) tells their quirks.",
            "",
            '<div class="grid cards" markdown>',
            "",
            *(f"- [![{robot}]({Path(uri).stem}.png)<br>{robot}]({Path(uri).name})" for robot, uri in uris().items()),
            "",
            "</div>",
            "",
            *_table(("id", "observation", "action", "a step, s", "step limit", "solved at a return of"), rows),
            "",
            "The tables of the following pages are what the library says of itself: to `python -m mjenv info ID`, and",
            "by the [C interface](../reference/c.md#mjenv_field_at) to any program.",
        ]
    )


def _robot(robot: str, versions: list[dict[str, Any]]) -> str:
    lines = [f"# {robot}", "", _about(robot), "", f"![{robot}]({_snake(robot)}.png)", ""]
    for described in versions:
        lines += [f"## {described['id']}", "", *_version(described)]
    return "\n".join(lines)


def _version(described: dict[str, Any]) -> list[str]:
    model, id = described["model"], described["id"]
    solved = described["reward_threshold"]
    facts = [
        f"An episode has at most {described['max_episode_steps']} steps of {model['dt']:.12g} s "
        f"({model['frame_skip']} `mj_step`s of {model['timestep']:.12g} s).",
        f"It counts as solved at a mean return of {catalogue._short(solved)}." if solved is not None else "",
        f"The robot weighs {model['mass']:.3g} kg; a snapshot of a row takes {model['snapshot_bytes']} bytes.",
    ]
    lines = [" ".join(filter(None, facts)), ""]
    lines += ["### Action { #" + id.lower() + "-action }", "", *_actions(described), ""]
    lines += ["### Observation { #" + id.lower() + "-observation }", "", *_observations(described), ""]
    lines += ["### Info { #" + id.lower() + "-info }", "", *_info(described), ""]
    lines += ["### Options { #" + id.lower() + "-options }", "", *_options(described), ""]
    return lines


def _box(space: dict[str, Any]) -> str:
    return f"`Box({space['shape'][0]})`, {space['dtype']}"


def _actions(described: dict[str, Any]) -> list[str]:
    space = described["spaces"]["action"]
    rows = [
        (str(index), f"`{field['name']}`", catalogue._short(low), catalogue._short(high))
        for index, (field, low, high) in enumerate(zip(described["action"], space["low"], space["high"], strict=True))
    ]
    return [f"{_box(space)}. The controls of the actuators:", "", *_table(("index", "actuator", "low", "high"), rows)]


def _observations(described: dict[str, Any]) -> list[str]:
    env = mjenv.make(described["id"])
    leaves_out = any(option["name"] == "exclude_current_positions_from_observation" for option in described["options"])
    rows = []
    for field in described["observation"]:
        first, count = field["offset"], (field["shape"] or [1])[0]
        elements = _elements(env.model, field["name"], count, leaves_out)
        if elements:
            rows += [(str(first + index), f"`{field['name']}`", element) for index, element in enumerate(elements)]
        else:
            rows.append((catalogue._places(field), f"`{field['name']}`", field["doc"]))
    env.close()
    return [f"{_box(described['spaces']['observation'])}:", "", *_table(("index", "part", "what"), rows)]


def _elements(model: Any, name: str, count: int, leaves_out: bool) -> list[str]:
    """What each element of a part is that lists joints, of which the first positions may be left out."""
    joints = [(model.joint(index).name, int(model.jnt_type[index])) for index in range(model.njnt)]
    if name == "qpos":
        found = [text for joint in joints for text in _positions(*joint)]
        return found[len(found) - count :] if leaves_out else found[:count]
    if name == "qvel":
        found = [text for joint in joints for text in _velocities(*joint)]
        return found[:count]
    return []


def _positions(name: str, kind: int) -> list[str]:
    if kind in (FREE, BALL):
        return [f"`{name}`: {text}" for text in (POSITIONS if kind == FREE else POSITIONS[3:])]
    return [f"`{name}`: {'position, m' if kind == SLIDE else 'angle, rad'}"]


def _velocities(name: str, kind: int) -> list[str]:
    if kind in (FREE, BALL):
        return [f"`{name}`: {text}" for text in (VELOCITIES if kind == FREE else VELOCITIES[3:])]
    return [f"`{name}`: {'velocity, m/s' if kind == SLIDE else 'angular velocity, rad/s'}"]


def _info(described: dict[str, Any]) -> list[str]:
    at_reset = {field["name"] for field in described["reset_info"]}
    rows = [
        (f"`{field['name']}`", field["type"], "yes" if field["name"] in at_reset else "", field["doc"])
        for field in described["info"]
    ]
    return _table(("key", "type", "at a reset, too", "what"), rows) if rows else ["None."]


def _options(described: dict[str, Any]) -> list[str]:
    rows = [
        (f"`{option['name']}`", f"`{catalogue._text(option['default'])}`", catalogue._range(option), option["doc"])
        for option in described["options"]
    ]
    return _table(("option", "default", "allowed", "what"), rows)


def _table(names: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    def line(cells: tuple[str, ...]) -> str:
        return (
            "| "
            + " | ".join(cell.replace("|", "\\|").replace("<", "&lt;").replace(">", "&gt;") for cell in cells)
            + " |"
        )

    return [line(names), line(("---",) * len(names)), *map(line, rows)]

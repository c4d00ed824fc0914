"""The picture of an environment in a browser: the rows that are drawn, the one that is followed, and the switches."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.errors import InvalidValueError
from mjenv_viewer import poses
from mjenv_viewer.poses import Pose
from mjenv_viewer.pull import Pull
from mjenv_viewer.scene import scene_of
from mjenv_viewer.server import Server
from mjenv_viewer.skins import skins_of
from mjenv_viewer.stage import Stage

Array = NDArray[Any]

SURROUNDINGS = "warehouse"  # viser's name for the light that comes from all sides
_FIELD_OF_VIEW = math.radians(45)  # MuJoCo's default
# MuJoCo's switches, and whether each is on at first.
SWITCHES = {"tendons": True, "joints": False, "centres of mass": False, "contacts": False, "contact forces": False}


def rows_of(env: Any) -> tuple[Any, ...]:
    """The rows of a vector environment, or the one of a single environment."""
    while hasattr(env, "envs"):  # mjenv_sb3's environments hold a vector environment
        env = env.envs
    return tuple(env) if isinstance(env, Sequence) else (env,)


class Picture:
    """The picture on a page. Only the thread that steps the environment calls it."""

    def __init__(self, server: Server, env: Any, shown: int, do: Callable[[Callable[[], None]], None]) -> None:
        """shown: the first `shown` rows are drawn. do: runs a function on the thread that steps."""
        self.server = server
        self.rows = rows_of(env)[:shown]
        self.pull = Pull()
        self.follow = 0  # the number of the row whose details are shown
        self.tracks = True  # whether the picture moves with that row
        self._centred = len(self.rows) == 1  # whether that row is in the middle, and not the whole grid
        model, data = self.rows[0].model, self.rows[0].data
        self.switches = dict(SWITCHES)
        self.scene = scene_of(model, data)
        if not self.scene.batches:
            raise InvalidValueError("the model has no geoms and no sites, so there is nothing to draw")
        moves = np.flatnonzero(np.asarray(model.body_weldid) > 0)
        self._root = int(moves[0]) if moves.size else 0
        self.scale = self.scene.radius / 2
        self._has_tendons = int(model.ntendon) > 0 and bool(np.asarray(data.ten_wrapnum).sum())
        self._skins = skins_of(model)
        self.stage = Stage(server.viser, self.scene, len(self.rows))
        is_dressed = any(self.stage.groups["skin"][skin.group] and skin.colour[3] > 0 for skin in self._skins)
        self.hint = None if is_dressed else self.stage.show_hidden_robot()
        self.stage.grabbed = lambda row, body, event: do(lambda: self._drag(row, body, event))
        self._puller = -1  # the number of the browser whose user pulls
        self._distance = self._look_at()
        self.dark = False
        self.set_dark(False)
        # viser's lights suit darker materials than MuJoCo's models have.
        server.viser.scene.configure_environment_map(SURROUNDINGS, environment_intensity=0.35)

    def take_settings(self, other: Picture) -> None:
        """Copies the switches, groups and followed row of another picture with as many rows."""
        self.switches, self.tracks = other.switches, other.tracks
        self.follow, self._centred = other.follow, other._centred
        self.set_dark(other.dark)
        for kind, groups in other.stage.groups.items():
            for group, shown in enumerate(groups):
                self.stage.show_group(kind, group, shown)

    def choose(self, row: int) -> None:
        """Follows another row, and puts it in the middle."""
        self.follow, self._centred = row, True

    def set_dark(self, dark: bool) -> None:
        self.dark = dark
        # Without the button that would send the scene to a server elsewhere.
        gui = self.server.viser.gui
        gui.configure_theme(dark_mode=dark, show_logo=False, show_share_button=False, control_width="large")
        self.stage.show_haze(dark, self._distance)

    def _look_at(self) -> float:
        """Places the camera in front of the rows and above them. Returns its distance from them."""
        height = float(np.asarray(self.rows[0].data.xpos)[self._root][2])
        distance = 2.6 * self.scene.radius + 1.8 * float(np.abs(self.stage.offsets).max(initial=0))
        camera = self.server.viser.initial_camera
        camera.fov = _FIELD_OF_VIEW
        camera.position = (0.35 * distance, -1.2 * distance, height + 0.6 * distance)
        camera.look_at = (0.0, 0.0, height / 2)
        camera.up = (0.0, 0.0, 1.0)
        return float(np.linalg.norm(camera.position))

    def _drag(self, row: int, body: int, event: Any) -> None:
        here = self.stage.origin - self.stage.offsets[row]
        if event.phase == "start":
            self._puller = event.client_id
            self.pull.grab(row, body, self.rows[row].data, event.start_position + here, event.end_position + here)
        elif event.client_id != self._puller:
            return  # another user has pulled a body since then
        elif event.phase == "update":
            self.pull.move(event.end_position + here)
        else:  # the user lets go, or the browser is closed
            self.pull.release()

    def read(self) -> list[Pose]:
        """The rows as they are now."""
        found = [poses.pose_of(row.data, self._root, self.stage.needs_sites) for row in self.rows]
        for number, row in enumerate(self.rows):
            found[number].marks.update(self._marks(row, followed=number == self.follow))
        return found

    def _marks(self, row: Any, followed: bool) -> dict[str, poses.Marks]:
        model, data, marks = row.model, row.data, {}
        if self.switches["tendons"] and self._has_tendons:
            marks["tendons"] = poses.tendons(model, data)
        if not followed:
            return marks
        if self.switches["joints"]:
            marks["joints"] = poses.joints(model, data, self.scale)
        if self.switches["centres of mass"]:
            marks["centres of mass"] = poses.centres_of_mass(model, data, self.scale)
        if self.switches["contacts"]:
            marks["contacts"] = poses.contacts(data, self.scale)
        if self.switches["contact forces"]:
            marks["contact forces"] = poses.contact_forces(model, data, self.scale)
        return marks

    def show(self, found: Sequence[Pose]) -> None:
        """Sends poses to the browsers, which draw them when they can."""
        grip = self.pull.grip
        if grip:
            one = found[grip.row]
            spring = self.pull.marks(self.rows[grip.row].data, self.scale)
            found = [*found]
            found[grip.row] = replace(one, marks={**one.marks, "pull": spring})
        origin = np.zeros(3)
        if self.tracks:
            middle = self.stage.offsets[self.follow] if self._centred else np.zeros(3)
            origin[:2] = (found[self.follow].root + middle)[:2]
        self.stage.show(found, origin)
        if self._skins:
            data = self.rows[self.follow].data
            positions, turns = np.asarray(data.xpos), np.asarray(data.xmat).reshape(-1, 3, 3)
            self.stage.show_skins(self._skins, positions, turns, self.stage.offsets[self.follow] - origin)

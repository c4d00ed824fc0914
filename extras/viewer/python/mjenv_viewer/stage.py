"""The nodes of viser's scene that show rows of an environment."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv_viewer import shapes
from mjenv_viewer.poses import Marks, Pose
from mjenv_viewer.scene import GROUPS, Batch, Look, Scene, Texture, cube_colours
from mjenv_viewer.shapes import Shape
from mjenv_viewer.skins import Skin

Array = NDArray[Any]

_ROOT = "/rows"
_SHOWN = 3  # MuJoCo shows the groups 0, 1 and 2 unless asked for others
# The shape and the colour of the marks of each of MuJoCo's switches.
MARKS: dict[str, tuple[Callable[[], Shape], tuple[int, int, int]]] = {
    "tendons": (shapes.unit_cylinder, (230, 70, 60)),
    "joints": (shapes.arrow, (60, 130, 220)),
    "centres of mass": (lambda: shapes.sphere((1, 1, 1)), (240, 220, 80)),
    "contacts": (lambda: shapes.cylinder(1, 0.5), (230, 160, 40)),
    "contact forces": (shapes.arrow, (160, 220, 60)),
    "pull": (shapes.unit_cylinder, (224, 83, 61)),
}
_BACKGROUNDS = {False: (255, 255, 255), True: (20, 20, 20)}  # of the page, by whether it is dark
_NOWHERE = -1e4  # the place of marks that are not needed now


class Stage:
    """Draws rows in a grid. One thread at a time calls it."""

    def __init__(self, server: Any, scene: Scene, rows: int) -> None:
        self._server, self.scene, self.rows = server, scene, rows
        self.grabbed: Callable[[int, int, Any], None] = lambda row, body, event: None
        self._nodes: list[tuple[Batch, Any, NDArray[np.intp]]] = []
        self._marks: dict[str, Any] = {}
        self._capacity: dict[str, int] = {}
        self.skins: dict[int, Any] = {}
        self.groups = {
            kind: [group < _SHOWN for group in range(GROUPS)] for kind in ("geom", "site", "tendon", "joint", "skin")
        }
        columns = math.ceil(math.sqrt(rows))
        self.spacing = 2.4 * scene.radius
        places = np.array([divmod(row, columns) for row in range(rows)], float)
        middle = places.mean(axis=0)
        self.offsets: Array = np.zeros((rows, 3))
        self.offsets[:, :2] = (places - middle)[:, ::-1] * self.spacing * (1, -1)
        self._origin = np.zeros(3)
        self._frame = server.scene.add_frame(_ROOT, show_axes=False)
        for number, batch in enumerate(scene.batches):
            self._add(f"{_ROOT}/{batch.kind}{number}", batch)

    def _add(self, name: str, batch: Batch) -> None:
        rows = np.arange(1 if self._is_shared(batch) else self.rows)
        count = len(rows) * len(batch.objects)
        places = {
            "batched_wxyzs": np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
            "batched_positions": np.full((count, 3), _NOWHERE, np.float32),
            "visible": self.groups[batch.kind][batch.group],
            "cast_shadow": not batch.is_floor,
        }
        opacity = batch.look.colour[3]
        if batch.look.texture is None:
            node = self._server.scene.add_batched_meshes_simple(
                name,
                batch.shape.vertices,
                batch.shape.faces,
                batched_colors=_bytes(batch.look.colour),
                opacity=opacity if opacity < 1 else None,
                side="double" if batch.is_floor else "front",
                lod="off",
                **places,
            )
        else:
            textured = _textured(batch.shape, batch.look, batch.look.texture)
            node = self._server.scene.add_batched_meshes_trimesh(name, textured, lod="off", **places)
        if batch.bodies.max(initial=0) > 0:
            self._let_drag(node, batch)
        self._nodes.append((batch, node, rows))

    def _is_shared(self, batch: Batch) -> bool:
        """Whether all rows share one floor, because floors of their own would overlap."""
        return batch.is_floor and bool(np.ptp(batch.shape.vertices[:, :2], axis=0).min() > self.spacing)

    def _under(self, batch: Batch, origin: Array) -> Array:
        """Moves an infinite plane, of which only a part is drawn, below the middle of the picture.

        The plane moves by whole repetitions of its texture, so that the texture seems to stay.
        """
        size = np.ptp(batch.shape.vertices[:, :2], axis=0)
        texture = batch.look.texture
        if texture is None:
            return np.array([[origin[0], origin[1], 0.0]])
        period = size / np.maximum(np.array(texture.repeat) * (size / 2 if texture.is_uniform else 1), 1e-9)
        return np.array([[*(np.round(origin[:2] / period) * period), 0.0]])

    def _let_drag(self, node: Any, batch: Batch) -> None:
        async def dragged(event: Any) -> None:  # viser awaits them one after the other
            row, index = divmod(event.instance_index or 0, len(batch.objects))
            if row < self.rows:
                self.grabbed(row, int(batch.bodies[index]), event)

        node.on_drag(dragged)

    # ---- what is drawn ----

    def show(self, poses: Sequence[Pose], origin: Array) -> None:
        """Draws the rows at a moment. origin: the point in the middle of the picture."""
        with self._server.atomic():
            # Moves the positions and not the frame of the nodes, because a slow browser would move the frame first and
            # the batches later, and robots would stand beside the middle.
            self._origin = np.array(origin)
            for batch, node, rows in self._nodes:
                kind = batch.kind
                if not node.visible or kind not in poses[0].position:
                    continue
                away = self._under(batch, origin) if self._is_shared(batch) else self.offsets[rows]
                position = (
                    np.stack([poses[row].position[kind][batch.objects] for row in rows]) + (away - origin)[:, None]
                )
                turn = np.stack([poses[row].turn[kind][batch.objects] for row in rows])
                node.batched_positions = position.reshape(-1, 3).astype(np.float32)
                node.batched_wxyzs = turn.reshape(-1, 4).astype(np.float32)
            names = {name for pose in poses for name in pose.marks} | self._marks.keys()
            for name in names:
                found = [
                    (pose.marks[name], self.offsets[row] - origin)
                    for row, pose in enumerate(poses)
                    if name in pose.marks
                ]
                self._draw(name, found)

    def _draw(self, name: str, marks: Sequence[tuple[Marks, Array]]) -> None:
        """Draws marks of one kind with the existing meshes, and makes more meshes if there are too few."""
        shown = self.groups.get(name.removesuffix("s"), [True] * GROUPS)
        chosen = [np.array(shown)[np.clip(part.group, 0, GROUPS - 1)] for part, _ in marks]
        needed = sum(int(part.sum()) for part in chosen)
        if needed > self._capacity.get(name, 0):
            self._grow(name, max(16, 2 ** math.ceil(math.log2(needed))))
        node = self._marks.get(name)
        if node is None:
            return
        capacity = self._capacity[name]
        position, size = np.full((capacity, 3), _NOWHERE, np.float32), np.full((capacity, 3), 1e-6, np.float32)
        turn = np.tile(np.array([1, 0, 0, 0], np.float32), (capacity, 1))
        first = 0
        for (part, offset), which in zip(marks, chosen, strict=True):
            last = first + int(which.sum())
            position[first:last] = part.position[which] + offset
            turn[first:last], size[first:last] = part.turn[which], np.maximum(part.size[which], 1e-6)
            first = last
        node.batched_positions, node.batched_wxyzs, node.batched_scales = position, turn, size
        node.visible = needed > 0

    def _grow(self, name: str, capacity: int) -> None:
        shape_of, colour = MARKS[name]
        shape = shape_of()
        self._marks[name] = self._server.scene.add_batched_meshes_simple(
            f"{_ROOT}/marks/{name}",
            shape.vertices,
            shape.faces,
            np.tile(np.array([1, 0, 0, 0], np.float32), (capacity, 1)),
            np.full((capacity, 3), _NOWHERE, np.float32),
            batched_scales=np.full((capacity, 3), 1e-6, np.float32),
            batched_colors=colour,
            lod="off",
            cast_shadow=False,
        )
        self._capacity[name] = capacity

    def show_skins(self, skins: Sequence[Skin], positions: Array, turns: Array, offset: Array) -> None:
        """Draws the skins of one row, whose bodies have these positions and rotation matrices."""
        for number, skin in enumerate(skins):
            if not self.groups["skin"][skin.group] or skin.colour[3] <= 0:
                if number in self.skins:
                    self.skins[number].visible = False
                continue
            vertices = (skin.vertices(positions, turns) + offset).astype(np.float32)
            if number not in self.skins:
                opacity = float(skin.colour[3])
                self.skins[number] = self._server.scene.add_mesh_simple(
                    f"{_ROOT}/skin{number}",
                    vertices,
                    skin.faces,
                    color=_bytes(skin.colour),
                    opacity=opacity if opacity < 1 else None,
                    side="double",
                )
            self.skins[number].vertices = vertices
            self.skins[number].visible = True

    def show_group(self, kind: str, group: int, shown: bool) -> None:
        self.groups[kind][group] = shown
        for batch, node, _ in self._nodes:
            if batch.kind == kind and batch.group == group:
                node.visible = shown

    def show_hidden_robot(self) -> str | None:
        """Shows the robot's geoms, or its sites if it has none, if all are in hidden groups. Returns a hint then."""
        robot = [batch for batch in self.scene.batches if (batch.bodies > 0).any()]
        kind = "geom" if any(batch.kind == "geom" for batch in robot) else "site"
        hidden = sorted({batch.group for batch in robot if batch.kind == kind})
        if not hidden or any(self.groups[kind][group] for group in hidden):
            return None
        for group in hidden:
            self.show_group(kind, group, True)
        drawn = ",".join(str(group) for group, shown in enumerate(self.groups[kind]) if shown)
        return (
            f"The robot's {kind}s are in group {', '.join(map(str, hidden))}, which MuJoCo draws only if asked. They "
            f"are shown here; `mjenv play` draws them with `--{kind}group {drawn}`."
        )

    def show_haze(self, dark: bool, near: float) -> None:
        """Hides the far edges of the floor in haze. near: the distance of the rows, which stay clear."""
        floors = [batch.shape.vertices for batch, _, _ in self._nodes if self._is_shared(batch)]
        reach = max((float(np.abs(vertices[:, :2]).max()) for vertices in floors), default=0.0)
        self._server.scene.configure_fog(1.5 * near, 1.5 * near + reach, color=_BACKGROUNDS[dark], enabled=reach > 0)

    @property
    def needs_sites(self) -> bool:
        return any(batch.kind == "site" and node.visible for batch, node, _ in self._nodes)

    @property
    def origin(self) -> Array:
        """The point in the middle of the picture, in the coordinates of the grid."""
        return self._origin

    def remove(self) -> None:
        with contextlib.suppress(Exception):  # the server may be gone
            self._frame.remove()


def _bytes(colour: Any) -> tuple[int, int, int]:
    red, green, blue = (round(255 * min(max(float(part), 0), 1)) for part in colour[:3])
    return red, green, blue


def _textured(shape: Shape, look: Look, texture: Texture) -> Any:
    import trimesh  # type: ignore[import-not-found, unused-ignore]  # viser brings it
    from PIL import Image  # type: ignore[import-not-found, unused-ignore]

    colour = [*_bytes(look.colour), int(255 * look.colour[3])]
    if texture.is_cube:
        shades = cube_colours(texture, shape.vertices) * (np.array(colour[:3]) / 255)
        alpha = np.full((len(shades), 1), colour[3])
        shades = np.concatenate([shades, alpha], axis=1).astype(np.uint8)
        return trimesh.Trimesh(shape.vertices, shape.faces, vertex_colors=shades, process=False)
    uv = shape.uv
    half = np.maximum(np.abs(shape.vertices[:, :2]).max(axis=0), 1e-9)
    if uv is None:
        uv = shape.vertices[:, :2] / (2 * half) + 0.5
    uv = uv * texture.repeat * (half if texture.is_uniform else 1)
    surface = trimesh.visual.material.PBRMaterial(
        baseColorTexture=Image.fromarray(texture.pixels),
        baseColorFactor=colour,
        metallicFactor=0.0,
        roughnessFactor=float(np.clip(1 - look.shininess * look.specular / 4, 0.2, 1)),
        alphaMode="BLEND" if colour[3] < 255 else "OPAQUE",
        doubleSided=True,
    )
    visual = trimesh.visual.TextureVisuals(uv=uv, material=surface)
    return trimesh.Trimesh(shape.vertices, shape.faces, visual=visual, process=False)

"""Writes a model that MuJoCo 4.0 has compiled as MJCF for MuJoCo 2.2.2, which `mjenv convert` prints and compares.

The text gives every number of the compiled model where it is used: it has no defaults, frames or angles in degrees. An
attribute is left out where MuJoCo 2.2.2 has the same default.
"""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco  # type: ignore[import-not-found, unused-ignore]
import numpy as np

from mjenv.errors import ModelError

ENGINE = "2.2.2"
MESHES = (".stl", ".msh", ".obj")  # the files that MuJoCo 2.2.2 reads
CAMERA_MODES = ("fixed", "track", "trackcom", "targetbody", "targetbodycom")
JOINTS = ("free", "ball", "slide", "hinge")
SHAPES = ("plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh")
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "mesh": 0, "hfield": 0}  # numbers of a size; other shapes have 3
INTEGRATORS = {"EULER": "Euler", "RK4": "RK4", "IMPLICIT": "implicit"}
COLOURS = int(mujoco.mjtTextureRole.mjTEXROLE_RGB), int(mujoco.mjtTextureRole.mjTEXROLE_RGBA)
DYNAMICS = {"NONE": "none", "INTEGRATOR": "integrator", "FILTER": "filter", "FILTEREXACT": "filter", "MUSCLE": "muscle"}
GAINS = {"FIXED": "fixed", "AFFINE": "affine", "MUSCLE": "muscle"}
BIASES = {"NONE": "none", "AFFINE": "affine", "MUSCLE": "muscle"}
OBJECTS = ("body", "xbody", "geom", "site", "camera")
FRAMES = "pos quat xaxis yaxis zaxis linvel angvel linacc angacc".split()
SENSORS = {
    "touch": "site",
    **dict.fromkeys("accelerometer velocimeter gyro force torque magnetometer rangefinder".split(), "site"),
    **dict.fromkeys("jointpos jointvel ballquat ballangvel jointlimitpos jointlimitvel jointlimitfrc".split(), "joint"),
    **dict.fromkeys("tendonpos tendonvel tendonlimitpos tendonlimitvel tendonlimitfrc".split(), "tendon"),
    **dict.fromkeys("actuatorpos actuatorvel actuatorfrc".split(), "actuator"),
    **dict.fromkeys("subtreecom subtreelinvel subtreeangmom".split(), "body"),
    **{f"frame{what}": "" for what in FRAMES},
    "clock": "",
}
LACKING_OPTIONS = (
    "ls_iterations ls_tolerance ccd_iterations ccd_tolerance sdf_iterations sdf_initpoints sleep_tolerance"
)
# The flags of both versions, and the meanings of those that MuJoCo 2.2.2 lacks.
DISABLED = (
    "constraint equality frictionloss limit contact gravity clampctrl warmstart filterparent actuation refsafe sensor"
)
ENABLED = "override energy fwdinv"
LACKING_FLAGS = {
    "eulerdamp": "Euler always integrates damping implicitly",
    "midphase": "no effect",
    "autoreset": "no effect",
    "nativeccd": "libccd always finds the contacts of meshes, cylinders and ellipsoids",
    "island": "no effect",
    "invdiscrete": "no effect",
    "sleep": "bodies never sleep",
    "diagexact": "constraints have an approximate diagonal",
    "ipc": "no effect",
    "speculative": "no speculative contacts",
}

# The attributes of <visual> that both versions have.
VISUAL = {
    "global": "fovy ipd linewidth glow offwidth offheight azimuth elevation",
    "quality": "shadowsize offsamples numslices numstacks numquads",
    "headlight": "ambient diffuse specular active",
    "map": "stiffness stiffnessrot force torque alpha fogstart fogend znear zfar haze shadowclip shadowscale "
    "actuatortendon",
    "scale": "forcewidth contactwidth contactheight connect com camera light selectpoint jointlength jointwidth "
    "actuatorlength actuatorwidth framelength framewidth constraint slidercrank",
    "rgba": "fog haze force inertia joint actuator actuatornegative actuatorpositive com camera light selectpoint "
    "connect contactpoint contactforce contactfriction contacttorque contactgap rangefinder constraint slidercrank "
    "crankbroken",
}


def text_of(value: Any) -> str:
    """A value as text in MJCF. Numbers have enough digits to be read back with the same bits."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, np.floating):
        return (
            str(int(value))
            if value == int(value) and abs(value) < 1e15 and not _is_negative_zero(value)
            else str(value)
        )
    if np.ndim(value) == 0:
        return text_of(np.float64(value)) if isinstance(value, float) else str(int(value))
    return " ".join(text_of(number) for number in np.asarray(value).reshape(-1))


def _is_negative_zero(value: np.floating[Any]) -> bool:
    return bool(value == 0 and np.signbit(value))


def put(element: ElementTree.Element, name: str, value: Any, default: Any = None) -> None:
    """Writes an attribute, unless MuJoCo 2.2.2 has the same default."""
    if default is None or not np.array_equal(value, np.asarray(default, getattr(value, "dtype", None))):
        element.set(name, text_of(value))


class Changes:
    """What MuJoCo 2.2.2 does differently: lines such as "implicitfast: Euler instead", with their counts."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    def add(self, what: str, effect: str, times: Any = 1) -> None:
        if times:
            self._counts[f"{what}: {effect}"] += int(times)

    def list(self) -> list[dict[str, Any]]:
        return [
            dict(zip(("what", "effect"), line.split(": ", 1), strict=True), times=times)
            for line, times in self._counts.items()
        ]


def converted(spec: Any, model: Any, folder: Path) -> tuple[str, list[dict[str, Any]], list[int]]:
    """Converts a compiled model.

    Returns MJCF for MuJoCo 2.2.2, for a file in that folder; what changes; and for each actuator, the index of the
    model's actuator. Raises ModelError for what MuJoCo 2.2.2 cannot compute.
    """
    writer = _Writer(spec, model, folder)
    writer.refuse()
    writer.write()
    ElementTree.indent(writer.root)
    return ElementTree.tostring(writer.root, "unicode") + "\n", writer.changes.list(), writer.actuators


class _Writer:
    def __init__(self, spec: Any, model: Any, folder: Path) -> None:
        self.spec, self.m, self.folder = spec, model, folder
        self.changes = Changes()
        self.root = ElementTree.Element("mujoco", model=self._model_name())
        # The elements of objects that other elements may name, by their kind and number.
        self.elements: dict[tuple[str, int], ElementTree.Element] = {}
        stateful = model.actuator_actadr >= 0
        self.actuators = [*map(int, np.flatnonzero(~stateful)), *map(int, np.flatnonzero(stateful))]
        self.has_no_springs = self._disables("spring")
        self.has_no_dampers = self._disables("damper")

    # ---- What MuJoCo 2.2.2 cannot compute ----

    def refuse(self) -> None:
        m = self.m
        counts = {
            "flexes": m.nflex,
            "plug-ins": m.nplugin,
            "signed distance fields": np.count_nonzero(m.geom_type == mujoco.mjtGeom.mjGEOM_SDF),
            "plastic joints or tendons": m.nplastic,
            "actuators with delays": np.count_nonzero(m.actuator_delay) + np.count_nonzero(m.actuator_history[:, 0]),
            "actuators with several controls or forces": np.count_nonzero(m.actuator_ctrlnum != 1)
            + np.count_nonzero((m.actuator_outnum != 1) & (m.actuator_trntype != mujoco.mjtTrn.mjTRN_BODY)),
            "actuators with several activations": np.count_nonzero(m.actuator_actnum > 1),
            "geoms with a surface velocity": np.count_nonzero(m.geom_surfacevel.any(axis=1)),
            "geoms or pairs with adhesion": np.count_nonzero(m.geom_adhesion) + np.count_nonzero(m.pair_adhesion),
        }
        for what, count in counts.items():
            if count:
                raise ModelError(f"MuJoCo {ENGINE} cannot compute this model: it has {what} ({count})")

    def _known(self, what: str, names: dict[str, str], value: Any, enum: Any) -> str:
        name = enum(value).name.split("_", 1)[1]
        if name not in names:
            raise ModelError(f"MuJoCo {ENGINE} cannot compute this model: it has the {what} {name.lower()!r}")
        return names[name]

    # ---- Names ----

    def _model_name(self) -> str:
        return str(self.m.names[: self.m.names.index(b"\0")].decode())

    def _name(self, kind: str, number: int) -> str:
        enum = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
        return mujoco.mj_id2name(self.m, enum, number) or ""

    def _new(self, parent: ElementTree.Element, tag: str, kind: str, number: int) -> ElementTree.Element:
        """The element of an object, which other elements may name."""
        element = ElementTree.SubElement(parent, tag)
        if name := self._name(kind, number):
            element.set("name", name)
        self.elements[kind, number] = element
        return element

    def _reference(self, kind: str, number: int) -> str:
        """The object's name. An object without a name gets one."""
        if kind in ("body", "xbody") and number == 0:
            return "world"
        element = self.elements["body" if kind == "xbody" else kind, number]
        if "name" not in element.attrib:
            named = {one.get("name") for (other, _), one in self.elements.items() if other == kind}
            name = f"{kind}_{number}"
            while name in named:
                name += "_"
            element.set("name", name)
        return element.attrib["name"]

    # ---- The model ----

    def write(self) -> None:
        compiler = {"angle": "radian", "inertiafromgeom": "false"}
        ElementTree.SubElement(self.root, "compiler", compiler)
        self._options()
        self._sizes()
        self._visual()
        self._statistic()
        self._assets()
        self._bodies()
        for write in (self._contact, self._tendons, self._equality, self._actuators, self._sensors, self._keys):
            write()
        self._custom()
        for section in [section for section in self.root if not len(section) and not section.attrib]:
            self.root.remove(section)

    def _section(self, tag: str) -> ElementTree.Element:
        return ElementTree.SubElement(self.root, tag)

    def _disables(self, flag: str) -> bool:
        return bool(self.m.opt.disableflags & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}"))

    def _options(self) -> None:
        opt, element = self.m.opt, self._section("option")
        fresh = mujoco.MjOption()
        for name in ("timestep", "gravity", "iterations", "tolerance", "impratio"):
            put(element, name, getattr(opt, name))
        integrator = mujoco.mjtIntegrator(opt.integrator).name.split("_")[1]
        if integrator not in INTEGRATORS:
            self.changes.add(integrator.lower(), "Euler instead")
        put(element, "integrator", INTEGRATORS.get(integrator, "Euler"))
        put(element, "cone", ("pyramidal", "elliptic")[opt.cone])
        put(element, "jacobian", ("dense", "sparse", "auto")[opt.jacobian], "auto")
        put(element, "solver", ("PGS", "CG", "Newton")[opt.solver])
        defaults = {"noslip_iterations": 0, "noslip_tolerance": 1e-6, "wind": (0, 0, 0), "magnetic": (0, -0.5, 0)}
        for name, default in (defaults | {"density": 0, "viscosity": 0}).items():
            put(element, name, getattr(opt, name), default)
        overrides = bool(opt.enableflags & mujoco.mjtEnableBit.mjENBL_OVERRIDE)
        if overrides:
            for name in ("o_margin", "o_solref", "o_solimp"):
                put(element, name, getattr(opt, name))
            if not np.array_equal(opt.o_friction, fresh.o_friction):
                self.changes.add("o_friction", "the geoms' own friction")
        for name in LACKING_OPTIONS.split():
            if getattr(opt, name) != getattr(fresh, name):
                self.changes.add(name, "no effect")
        if opt.disableactuator:
            self.changes.add("actuatorgroupdisable", "all actuators act")
        self._flags(ElementTree.SubElement(element, "flag"))
        if not element[0].attrib:
            element.remove(element[0])

    def _flags(self, flag: ElementTree.Element) -> None:
        opt = self.m.opt
        for name in DISABLED.split():
            if self._disables(name):
                flag.set(name, "disable")
        enabled = {
            name.removeprefix("mjENBL_").lower()
            for name, bit in mujoco.mjtEnableBit.__members__.items()
            if not name.startswith("mjN") and opt.enableflags & int(bit)
        }
        for name in ENABLED.split():
            if name in enabled:
                flag.set(name, "enable")
        if not self._disables("multiccd"):
            flag.set("multiccd", "enable")
        for name, effect in LACKING_FLAGS.items():
            is_set = name in enabled or (
                hasattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}") and self._disables(name)
            )
            if is_set and not (name == "eulerdamp" and opt.integrator != mujoco.mjtIntegrator.mjINT_EULER):
                self.changes.add(f"flag {name}", effect)

    def _sizes(self) -> None:
        element = self._section("size")
        put(element, "nuserdata", self.m.nuserdata, 0)
        for kind in ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor"):
            put(element, f"nuser_{kind}", getattr(self.m, f"nuser_{kind}"), 0)

    def _visual(self) -> None:
        """The settings of drawing that differ from the defaults."""
        visual, fresh = self._section("visual"), mujoco.MjModel.from_xml_string("<mujoco/>").vis
        for part, names in VISUAL.items():
            element = ElementTree.SubElement(visual, part)
            group, defaults = (getattr(vis, f"{part}_" if part == "global" else part) for vis in (self.m.vis, fresh))
            for name in names.split():
                value = getattr(group, name)
                put(element, name, np.float32(value) if isinstance(value, float) else value, getattr(defaults, name))
            if not element.attrib:
                visual.remove(element)

    def _statistic(self) -> None:
        element = self._section("statistic")
        for name in ("meanmass", "meansize", "extent", "center"):  # meaninertia has no effect in MuJoCo 4.0
            value = getattr(self.spec.stat, name)
            if not np.isnan(value).any():
                put(element, name, value)

    # ---- Assets ----

    def _path(self, path: str) -> str:
        """The path of a file beside the model, relative to the folder of the output."""
        return Path(os.path.relpath(path, self.folder)).as_posix()

    def _file(self, address: int) -> str:
        """The path of an asset's file, "" if there is none."""
        return "" if address < 0 else self.m.paths[address : self.m.paths.index(b"\0", address)].decode()

    def _assets(self) -> None:
        assets = self._section("asset")
        for number in range(self.m.ntex):
            self._texture(assets, number)
        for number in range(self.m.nmat):
            self._material(assets, number)
        for number in range(self.m.nmesh):
            self._mesh(assets, number)
        for number in range(self.m.nhfield):
            file = self._file(self.m.hfield_pathadr[number])
            if not file:
                raise ModelError(f"MuJoCo {ENGINE} reads height fields from files alone; this model states elevations")
            element = self._new(assets, "hfield", "hfield", number)
            put(element, "file", self._path(file))
            put(element, "size", self.m.hfield_size[number])
        self.changes.add("skin", "not drawn", self.m.nskin)

    def _texture(self, assets: ElementTree.Element, number: int) -> None:
        texture, file = self.spec.textures[number], self._file(self.m.tex_pathadr[number])
        files = [Path(texture.compiler.texturedir, one) for one in texture.cubefiles if one]
        if files or len(texture.data) or (file and Path(file).suffix.lower() != ".png"):
            self.changes.add("texture", "not drawn")
            return
        element = self._new(assets, "texture", "texture", number)
        put(element, "type", ("2d", "cube", "skybox")[self.m.tex_type[number]])
        if file:
            put(element, "file", self._path(file))
            put(element, "gridsize", texture.gridsize, (1, 1))
            if element.get("gridsize"):
                put(element, "gridlayout", str(texture.gridlayout))
        else:
            put(element, "builtin", ("none", "gradient", "checker", "flat")[int(texture.builtin)])
            put(element, "mark", ("none", "edge", "cross", "random")[int(texture.mark)], "none")
            for name in ("rgb1", "rgb2", "markrgb", "random", "width"):
                put(element, name, getattr(texture, name))
            put(element, "height", texture.height if self.m.tex_type[number] == 0 else texture.width)
        for name in ("hflip", "vflip"):
            put(element, name, bool(getattr(texture, name)), False)

    def _material(self, assets: ElementTree.Element, number: int) -> None:
        m, element = self.m, self._new(assets, "material", "material", number)
        texture = max(int(m.mat_texid[number][role]) for role in COLOURS)
        if ("texture", texture) in self.elements:
            put(element, "texture", self._reference("texture", texture))
            put(element, "texrepeat", m.mat_texrepeat[number], (1, 1))
            put(element, "texuniform", bool(m.mat_texuniform[number]), False)
        for name, default in {
            "emission": 0,
            "specular": 0.5,
            "shininess": 0.5,
            "reflectance": 0,
            "rgba": (1, 1, 1, 1),
        }.items():
            put(element, name, getattr(m, f"mat_{name}")[number], default)

    def _mesh(self, assets: ElementTree.Element, number: int) -> None:
        m, mesh, file = self.m, self.spec.meshes[number], self._file(self.m.mesh_pathadr[number])
        element = self._new(assets, "mesh", "mesh", number)
        if mesh.maxhullvert >= 0:
            self.changes.add("maxhullvert", "the convex hull keeps all its vertices")
        if self._keeps_file(number):
            put(element, "file", self._path(file))
            for name, default in {"refpos": (0, 0, 0), "refquat": (1, 0, 0, 0), "scale": (1, 1, 1)}.items():
                put(element, name, getattr(mesh, name), default)
            put(element, "smoothnormal", bool(mesh.smoothnormal), False)
            return
        first, count = m.mesh_vertadr[number], m.mesh_vertnum[number]
        put(element, "vertex", m.mesh_vert[first : first + count])
        first, count = m.mesh_faceadr[number], m.mesh_facenum[number]
        put(element, "face", m.mesh_face[first : first + count])

    def _keeps_file(self, number: int) -> bool:
        """Whether MuJoCo 2.2.2 reads the mesh's file. If not, the text has the vertices as MuJoCo has moved them."""
        file = self._file(self.m.mesh_pathadr[number])
        return bool(file) and Path(file).suffix.lower() in MESHES

    # ---- Bodies ----

    def _bodies(self) -> None:
        m, bodies = self.m, [self._section("worldbody")]
        for body in range(m.nbody):
            if body:
                bodies.append(self._body(bodies[m.body_parentid[body]], body))
            for joint in range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body]):
                self._joint(bodies[body], joint)
            for geom in np.flatnonzero(m.geom_bodyid == body):
                self._geom(bodies[body], int(geom))
            for kind, write in (("site", self._site), ("cam", self._camera), ("light", self._light)):
                for number in np.flatnonzero(getattr(m, f"{kind}_bodyid") == body):
                    write(bodies[body], int(number))
        self.changes.add("gravcomp", "gravity acts in full", int(np.count_nonzero(m.body_gravcomp)))
        for camera in [element for (kind, _), element in self.elements.items() if kind in ("camera", "light")]:
            if "target" in camera.attrib:
                camera.set("target", self._reference("body", int(camera.attrib["target"])))

    def _body(self, parent: ElementTree.Element, body: int) -> ElementTree.Element:
        m, element = self.m, self._new(parent, "body", "body", body)
        put(element, "pos", m.body_pos[body], (0, 0, 0))
        put(element, "quat", m.body_quat[body], (1, 0, 0, 0))
        put(element, "mocap", bool(m.body_mocapid[body] >= 0), False)
        self._user(element, "body", body)
        if m.body_mass[body] > 0 or m.body_inertia[body].any():
            inertial = ElementTree.SubElement(element, "inertial")
            put(inertial, "pos", m.body_ipos[body])
            put(inertial, "quat", m.body_iquat[body], (1, 0, 0, 0))
            put(inertial, "mass", m.body_mass[body])
            put(inertial, "diaginertia", m.body_inertia[body])
        return element

    def _user(self, element: ElementTree.Element, kind: str, number: int) -> None:
        values = getattr(self.m, f"{kind}_user")
        if values.size and values[number].any():
            put(element, "user", values[number])

    def _joint(self, body: ElementTree.Element, joint: int) -> None:
        m, element = self.m, self._new(body, "joint", "joint", joint)
        kind, dof, place = JOINTS[m.jnt_type[joint]], m.jnt_dofadr[joint], m.jnt_qposadr[joint]
        put(element, "type", kind, "hinge")
        put(element, "group", m.jnt_group[joint], 0)
        if kind != "free":
            put(element, "pos", m.jnt_pos[joint], (0, 0, 0))
            put(element, "limited", bool(m.jnt_limited[joint]), False)
            put(element, "range", m.jnt_range[joint], (0, 0))
            put(element, "margin", m.jnt_margin[joint], 0)
        if kind in ("hinge", "slide"):
            put(element, "axis", m.jnt_axis[joint], (0, 0, 1))
            put(element, "ref", m.qpos0[place], 0)
            put(element, "springref", m.qpos_spring[place], 0)
        put(element, "stiffness", 0.0 if self.has_no_springs else m.jnt_stiffness[joint], 0)
        put(element, "damping", 0.0 if self.has_no_dampers else m.dof_damping[dof], 0)
        put(element, "armature", m.dof_armature[dof], 0)
        put(element, "frictionloss", m.dof_frictionloss[dof], 0)
        self._solver_of_joint(element, "limit", m.jnt_solref[joint], m.jnt_solimp[joint])
        self._solver_of_joint(element, "friction", m.dof_solref[dof], m.dof_solimp[dof])
        self._user(element, "jnt", joint)
        self.changes.add("actuatorfrcrange", "not limited", m.jnt_actfrclimited[joint])
        self.changes.add("actuatorgravcomp", "no effect", m.jnt_actgravcomp[joint])
        self.changes.add("stiffness", "linear", m.jnt_stiffnesspoly[joint].any() and not self.has_no_springs)
        self.changes.add("damping", "linear", m.dof_dampingpoly[dof].any() and not self.has_no_dampers)

    def _solver_of_joint(self, element: ElementTree.Element, what: str, solref: Any, solimp: Any) -> None:
        put(element, f"solref{what}", solref, (0.02, 1))
        put(element, f"solimp{what}", solimp, (0.9, 0.95, 0.001, 0.5, 2))

    def _contact_parameters(self, element: ElementTree.Element, prefix: str, number: int) -> None:
        m = self.m
        put(element, "solref", getattr(m, f"{prefix}_solref")[number], (0.02, 1))
        put(element, "solimp", getattr(m, f"{prefix}_solimp")[number], (0.9, 0.95, 0.001, 0.5, 2))
        put(element, "margin", getattr(m, f"{prefix}_margin")[number], 0)
        put(element, "gap", getattr(m, f"{prefix}_gap")[number], 0)

    def _geom(self, body: ElementTree.Element, geom: int) -> None:
        m, element, shape = self.m, self._new(body, "geom", "geom", geom), SHAPES[self.m.geom_type[geom]]
        put(element, "type", shape, "sphere")
        if count := SIZES.get(shape, 3):
            put(element, "size", m.geom_size[geom][:count])
        pos, quat = m.geom_pos[geom], m.geom_quat[geom]
        if shape in ("mesh", "hfield"):
            put(element, shape, self._reference(shape, int(m.geom_dataid[geom])))
        if shape == "mesh" and self._keeps_file(int(m.geom_dataid[geom])):
            pos, quat = self._before_mesh(int(m.geom_dataid[geom]), pos, quat)
        put(element, "pos", pos, (0, 0, 0))
        put(element, "quat", quat, (1, 0, 0, 0))
        defaults = {"contype": 1, "conaffinity": 1, "condim": 3, "group": 0, "priority": 0, "solmix": 1}
        for name, default in defaults.items():
            put(element, name, getattr(m, f"geom_{name}")[geom], default)
        put(element, "friction", m.geom_friction[geom], (1, 0.005, 0.0001))
        self._contact_parameters(element, "geom", geom)
        self._appearance(element, "geom", geom)
        if m.geom_fluid[geom][0]:
            put(element, "fluidshape", "ellipsoid")
            put(element, "fluidcoef", m.geom_fluid[geom][1:6])
        self._user(element, "geom", geom)
        self.changes.add("margin", "of two geoms the greater one, not the sum", m.geom_margin[geom] != 0)

    def _before_mesh(self, mesh: int, pos: Any, quat: Any) -> tuple[Any, Any]:
        """The frame of a geom before MuJoCo moved it to the principal axes of its mesh."""
        inverse, given, shift = np.zeros(4), np.zeros(4), np.zeros(3)
        mujoco.mju_negQuat(inverse, self.m.mesh_quat[mesh].astype(float))
        mujoco.mju_mulQuat(given, quat, inverse)
        mujoco.mju_normalize4(given)
        mujoco.mju_rotVecQuat(shift, self.m.mesh_pos[mesh].astype(float), given)
        return pos - shift, given

    def _appearance(self, element: ElementTree.Element, kind: str, number: int) -> None:
        material = int(getattr(self.m, f"{kind}_matid")[number])
        if material >= 0:
            put(element, "material", self._reference("material", material))
        put(element, "rgba", getattr(self.m, f"{kind}_rgba")[number], (0.5, 0.5, 0.5, 1))

    def _site(self, body: ElementTree.Element, site: int) -> None:
        m, element = self.m, self._new(body, "site", "site", site)
        put(element, "type", SHAPES[m.site_type[site]] if m.site_type[site] < 7 else "sphere", "sphere")
        put(element, "size", m.site_size[site], (0.005, 0.005, 0.005))
        put(element, "pos", m.site_pos[site], (0, 0, 0))
        put(element, "quat", m.site_quat[site], (1, 0, 0, 0))
        put(element, "group", m.site_group[site], 0)
        self._appearance(element, "site", site)
        self._user(element, "site", site)

    def _target(self, element: ElementTree.Element, kind: str, number: int) -> None:
        put(element, "mode", CAMERA_MODES[getattr(self.m, f"{kind}_mode")[number]], "fixed")
        target = int(getattr(self.m, f"{kind}_targetbodyid")[number])
        if target >= 0:
            element.set("target", str(target))  # _bodies replaces this by the body's name

    def _camera(self, body: ElementTree.Element, camera: int) -> None:
        m, element = self.m, self._new(body, "camera", "camera", camera)
        put(element, "pos", m.cam_pos[camera], (0, 0, 0))
        put(element, "quat", m.cam_quat[camera], (1, 0, 0, 0))
        put(element, "fovy", m.cam_fovy[camera], 45)
        put(element, "ipd", m.cam_ipd[camera], 0.068)
        self._target(element, "cam", camera)
        self._user(element, "cam", camera)
        self.changes.add("orthographic camera", "drawn in perspective", m.cam_projection[camera])

    def _light(self, body: ElementTree.Element, light: int) -> None:
        m, element = self.m, self._new(body, "light", "light", light)
        put(element, "pos", m.light_pos[light])
        put(element, "dir", m.light_dir[light])
        put(element, "directional", bool(m.light_type[light] == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL), False)
        for name in ("castshadow", "active"):
            put(element, name, bool(getattr(m, f"light_{name}")[light]), True)
        for name in ("attenuation", "cutoff", "exponent", "ambient", "diffuse", "specular"):
            put(element, name, getattr(m, f"light_{name}")[light])
        self._target(element, "light", light)

    # ---- Connections of bodies ----

    def _contact(self) -> None:
        m, contact = self.m, self._section("contact")
        for pair in range(m.npair):
            element = self._new(contact, "pair", "pair", pair)
            for side in ("geom1", "geom2"):
                put(element, side, self._reference("geom", int(getattr(m, f"pair_{side}")[pair])))
            put(element, "condim", m.pair_dim[pair], 3)
            put(element, "friction", m.pair_friction[pair])
            self._contact_parameters(element, "pair", pair)
            self.changes.add("solreffriction", "solref instead", m.pair_solreffriction[pair].any())
        for number, signature in enumerate(m.exclude_signature):
            element = self._new(contact, "exclude", "exclude", number)
            put(element, "body1", self._reference("body", int(signature) >> 16))
            put(element, "body2", self._reference("body", int(signature) & 0xFFFF))

    def _tendons(self) -> None:
        m, tendons = self.m, self._section("tendon")
        for tendon in range(m.ntendon):
            path = range(m.tendon_adr[tendon], m.tendon_adr[tendon] + m.tendon_num[tendon])
            is_fixed = m.wrap_type[path[0]] == mujoco.mjtWrap.mjWRAP_JOINT
            element = self._new(tendons, "fixed" if is_fixed else "spatial", "tendon", tendon)
            put(element, "group", m.tendon_group[tendon], 0)
            put(element, "limited", bool(m.tendon_limited[tendon]), False)
            put(element, "range", m.tendon_range[tendon], (0, 0))
            put(element, "margin", m.tendon_margin[tendon], 0)
            put(element, "stiffness", 0.0 if self.has_no_springs else m.tendon_stiffness[tendon], 0)
            put(element, "damping", 0.0 if self.has_no_dampers else m.tendon_damping[tendon], 0)
            put(element, "frictionloss", m.tendon_frictionloss[tendon], 0)
            low, high = m.tendon_lengthspring[tendon]
            put(element, "springlength", (low + high) / 2)
            if low != high and m.tendon_stiffness[tendon]:
                self.changes.add("springlength", "the middle of the range")
            self._solver_of_joint(element, "limit", m.tendon_solref_lim[tendon], m.tendon_solimp_lim[tendon])
            self._solver_of_joint(element, "friction", m.tendon_solref_fri[tendon], m.tendon_solimp_fri[tendon])
            if not is_fixed:
                put(element, "width", m.tendon_width[tendon], 0.003)
                self._appearance(element, "tendon", tendon)
            self._user(element, "tendon", tendon)
            self.changes.add("tendon armature", "none", m.tendon_armature[tendon] != 0)
            self.changes.add("tendon actuatorfrcrange", "not limited", m.tendon_actfrclimited[tendon])
            self.changes.add("tendon stiffness", "linear", m.tendon_stiffnesspoly[tendon].any())
            self.changes.add("tendon damping", "linear", m.tendon_dampingpoly[tendon].any())
            for wrap in path:
                self._wrap(element, wrap)

    def _wrap(self, tendon: ElementTree.Element, wrap: int) -> None:
        m = self.m
        kind, number, value = mujoco.mjtWrap(m.wrap_type[wrap]), int(m.wrap_objid[wrap]), m.wrap_prm[wrap]
        if kind == mujoco.mjtWrap.mjWRAP_JOINT:
            joint = {"joint": self._reference("joint", number), "coef": text_of(value)}
            ElementTree.SubElement(tendon, "joint", joint)
        elif kind == mujoco.mjtWrap.mjWRAP_PULLEY:
            ElementTree.SubElement(tendon, "pulley", divisor=text_of(value))
        elif kind == mujoco.mjtWrap.mjWRAP_SITE:
            ElementTree.SubElement(tendon, "site", site=self._reference("site", number))
        else:
            geom = ElementTree.SubElement(tendon, "geom", geom=self._reference("geom", number))
            if value >= 0:
                geom.set("sidesite", self._reference("site", int(value)))

    def _equality(self) -> None:
        m, equality = self.m, self._section("equality")
        for number in range(m.neq):
            kind = mujoco.mjtEq(m.eq_type[number]).name.removeprefix("mjEQ_").lower()
            if kind not in ("connect", "weld", "joint", "tendon"):
                raise ModelError(f"MuJoCo {ENGINE} cannot compute this model: it has an equality of the kind {kind!r}")
            objects = [int(m.eq_obj1id[number]), int(m.eq_obj2id[number])]
            at_sites = m.eq_objtype[number] == mujoco.mjtObj.mjOBJ_SITE
            # MuJoCo 2.2.2 connects bodies only at points that coincide in qpos0. A weld without torque is the same
            # constraint of any two points.
            element = self._new(equality, "weld" if at_sites else kind, "equality", number)
            if kind in ("joint", "tendon"):
                for side, one in enumerate(objects, 1):
                    if one >= 0:
                        put(element, f"{kind}{side}", self._reference(kind, one))
                put(element, "polycoef", m.eq_data[number][:5])
            elif at_sites:
                self._weld_sites(element, objects, m.eq_data[number][10] if kind == "weld" else 0.0)
            else:
                for side, one in enumerate(objects, 1):
                    put(element, f"body{side}", self._reference("body", one))
                put(element, "anchor", m.eq_data[number][:3])
                if kind == "weld":
                    put(element, "relpose", m.eq_data[number][3:10])
                    put(element, "torquescale", m.eq_data[number][10])
            put(element, "active", bool(m.eq_active0[number]), True)
            put(element, "solref", m.eq_solref[number], (0.02, 1))
            put(element, "solimp", m.eq_solimp[number], (0.9, 0.95, 0.001, 0.5, 2))

    def _weld_sites(self, element: ElementTree.Element, sites: list[int], torquescale: float) -> None:
        """Holds the frames of two sites together, as parts of their bodies."""
        site1, site2 = sites
        m, inverse, turn = self.m, np.zeros(4), np.zeros(4)
        mujoco.mju_negQuat(inverse, m.site_quat[site2])
        mujoco.mju_mulQuat(turn, m.site_quat[site1], inverse)
        put(element, "body1", self._reference("body", int(m.site_bodyid[site1])))
        put(element, "body2", self._reference("body", int(m.site_bodyid[site2])))
        put(element, "anchor", m.site_pos[site2])
        put(element, "relpose", np.concatenate([m.site_pos[site1], turn]))
        put(element, "torquescale", torquescale)

    # ---- Actuators, sensors and the rest ----

    def _actuators(self) -> None:
        m, actuators = self.m, self._section("actuator")
        for actuator in self.actuators:
            element = self._new(actuators, "general", "actuator", actuator)
            self._transmission(element, actuator)
            for what in ("ctrl", "force", "act"):
                limited = bool(getattr(m, f"actuator_{what}limited")[actuator])
                put(element, f"{what}limited", limited, False)
                put(element, f"{what}range", getattr(m, f"actuator_{what}range")[actuator], (0, 0))
            for name, default in {
                "lengthrange": (0, 0),
                "gear": (1, 0, 0, 0, 0, 0),
                "cranklength": 0,
                "group": 0,
            }.items():
                put(element, name, getattr(m, f"actuator_{name}")[actuator], default)
            kinds = (
                ("dyn", DYNAMICS, mujoco.mjtDyn),
                ("gain", GAINS, mujoco.mjtGain),
                ("bias", BIASES, mujoco.mjtBias),
            )
            for what, names, enum in kinds:
                value = getattr(m, f"actuator_{what}type")[actuator]
                put(element, f"{what}type", self._known(f"actuator's {what}type", names, value, enum))
                put(element, f"{what}prm", getattr(m, f"actuator_{what}prm")[actuator])
            self._user(element, "actuator", actuator)
            self.changes.add(
                "filterexact", "filter instead", m.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_FILTEREXACT
            )
            self.changes.add("actearly", "no effect", m.actuator_actearly[actuator])
            damps = m.actuator_damping[actuator] != 0 or m.actuator_dampingpoly[actuator].any()
            self.changes.add("actuator damping", "none", damps)
            self.changes.add("actuator armature", "none", m.actuator_armature[actuator] != 0)
        if self.actuators != sorted(self.actuators):
            order = " ".join(self._name("actuator", one) or str(one) for one in self.actuators)
            self.changes.add("actuators", f"those with activation come last, so the controls are {order}")

    def _transmission(self, element: ElementTree.Element, actuator: int) -> None:
        (first, second), kind = map(int, self.m.actuator_trnid[actuator]), self.m.actuator_trntype[actuator]
        names = {"JOINT": "joint", "JOINTINPARENT": "jointinparent", "TENDON": "tendon", "BODY": "body", "SITE": "site"}
        attribute = self._known("transmission", names | {"SLIDERCRANK": "cranksite"}, kind, mujoco.mjtTrn)
        of = {"jointinparent": "joint", "cranksite": "site"}
        put(element, attribute, self._reference(of.get(attribute, attribute), first))
        if attribute in ("site", "cranksite") and second >= 0:
            put(element, "refsite" if attribute == "site" else "slidersite", self._reference("site", second))

    def _sensors(self) -> None:
        m, sensors = self.m, self._section("sensor")
        for number in range(m.nsensor):
            kind = mujoco.mjtSensor(m.sensor_type[number]).name.removeprefix("mjSENS_").lower()
            objtype, reftype = (
                mujoco.mjtObj(types[number]).name.removeprefix("mjOBJ_").lower()
                for types in (m.sensor_objtype, m.sensor_reftype)
            )
            if kind not in SENSORS or (kind == "rangefinder" and (objtype != "site" or m.sensor_dim[number] != 1)):
                self.changes.add(f"{kind} sensor", "left out of sensordata")
                continue
            element = self._new(sensors, kind, "sensor", number)
            if SENSORS[kind]:
                put(element, SENSORS[kind], self._reference(SENSORS[kind], int(m.sensor_objid[number])))
            elif kind.startswith("frame"):
                put(element, "objtype", objtype)
                put(element, "objname", self._reference(objtype, int(m.sensor_objid[number])))
                if reftype in OBJECTS and m.sensor_refid[number] >= 0:
                    put(element, "reftype", reftype)
                    put(element, "refname", self._reference(reftype, int(m.sensor_refid[number])))
            put(element, "cutoff", m.sensor_cutoff[number], 0)
            put(element, "noise", m.sensor_noise[number], 0)
            self._user(element, "sensor", number)
            late = m.sensor_delay[number] != 0 or m.sensor_interval[number].any() or m.sensor_history[number].any()
            self.changes.add("sensor delay", "none", late)

    def _keys(self) -> None:
        m, keys = self.m, self._section("keyframe")
        activations = [m.actuator_actadr[one] for one in self.actuators if m.actuator_actadr[one] >= 0]
        for number in range(m.nkey):
            element = self._new(keys, "key", "key", number)
            put(element, "time", m.key_time[number], 0)
            values = {"qpos": m.key_qpos, "qvel": m.key_qvel, "mpos": m.key_mpos, "mquat": m.key_mquat}
            values |= {"act": m.key_act[:, activations], "ctrl": m.key_ctrl[:, self.actuators]}
            for name, rows in values.items():
                if rows.shape[1]:
                    put(element, name, rows[number])

    def _custom(self) -> None:
        m, custom = self.m, self._section("custom")
        for number in range(m.nnumeric):
            first, size = m.numeric_adr[number], m.numeric_size[number]
            put(self._new(custom, "numeric", "numeric", number), "data", m.numeric_data[first : first + size])
        for number in range(m.ntext):
            first, size = m.text_adr[number], m.text_size[number]
            data = bytes(m.text_data[first : first + size]).split(b"\0")[0].decode()
            put(self._new(custom, "text", "text", number), "data", data)
        for number in range(m.ntuple):
            self._tuple(custom, number)

    def _tuple(self, custom: ElementTree.Element, number: int) -> None:
        m, element = self.m, self._new(custom, "tuple", "tuple", number)
        for place in range(m.tuple_adr[number], m.tuple_adr[number] + m.tuple_size[number]):
            kind = mujoco.mjtObj(m.tuple_objtype[place]).name.removeprefix("mjOBJ_").lower()
            if (kind, int(m.tuple_objid[place])) not in self.elements:
                self.changes.add(f"tuple's {kind}", "left out")
                continue
            one = ElementTree.SubElement(element, "element", objtype=kind)
            put(one, "objname", self._reference(kind, int(m.tuple_objid[place])))
            put(one, "prm", m.tuple_objprm[place], 0)

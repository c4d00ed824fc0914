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
PREFIXES = {"joint": "jnt", "camera": "cam", "material": "mat", "equality": "eq"}  # of arrays
SOLVER = {"solref": (0.02, 1), "solimp": (0.9, 0.95, 0.001, 0.5, 2)}
FRAME = {"pos": (0, 0, 0), "quat": (1, 0, 0, 0)}
# The attributes that are called as their arrays, with the defaults of MuJoCo 2.2.2; None: always written.
ATTRIBUTES: dict[str, dict[str, Any]] = {
    "option": dict.fromkeys("timestep gravity iterations tolerance impratio".split())
    | {"noslip_iterations": 0, "noslip_tolerance": 1e-6, "wind": (0, 0, 0), "magnetic": (0, -0.5, 0)}
    | {"density": 0, "viscosity": 0},
    "hfield": {"size": None},
    "material": {"emission": 0, "specular": 0.5, "shininess": 0.5, "reflectance": 0, "rgba": (1, 1, 1, 1)},
    "body": FRAME,
    "joint": {"group": 0, "pos": (0, 0, 0), "margin": 0},
    "geom": {"contype": 1, "conaffinity": 1, "condim": 3, "group": 0, "priority": 0, "solmix": 1}
    | {"friction": (1, 0.005, 0.0001)}
    | SOLVER,
    "site": {"size": (0.005, 0.005, 0.005), "group": 0} | FRAME,
    "camera": {"fovy": 45, "ipd": 0.068} | FRAME,
    "light": dict.fromkeys("pos dir attenuation cutoff exponent ambient diffuse specular".split())
    | {"castshadow": True, "active": True},
    "pair": {"friction": None} | SOLVER,
    "tendon": {"group": 0, "margin": 0, "frictionloss": 0},
    "equality": SOLVER,
    "actuator": {"lengthrange": (0, 0), "gear": (1, 0, 0, 0, 0, 0), "cranklength": 0, "group": 0},
    "sensor": {"cutoff": 0, "noise": 0},
}
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "mesh": 0, "hfield": 0}  # numbers of a size; other shapes have 3
INTEGRATORS = {"EULER": "Euler", "RK4": "RK4", "IMPLICIT": "implicit"}
COLOURS = int(mujoco.mjtTextureRole.mjTEXROLE_RGB), int(mujoco.mjtTextureRole.mjTEXROLE_RGBA)
# The kinds of actuators.
KINDS = {
    "dyn": "none integrator filter filterexact muscle",
    "gain": "fixed affine muscle",
    "bias": "none affine muscle",
}
TRANSMISSIONS = "joint jointinparent tendon body site slidercrank"
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
    "user": "",
}
STAGES = ("none", "pos", "vel", "acc")
DATATYPES = ("real", "positive", "axis", "quaternion")
# The pairs of shapes whose contacts are the same, and how those of others differ.
SAME_CONTACTS = (
    "plane-sphere plane-capsule plane-ellipsoid plane-cylinder plane-box sphere-sphere sphere-capsule capsule-capsule"
)
CONTACTS = dict.fromkeys(("sphere-box", "capsule-box"), "other depths once a centre is inside the box")
LIBCCD = (
    "sphere-ellipsoid capsule-ellipsoid capsule-cylinder ellipsoid-ellipsoid ellipsoid-cylinder ellipsoid-box "
    "cylinder-cylinder cylinder-box"  # the same if the flag nativeccd is disabled
)

# The arrays in which a number other than 0, or than the one given here, is a feature that MuJoCo 2.2.2 lacks.
IMPOSSIBLE = {
    "flexes": "nflex",
    "plug-ins": "nplugin",
    "plastic joints or tendons": "nplastic",
    "actuators with delays": "actuator_delay actuator_historyadr=-1",
    "actuators with several controls or forces": "actuator_ctrlnum=1 actuator_outnum=1",
    "geoms with a surface velocity": "geom_surfacevel",
    "geoms or pairs with adhesion": "geom_adhesion pair_adhesion",
}
LACKING = {
    "gravcomp: gravity acts in full": "body_gravcomp",
    "actuatorfrcrange: not limited": "jnt_actfrclimited",
    "actuatorgravcomp: no effect": "jnt_actgravcomp",
    "stiffness: linear": "jnt_stiffnesspoly",
    "damping: linear": "dof_dampingpoly",
    "solreffriction: solref instead": "pair_solreffriction",
    "tendon armature: none": "tendon_armature",
    "tendon actuatorfrcrange: not limited": "tendon_actfrclimited",
    "tendon stiffness: linear": "tendon_stiffnesspoly",
    "tendon damping: linear": "tendon_dampingpoly",
    "actuator damping: none": "actuator_damping actuator_dampingpoly",
    "actuator armature: none": "actuator_armature",
    "sensor delay: none": "sensor_delay sensor_interval",
    "skin: not drawn": "nskin",
    "castshadow: geoms cast shadows": "geom_castshadow=1",
    "orthographic camera: drawn in perspective": "cam_projection",
    "sensorsize: the camera has the same fovy": "cam_sensorsize",
    "texture of a light: not drawn": "light_texid=-1",
}
IGNORED = (
    "cam_output=1 cam_resolution=1 light_bulbradius=0.02 light_intensity light_range=10 light_softness=0.2 "
    "mat_metallic=-1 mat_roughness=-1 tex_colorspace actuator_actearly"
)
LACKING_OPTIONS = (
    "ls_iterations ls_tolerance ccd_iterations ccd_tolerance sdf_iterations sdf_initpoints sleep_tolerance"
)
# The flags of both versions, and the meanings of those that MuJoCo 2.2.2 lacks.
DISABLED = (
    "constraint equality frictionloss limit contact gravity clampctrl warmstart filterparent actuation refsafe sensor"
)
ENABLED = "override energy fwdinv"
LACKING_FLAGS = {
    "actuation": "the velocities of actuators are 0",
    "eulerdamp": "Euler always integrates damping implicitly",
    "midphase": "no effect",
    "autoreset": "no effect",
    "island": "no effect",
    "invdiscrete": "no effect",
    "sleep": "bodies never sleep",
    "diagexact": "constraints have an approximate diagonal",
    "ipc": "no effect",
    "speculative": "no speculative contacts",
}

VISUAL = ("global", "quality", "headlight", "map", "scale", "rgba")
LACKING_VISUAL = "bv bvactive cameraid ellipsoidinertia frustum orthographic realtime".split()


def text_of(value: Any) -> str:
    """A value as text in MJCF. Numbers have enough digits to be read back with the same bits."""
    if isinstance(value, str):
        return value
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if np.ndim(value):
        return " ".join(text_of(number) for number in np.ravel(value))
    return str(value).removesuffix(".0")


def put(element: ElementTree.Element, name: str, value: Any, default: Any = None) -> None:
    """Writes an attribute, unless MuJoCo 2.2.2 has the same default."""
    if not isinstance(value, str) and not np.isfinite(value).all():
        raise ModelError(f"MuJoCo {ENGINE} cannot read this model: {name!r} of a <{element.tag}> is not finite")
    if default is None or not np.array_equal(value, np.asarray(default, getattr(value, "dtype", None))):
        element.set(name, text_of(value))


def converted(spec: Any, model: Any, folder: Path) -> tuple[str, list[dict[str, Any]], list[int]]:
    """Converts a compiled model.

    Returns MJCF for MuJoCo 2.2.2, for a file in that folder; what changes; and for each actuator, the index of the
    model's actuator. Raises ModelError for what MuJoCo 2.2.2 cannot compute.
    """
    writer = _Writer(spec, model, folder)
    writer.refuse()
    writer.write()
    ElementTree.indent(writer.root)
    changes = [
        dict(zip(("what", "effect"), line.split(": ", 1), strict=True), times=times)
        for line, times in writer.changes.items()
    ]
    return ElementTree.tostring(writer.root, "unicode") + "\n", changes, writer.actuators


class _Writer:
    def __init__(self, spec: Any, model: Any, folder: Path) -> None:
        self.spec, self.m, self.folder = spec, model, folder
        self.changes: Counter[str] = Counter()
        self.root = ElementTree.Element("mujoco", model=self._model_name())
        # The elements of objects that other elements may name, by their kind and number.
        self.elements: dict[tuple[str, int], ElementTree.Element] = {}
        stateful = model.actuator_actadr >= 0
        self.actuators = [*map(int, np.flatnonzero(~stateful)), *map(int, np.flatnonzero(stateful))]
        # The flags that are not at their defaults.
        bits = mujoco.mjtDisableBit.__members__.items(), mujoco.mjtEnableBit.__members__.items()
        self.flags = {
            name.split("_")[1].lower()
            for flags, names in zip((model.opt.disableflags, model.opt.enableflags), bits, strict=True)
            for name, bit in names
            if "_" in name and flags & int(bit)
        }

    # ---- What MuJoCo 2.2.2 cannot compute ----

    def refuse(self) -> None:
        counts = {what: self._count(arrays) for what, arrays in IMPOSSIBLE.items()}
        counts["signed distance fields"] = int(np.count_nonzero(self.m.geom_type >= len(SHAPES)))
        for what, count in counts.items():
            if count:
                raise ModelError(f"MuJoCo {ENGINE} cannot compute this model: it has {what} ({count})")

    def _count(self, arrays: str) -> int:
        """How many objects have another number than the default in one of these arrays."""
        found: int = 0
        for name, _, default in (word.partition("=") for word in arrays.split()):
            array = np.asarray(getattr(self.m, name))
            rows = (array != float(default or 0)).any(axis=tuple(range(1, array.ndim)))
            found = max(found, int(array if array.ndim == 0 else np.count_nonzero(rows)))
        return found

    def _change(self, line: str, times: Any = 1) -> None:
        if times:
            self.changes[line] += int(times)

    def _known(self, what: str, names: str, value: Any, enum: Any) -> str:
        name = str(enum(value).name.split("_", 1)[1].lower())
        if name not in names.split():
            raise ModelError(f"MuJoCo {ENGINE} cannot compute this model: it has the {what} {name!r}")
        return name

    # ---- Names ----

    def _model_name(self) -> str:
        return str(self.m.names[: self.m.names.index(b"\0")].decode())

    def _name(self, kind: str, number: int) -> str:
        enum = getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}")
        return mujoco.mj_id2name(self.m, enum, number) or ""

    def _new(self, parent: ElementTree.Element, tag: str, kind: str, number: int) -> ElementTree.Element:
        """The element of an object, which other elements may name, with its name and ATTRIBUTES."""
        element, array = ElementTree.SubElement(parent, tag), PREFIXES.get(kind, kind)
        if name := self._name(kind, number):
            element.set("name", name)
        for name, default in ATTRIBUTES.get(kind, {}).items():
            put(element, name, getattr(self.m, f"{array}_{name}")[number], default)
        users = getattr(self.m, f"{array}_user", None)
        if users is not None and users[number].any():
            put(element, "user", users[number])
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
        self._collisions()
        ignored = {f"{word.split('=')[0].replace('_', ' ')}: no effect": word for word in IGNORED.split()}
        for line, arrays in (LACKING | ignored).items():
            self._change(line, self._count(arrays))
        for section in [section for section in self.root if not len(section) and not section.attrib]:
            self.root.remove(section)

    def _section(self, tag: str) -> ElementTree.Element:
        return ElementTree.SubElement(self.root, tag)

    def _options(self) -> None:
        opt, element = self.m.opt, self._section("option")
        fresh = mujoco.MjOption()
        for name, default in ATTRIBUTES["option"].items():
            put(element, name, getattr(opt, name), default)
        integrator = mujoco.mjtIntegrator(opt.integrator).name.split("_")[1]
        if integrator not in INTEGRATORS:
            self._change(f"{integrator.lower()}: Euler instead")
        damps = (self.m.actuator_gainprm[:, 2] != 0) | (self.m.actuator_biasprm[:, 2] != 0)
        limits = damps & (self.m.actuator_ctrllimited | self.m.actuator_forcelimited)
        self._change(
            "implicit: limits of actuators do not limit their damping", integrator == "IMPLICIT" and limits.any()
        )
        self._change(
            "RK4: ball and free joints are integrated less exactly", integrator == "RK4" and self.m.nq > self.m.nv
        )
        put(element, "integrator", INTEGRATORS.get(integrator, "Euler"))
        put(element, "cone", ("pyramidal", "elliptic")[opt.cone])
        put(element, "jacobian", ("dense", "sparse", "auto")[opt.jacobian], "auto")
        solver = ("PGS", "CG", "Newton")[opt.solver]
        put(element, "solver", solver)
        if solver != "Newton" or opt.iterations < fresh.iterations or opt.tolerance > fresh.tolerance:
            self._change(f"{solver}: other forces where it stops before it has converged")
        if "override" in self.flags:
            for name in ("o_margin", "o_solref", "o_solimp"):
                put(element, name, getattr(opt, name))
            self._change("o_friction: the geoms' own friction", not np.array_equal(opt.o_friction, fresh.o_friction))
            self._change("gap with o_margin: no contacts within the gap", self._count("geom_gap pair_gap"))
        for name in LACKING_OPTIONS.split():
            self._change(f"{name}: no effect", getattr(opt, name) != getattr(fresh, name))
        self._change("actuatorgroupdisable: all actuators act", opt.disableactuator != 0)
        self._flags(ElementTree.SubElement(element, "flag"))
        if not element[0].attrib:
            element.remove(element[0])

    def _flags(self, flag: ElementTree.Element) -> None:
        for names, word in ((DISABLED, "disable"), (ENABLED, "enable")):
            for name in names.split():
                if name in self.flags:
                    flag.set(name, word)
        if "multiccd" not in self.flags:
            flag.set("multiccd", "enable")
        euler = self.m.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER
        for name, effect in LACKING_FLAGS.items():
            self._change(f"flag {name}: {effect}", name in self.flags and (euler or name != "eulerdamp"))

    def _sizes(self) -> None:
        element = self._section("size")
        put(element, "nuserdata", self.m.nuserdata, 0)
        for name in ("nconmax", "njmax"):
            put(element, name, getattr(self.m, name), -1)
        for kind in ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor"):
            put(element, f"nuser_{kind}", getattr(self.m, f"nuser_{kind}"), 0)

    def _visual(self) -> None:
        """The settings of drawing that differ from the defaults."""
        visual, fresh = self._section("visual"), mujoco.MjModel.from_xml_string("<mujoco/>").vis
        for part in VISUAL:
            element = ElementTree.SubElement(visual, part)
            group, defaults = (getattr(vis, f"{part}_" if part == "global" else part) for vis in (self.m.vis, fresh))
            for name in [name for name in dir(group) if not name.startswith("_")]:
                value, default = getattr(group, name), getattr(defaults, name)
                if name not in LACKING_VISUAL:
                    put(element, name, np.float32(value) if isinstance(value, float) else value, default)
                elif not np.array_equal(value, default):
                    self._change(f"{part} {name}: no effect")
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
                raise ModelError(
                    f"MuJoCo {ENGINE} reads height fields from files alone; this model has one without a file"
                )
            element = self._new(assets, "hfield", "hfield", number)
            put(element, "file", self._path(file))

    def _texture(self, assets: ElementTree.Element, number: int) -> None:
        texture, file = self.spec.textures[number], self._file(self.m.tex_pathadr[number])
        files = [Path(texture.compiler.texturedir, one) for one in texture.cubefiles if one]
        if files or len(texture.data) or (file and Path(file).suffix.lower() != ".png"):
            self._change("texture: not drawn")
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

    def _mesh(self, assets: ElementTree.Element, number: int) -> None:
        m, mesh, file = self.m, self.spec.meshes[number], self._file(self.m.mesh_pathadr[number])
        element = self._new(assets, "mesh", "mesh", number)
        self._change("maxhullvert: the convex hull keeps all its vertices", mesh.maxhullvert >= 0)
        if self._keeps_file(number):
            put(element, "file", self._path(file))
            for name, default in {"refpos": (0, 0, 0), "refquat": (1, 0, 0, 0), "scale": (1, 1, 1)}.items():
                put(element, name, getattr(mesh, name), default)
            put(element, "smoothnormal", bool(mesh.smoothnormal), False)
            return
        self._change("texcoord, normal: not drawn", len(mesh.usertexcoord) or len(mesh.usernormal))
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
        for camera in [element for (kind, _), element in self.elements.items() if kind in ("camera", "light")]:
            if "target" in camera.attrib:
                camera.set("target", self._reference("body", int(camera.attrib["target"])))

    def _body(self, parent: ElementTree.Element, body: int) -> ElementTree.Element:
        m, element = self.m, self._new(parent, "body", "body", body)
        put(element, "mocap", bool(m.body_mocapid[body] >= 0), False)
        if m.body_mass[body] > 0 or m.body_inertia[body].any():
            inertial = ElementTree.SubElement(element, "inertial")
            put(inertial, "pos", m.body_ipos[body])
            put(inertial, "quat", m.body_iquat[body], (1, 0, 0, 0))
            put(inertial, "mass", m.body_mass[body])
            put(inertial, "diaginertia", m.body_inertia[body])
        return element

    def _limits(self, element: ElementTree.Element, array: str, number: int, what: str = "") -> None:
        """Writes that a range is not a limit, because MuJoCo 2.2.2 refuses a range without that word."""
        limits = getattr(self.m, f"{array}_{what}range")[number]
        if limits.any():
            put(element, f"{what}limited", bool(getattr(self.m, f"{array}_{what}limited")[number]))
            put(element, f"{what}range", limits)

    def _joint(self, body: ElementTree.Element, joint: int) -> None:
        m, element = self.m, self._new(body, "joint", "joint", joint)
        kind, dof, place = JOINTS[m.jnt_type[joint]], m.jnt_dofadr[joint], m.jnt_qposadr[joint]
        put(element, "type", kind, "hinge")
        self._limits(element, "jnt", joint)
        if kind in ("hinge", "slide"):
            put(element, "axis", m.jnt_axis[joint], (0, 0, 1))
            put(element, "ref", m.qpos0[place], 0)
            put(element, "springref", m.qpos_spring[place], 0)
        put(element, "stiffness", 0.0 if "spring" in self.flags else m.jnt_stiffness[joint], 0)
        put(element, "damping", 0.0 if "damper" in self.flags else m.dof_damping[dof], 0)
        put(element, "armature", m.dof_armature[dof], 0)
        put(element, "frictionloss", m.dof_frictionloss[dof], 0)
        self._solver_of_joint(element, "limit", m.jnt_solref[joint], m.jnt_solimp[joint])
        self._solver_of_joint(element, "friction", m.dof_solref[dof], m.dof_solimp[dof])

    def _solver_of_joint(self, element: ElementTree.Element, what: str, solref: Any, solimp: Any) -> None:
        put(element, f"solref{what}", solref, SOLVER["solref"])
        put(element, f"solimp{what}", solimp, SOLVER["solimp"])

    def _margins(self, element: ElementTree.Element, array: str, number: int) -> None:
        """Since MuJoCo 3.9 contacts begin to have forces at the margin; before, at the margin minus the gap.

        MuJoCo 2.2.2 also subtracts the gap from o_margin.
        """
        margin, gap = getattr(self.m, f"{array}_margin")[number], getattr(self.m, f"{array}_gap")[number]
        put(element, "margin", margin if "override" in self.flags else margin + gap, 0)
        put(element, "gap", 0.0 if "override" in self.flags else gap, 0)

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
        self._margins(element, "geom", geom)
        self._appearance(element, "geom", geom)
        if m.geom_fluid[geom][0]:
            put(element, "fluidshape", "ellipsoid")
            put(element, "fluidcoef", m.geom_fluid[geom][1:6])

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
        self._change("mesh of a site: a sphere", m.site_type[site] >= 7)
        self._appearance(element, "site", site)

    def _target(self, element: ElementTree.Element, kind: str, number: int) -> None:
        put(element, "mode", CAMERA_MODES[getattr(self.m, f"{kind}_mode")[number]], "fixed")
        target = int(getattr(self.m, f"{kind}_targetbodyid")[number])
        if target >= 0:
            element.set("target", str(target))  # _bodies replaces this by the body's name

    def _camera(self, body: ElementTree.Element, camera: int) -> None:
        self._target(self._new(body, "camera", "camera", camera), "cam", camera)

    def _light(self, body: ElementTree.Element, light: int) -> None:
        kind, element = self.m.light_type[light], self._new(body, "light", "light", light)
        put(element, "directional", bool(kind == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL), False)
        self._change("light type: spot instead", kind > int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL))
        self._target(element, "light", light)

    # ---- Connections of bodies ----

    def _contact(self) -> None:
        m, contact = self.m, self._section("contact")
        for pair in range(m.npair):
            element = self._new(contact, "pair", "pair", pair)
            for side in ("geom1", "geom2"):
                put(element, side, self._reference("geom", int(getattr(m, f"pair_{side}")[pair])))
            put(element, "condim", m.pair_dim[pair], 3)
            self._margins(element, "pair", pair)
        excluded = [(signature >> 16, signature & 0xFFFF) for signature in map(int, m.exclude_signature)]
        for number, sides in enumerate(excluded + sorted(self._mocap_pairs() - {*excluded})):
            element = self._new(contact, "exclude", "exclude", number)
            for side, body in zip(("body1", "body2"), sides, strict=True):
                put(element, side, self._reference("body", body))

    def _mocap_pairs(self) -> set[tuple[int, int]]:
        """The mocap bodies with their children, between which MuJoCo 4.0 finds no contacts."""
        if "filterparent" in self.flags:
            return set()
        group = self.m.body_weldid  # the first of the bodies without joints between them
        return {
            (int(one), int(other))
            for child in {*map(int, group)} - {0}
            for parent in [group[self.m.body_parentid[child]]]
            if self.m.body_mocapid[parent] >= 0
            for one in np.flatnonzero(group == parent)
            for other in np.flatnonzero(group == child)
        }

    def _collisions(self) -> None:
        """Which contacts MuJoCo 2.2.2 computes otherwise."""
        m = self.m
        if "contact" in self.flags:
            return
        group = m.body_weldid[m.geom_bodyid]  # bodies without joints between them
        parent = m.body_weldid[m.body_parentid[group]]
        sides = m.geom_type[m.pair_geom1], m.geom_type[m.pair_geom2]
        shapes, touching = {tuple(sorted(pair)) for pair in zip(*sides, strict=True)}, m.npair
        for geom in range(m.ngeom):
            meets = (m.geom_contype[geom] & m.geom_conaffinity) | (m.geom_conaffinity[geom] & m.geom_contype) != 0
            meets &= group != group[geom]
            if "filterparent" not in self.flags:
                meets &= ((group != parent[geom]) & (parent != group[geom])) | (group == 0) | (group[geom] == 0)
            shapes |= {tuple(sorted((m.geom_type[geom], shape))) for shape in m.geom_type[meets]}
            touching += bool(group[geom] and meets.any())
        same = SAME_CONTACTS.split() + (LIBCCD.split() if "nativeccd" in self.flags else [])
        others: dict[str, list[str]] = {}
        for pair in sorted({f"{SHAPES[one]}-{SHAPES[other]}" for one, other in shapes} - {*same}):
            others.setdefault(CONTACTS.get(pair, "found by another method"), []).append(pair)
        for effect, pairs in others.items():
            self._change(f"contacts of {', '.join(pairs)}: {effect}", len(pairs))
        reaches = m.geom_margin + m.geom_gap
        inflated = np.count_nonzero((reaches != 0) | (m.geom_gap != 0))
        if "override" not in self.flags and (inflated > 1 or (reaches < 0).any()):
            self._change("margin, gap: of two geoms the greater one, not the sum", inflated)
        lasting = m.nemax + 2 * m.nv + 2 * m.ntendon  # about as many rows as equalities, limits and frictions have
        if m.nconmax < 4 * touching > 100 or m.njmax < lasting + 16 * touching > 500:
            self._change("size: no more contacts than nconmax (100) and rows of constraints than njmax (500)")

    def _tendons(self) -> None:
        m, tendons = self.m, self._section("tendon")
        for tendon in range(m.ntendon):
            path = range(m.tendon_adr[tendon], m.tendon_adr[tendon] + m.tendon_num[tendon])
            is_fixed = m.wrap_type[path[0]] == mujoco.mjtWrap.mjWRAP_JOINT
            element = self._new(tendons, "fixed" if is_fixed else "spatial", "tendon", tendon)
            self._limits(element, "tendon", tendon)
            put(element, "stiffness", 0.0 if "spring" in self.flags else m.tendon_stiffness[tendon], 0)
            put(element, "damping", 0.0 if "damper" in self.flags else m.tendon_damping[tendon], 0)
            low, high = m.tendon_lengthspring[tendon]
            put(element, "springlength", (low + high) / 2)
            self._change("springlength: the middle of the range", low != high and m.tendon_stiffness[tendon] != 0)
            self._solver_of_joint(element, "limit", m.tendon_solref_lim[tendon], m.tendon_solimp_lim[tendon])
            self._solver_of_joint(element, "friction", m.tendon_solref_fri[tendon], m.tendon_solimp_fri[tendon])
            if not is_fixed:
                put(element, "width", m.tendon_width[tendon], 0.003)
                self._appearance(element, "tendon", tendon)
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
            kind = self._known("equality", "connect weld joint tendon", m.eq_type[number], mujoco.mjtEq)
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
            if kind in ("connect", "weld"):
                self._change(f"{kind}: no centripetal and Coriolis accelerations")
            self._change("weld: rotations are held with another strength", kind == "weld")

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
                self._limits(element, "actuator", actuator, what)
            for what, names in KINDS.items():
                enum, value = getattr(mujoco, f"mjt{what.title()}"), getattr(m, f"actuator_{what}type")[actuator]
                kind = self._known(f"actuator's {what}type", names, value, enum)
                put(element, f"{what}type", kind.removesuffix("exact"))
                put(element, f"{what}prm", getattr(m, f"actuator_{what}prm")[actuator])
            kind, smooth = m.actuator_dyntype[actuator], m.actuator_dynprm[actuator][2]
            self._change("filterexact: filter instead", kind == mujoco.mjtDyn.mjDYN_FILTEREXACT)
            self._change("tausmooth: none", kind == mujoco.mjtDyn.mjDYN_MUSCLE and smooth != 0)
        if self.actuators != sorted(self.actuators):
            order = " ".join(self._name("actuator", one) or str(one) for one in self.actuators)
            self._change(f"actuators: those with activation come last, so the controls are {order}")

    def _transmission(self, element: ElementTree.Element, actuator: int) -> None:
        (first, second), kind = map(int, self.m.actuator_trnid[actuator]), self.m.actuator_trntype[actuator]
        name = self._known("transmission", TRANSMISSIONS, kind, mujoco.mjtTrn)
        attribute = "cranksite" if name == "slidercrank" else name
        put(
            element,
            attribute,
            self._reference({"jointinparent": "joint", "slidercrank": "site"}.get(name, name), first),
        )
        if attribute in ("site", "cranksite") and second >= 0:
            put(element, "refsite" if attribute == "site" else "slidersite", self._reference("site", second))
            moves = self.m.body_weldid[self.m.site_bodyid[second]] != 0
            self._change("refsite: another moment if it moves", attribute == "site" and moves)

    def _sensors(self) -> None:
        m, sensors = self.m, self._section("sensor")
        for number in range(m.nsensor):
            kind = mujoco.mjtSensor(m.sensor_type[number]).name.removeprefix("mjSENS_").lower()
            objtype, reftype = (
                mujoco.mjtObj(types[number]).name.removeprefix("mjOBJ_").lower()
                for types in (m.sensor_objtype, m.sensor_reftype)
            )
            if kind not in SENSORS or (kind == "rangefinder" and (objtype != "site" or m.sensor_dim[number] != 1)):
                self._change(f"{kind} sensor: left out of sensordata")
                continue
            element = self._new(sensors, kind, "sensor", number)
            if SENSORS[kind]:
                put(element, SENSORS[kind], self._reference(SENSORS[kind], int(m.sensor_objid[number])))
            elif kind != "clock":
                is_known = objtype == "xbody" or (objtype, int(m.sensor_objid[number])) in self.elements
                put(element, "objtype", objtype if is_known else "body")  # a user sensor needs an object here
                put(element, "objname", self._reference(objtype, int(m.sensor_objid[number])) if is_known else "world")
                if reftype in OBJECTS and m.sensor_refid[number] >= 0:
                    put(element, "reftype", reftype)
                    put(element, "refname", self._reference(reftype, int(m.sensor_refid[number])))
            pulled = (m.wrap_type == mujoco.mjtWrap.mjWRAP_SITE).any()
            self._change("force, torque: without the forces of tendons", kind in ("force", "torque") and pulled)
            if kind == "user":
                put(element, "dim", m.sensor_dim[number])
                put(element, "needstage", STAGES[m.sensor_needstage[number]])
                put(element, "datatype", DATATYPES[m.sensor_datatype[number]])

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
                self._change(f"tuple's {kind}: left out")
                continue
            one = ElementTree.SubElement(element, "element", objtype=kind)
            put(one, "objname", self._reference(kind, int(m.tuple_objid[place])))
            put(one, "prm", m.tuple_objprm[place], 0)

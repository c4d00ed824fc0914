"""env.unwrapped.data and env.unwrapped.model: MuJoCo's arrays under MuJoCo's names.

Those of an environment of one row become attributes of their object when they are first read.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator, MutableMapping
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import ALL_ROWS, Role, Status
from mjenv.capi.handle import Rows
from mjenv.errors import UnknownNameError
from mjenv.rows.blocks import Block, Mirror

# Which part of an array belongs to an object: a row, or a range of elements that begins at the object's address.
_ROW, _QPOS, _DOF, _SENSOR, _MOMENT, _SIZED = "row", "qpos", "dof", "sensor", "moment", "sized"

_BODY = (
    "xfrc_applied xpos xquat xmat xipos ximat xiquat subtree_com cinert crb cvel subtree_linvel subtree_angmom cacc "
    "cfrc_int cfrc_ext"
)
_DOFS = (
    "qvel qacc qacc_warmstart qacc_smooth qfrc_applied qfrc_passive qfrc_bias qfrc_actuator qfrc_smooth "
    "qfrc_constraint qfrc_inverse cdof cdof_dot qLDiagInv qLDiagSqrtInv"
)

# Arrays of mjData by kind of object: attribute -> (array, part). Some exist only in MuJoCo 4.0.
_DATA: dict[str, dict[str, tuple[str, str]]] = {
    "body": {name: (name, _ROW) for name in _BODY.split()},
    "joint": {name: (name, _DOF) for name in _DOFS.split()}
    | {"qpos": ("qpos", _QPOS), "xanchor": ("xanchor", _ROW), "xaxis": ("xaxis", _ROW)},
    "geom": {name: (f"geom_{name}", _ROW) for name in ("xpos", "xmat", "xquat")},
    "site": {name: (f"site_{name}", _ROW) for name in ("xpos", "xmat", "xquat")},
    "camera": {"xpos": ("cam_xpos", _ROW), "xmat": ("cam_xmat", _ROW)},
    "light": {"xpos": ("light_xpos", _ROW), "xdir": ("light_xdir", _ROW)},
    "actuator": {name: (f"actuator_{name}", _ROW) for name in ("force", "length", "velocity")}
    | {"ctrl": ("ctrl", _ROW), "moment": ("actuator_moment", _MOMENT)},
    "tendon": {
        name: (f"ten_{name}", _ROW)
        for name in ("length", "velocity", "J", "J_rownnz", "J_rowadr", "J_colind", "wrapadr", "wrapnum")
    },
    "sensor": {"data": ("sensordata", _SENSOR)},
}

# The prefixes of mjModel's arrays by kind of object. An attribute belongs to the first prefix that has an array for it.
_MODEL: dict[str, tuple[tuple[str, str], ...]] = {
    "body": (("body_", _ROW),),
    "joint": (("dof_", _DOF), ("jnt_", _ROW)),
    "geom": (("geom_", _ROW),),
    "site": (("site_", _ROW),),
    "camera": (("cam_", _ROW),),
    "light": (("light_", _ROW),),
    "actuator": (("actuator_", _ROW),),
    "tendon": (("tendon_", _ROW), ("ten_", _ROW)),
    "sensor": (("sensor_", _ROW),),
}
# The same for objects whose other arrays do not belong to one object each, with the attributes that MuJoCo's bindings
# have. Some exist only in one version of MuJoCo.
_LISTED = {
    "mesh": ("mesh_", "vertadr vertnum faceadr facenum texcoordadr graphadr pathadr"),
    "skin": ("skin_", "matid rgba inflate vertadr vertnum texcoordadr faceadr facenum boneadr bonenum pathadr"),
    "hfield": ("hfield_", "size nrow ncol adr data pathadr"),
    "texture": ("tex_", "type colorspace height width nchannel adr data rgb pathadr contenttypeadr"),
    "material": ("mat_", "texid texuniform texrepeat emission specular shininess reflectance rgba"),
    "pair": ("pair_", "dim geom1 geom2 signature solref solimp margin gap friction"),
    "exclude": ("exclude_", "signature"),
    "equality": ("eq_", "type obj1id obj2id active active0 solref solimp data"),
    "numeric": ("numeric_", "adr size data"),
    "tuple": ("tuple_", "adr size objtype objid objprm"),
    "key": ("key_", "time qpos qvel act mpos mquat ctrl plastic"),
}
# The arrays of which an object has as many elements as its sizes say, from its address on: the names of these.
_SIZED_ARRAYS = {
    "hfield_data": "hfield_adr hfield_nrow hfield_ncol",
    **dict.fromkeys(("tex_data", "tex_rgb"), "tex_adr tex_height tex_width tex_nchannel"),
    "ten_J_colind": "ten_J_rowadr ten_J_rownnz",
    "numeric_data": "numeric_adr numeric_size",
    **dict.fromkeys(("tuple_objtype", "tuple_objid", "tuple_objprm"), "tuple_adr tuple_size"),
}
_QPOS_OF_MODEL = ("qpos0", "qpos_spring")

# An array that holds an attribute of an object, and which part of the array belongs to the object.
Part = tuple[str, str] | None

# The writable arrays of mjData. MuJoCo computes all others from them.
INPUTS = frozenset(
    "time qpos qvel act qacc_warmstart ctrl qfrc_applied xfrc_applied mocap_pos mocap_quat userdata eq_active".split()
)
# The library would copy larger arrays in each call.
_MOST_MIRRORED = 10_000
# In MuJoCo 4.0, these attributes belong to the joint and not to its degrees of freedom.
_OF_JOINTS = ("solref", "solimp")


class _Attributes:
    """Attributes that come from the library."""

    __slots__ = ()

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError("this shows an environment's simulation: copy the environment, or single arrays")

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError(f"{name!r} is read-only, because MuJoCo computes it")

    def _missing(self, name: str) -> AttributeError:
        return AttributeError(f"{type(self).__name__} has no {name!r}; dir() lists what it has")


class Arrays(_Attributes):
    """Arrays by name, of one row or of ALL_ROWS. An assignment to an array or its elements changes the simulation.

    changed: is called after a write. keeps: whether there are no other rows and no other reader, so that the library
    can keep the arrays up to date (Mirror).
    """

    def __init__(
        self, rows: Rows, row: int, role: Role, changed: Callable[[], None], prefix: str = "", keeps: bool = False
    ) -> None:
        own: dict[str, Any] = self.__dict__
        own.update(_rows=rows, _row=row, _role=role, _changed=changed, _prefix=prefix, _keeps=keeps)
        own.update(_blocks={}, _readers={}, _writers={})

    def __getattr__(self, name: str) -> Any:
        return (self._readers.get(name) or self._reader(name))()

    def _reader(self, name: str) -> Callable[[], Any]:
        """The function that reads an array. An array that the library keeps up to date becomes an attribute."""
        block = self._block(name)
        read: Callable[[], Any] = block.lend
        if not isinstance(block, Mirror):
            read = partial(self._read, block)
        # A number without a prefix is a size of the model, which never changes.
        elif block.array.shape or (self._role == Role.MODEL and not self._prefix):
            self.__dict__[name] = block.lend()
        else:
            read = block.array.item
        self._readers[name] = read
        return read

    def _read(self, block: Block) -> Any:
        self._rows.flush()
        return block.lend()

    def __setattr__(self, name: str, value: Any) -> None:
        (self._writers.get(name) or self._writer(name))(value)

    def _writer(self, name: str) -> Callable[[Any], None]:
        """The function that assigns to an array."""
        owned = getattr(type(self), name, None)
        if (owned and not isinstance(owned, _Number)) or name in ("opt", "stat", "vis"):
            return partial(super().__setattr__, name)
        block = self._block(name)
        if not block.array.flags.writeable and self._role == Role.DATA:
            return partial(super().__setattr__, name)
        self._writers[name] = block.assign
        return block.assign

    def _part_named(self, prefix: str, keeps: bool = False) -> Arrays:
        """The arrays of the same struct whose names begin like this."""
        return Arrays(self._rows, self._row, self._role, self._changed, prefix, keeps)

    def _block(self, name: str) -> Block | Mirror:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._blocks:
            field = self._rows.array(self._role, self._prefix + name)
            if field is None:
                raise self._missing(name)
            if self._keeps and field.count <= _MOST_MIRRORED and not self._rows.is_copied(field.name):
                self._blocks[name] = Mirror(self._rows, field)
            else:
                self._blocks[name] = Block(self._rows, self._row, field, self._changed)
        block: Block | Mirror = self._blocks[name]
        return block

    def __dir__(self) -> list[str]:
        names = {name.removeprefix(self._prefix) for name in self._all() if name.startswith(self._prefix)}
        return sorted({*object.__dir__(self), *(name for name in names if "." not in name)})

    def _all(self) -> list[str]:
        return [field.name for field in self._rows.fields(self._role)]


class _Number(property):
    """A number that changes. As a property, it is read faster than by __getattr__."""

    def __init__(self, name: str) -> None:
        super().__init__(lambda arrays: (arrays._readers.get(name) or arrays._reader(name))())


class Contacts(_Attributes):
    """data.contact: arrays of all contacts, such as contact.dist[ncon], and single contacts: data.contact[0]."""

    def __init__(self, data: Data) -> None:
        arrays = data._part_named("contact.", data._keeps)  # with room for more contacts than there are
        self.__dict__.update(_arrays=arrays, _found=[], _count=data._reader("ncon"))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._arrays, name)[: len(self)]

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *dir(self._arrays)})

    @property
    def geom(self) -> NDArray[np.int32]:
        """The two geoms of each contact, [ncon, 2]."""
        return np.stack([self.geom1, self.geom2], axis=1)

    def __len__(self) -> int:
        count: int = self._count()
        return count

    def __getitem__(self, index: int | slice) -> Any:
        """A contact, or a list of several."""
        count, found = self._count(), self._found
        if count > len(found):
            found += (Contact(self._arrays, i) for i in range(len(found), count))
        if isinstance(index, slice):
            return found[:count][index]
        number = operator.index(index)
        if not -count <= number < count:
            raise UnknownNameError(f"contact {number} does not exist; there are {count} contacts", Status.E_NAME)
        return found[number % count]


def _number_of_contact(name: str) -> property:
    return property(lambda contact: getattr(contact._arrays, name).item(contact._index))


class Contact(_Attributes):
    """One contact: geom1, geom2, dist, pos, frame and so on."""

    def __init__(self, arrays: Arrays, index: int) -> None:
        self.__dict__.update(_arrays=arrays, _index=index)

    dist, dim, geom1, geom2, exclude, includemargin, efc_address = map(
        _number_of_contact, "dist dim geom1 geom2 exclude includemargin efc_address".split()
    )

    def __getattr__(self, name: str) -> Any:
        values = getattr(self._arrays, name)
        if values.ndim == 1:
            return values.item(self._index)
        if self._arrays._keeps:
            self.__dict__[name] = values[self._index]
        return values[self._index]

    @property
    def geom(self) -> NDArray[np.int32]:
        """The two geoms."""
        return np.array([self.geom1, self.geom2], np.int32)

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *dir(self._arrays)})

    def __repr__(self) -> str:
        return f"<contact {self._index} of geoms {self.geom1} and {self.geom2}>"


class Warnings(_Attributes):
    """data.warning: of what MuJoCo has warned in the row's last step or reset.

    number: 0 or 1 for each mjtWarning, because rows keep no counts; warning[kind].number is one of them.
    """

    __slots__ = ("number",)

    number: Any

    def __init__(self, number: Any) -> None:
        object.__setattr__(self, "number", number)

    def __len__(self) -> int:
        return len(self.number)

    def __getitem__(self, kind: int) -> Warnings:
        return Warnings(self.number[operator.index(kind)].item())

    def __repr__(self) -> str:
        return f"<warnings {self.number}>"


class View(_Attributes):
    """One object of the model: id, name, and its part of each array."""

    def __init__(self, arrays: _Named, kind: str, key: str | int) -> None:
        if isinstance(key, str):
            name, index = key, arrays._rows.object_index(kind, key)
        else:
            index = operator.index(key)
            name = arrays._rows.object_name(kind, index)
        self.__dict__.update(_arrays=arrays, _kind=kind, _parts={}, id=index, name=name)

    def __getattr__(self, name: str) -> Any:
        array, part = self._parts.get(name) or self._find(name)
        whole = getattr(self._arrays, array)
        value = part(whole)
        # The library keeps the memory up to date, unless the part is a copy.
        if array in self._arrays.__dict__ and np.may_share_memory(value, whole):
            self.__dict__[name] = value
        return value

    def _find(self, name: str) -> tuple[str, Callable[[Any], Any]]:
        """The array that holds an attribute, and the function that gives the object's part of it."""
        if name.startswith("_"):
            raise AttributeError(name)
        found = self._arrays._part(self._kind, name)
        if found is None:
            raise self._missing(name)
        array, part = found
        field = self._arrays._rows.array(self._arrays._role, array)
        assert field is not None
        if part == _MOMENT and len(field.shape) == 1:
            take: Callable[[Any], Any] = self._moment
        elif part == _SIZED:
            take = partial(self._sized, *self._place(_SIZED_ARRAYS[array].split()))
        else:
            index: Any = self.id
            if part not in (_ROW, _MOMENT):
                index = slice(*self._range(part, field.shape[0]))
            elif len(field.shape) == 1:
                index = slice(self.id, self.id + 1)
            take = operator.itemgetter((slice(None), index) if self._arrays._row == ALL_ROWS else index)
            if part in (_ROW, _MOMENT) and len(field.shape) > 2:
                take = partial(self._flat, take)
        self._parts[name] = array, take
        return array, take

    def __setattr__(self, name: str, value: Any) -> None:
        part = getattr(self, name)
        if not part.flags.writeable:
            super().__setattr__(name, value)
        part[...] = value
        self._arrays._rows.flush()

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *self._arrays._names(self._kind)})

    def __repr__(self) -> str:
        return f"<{self._kind} {self.id} {self.name!r}>"

    @staticmethod
    def _flat(take: Callable[[Any], Any], values: NDArray[Any]) -> Any:
        return take(values.reshape(*values.shape[:-2], -1))

    def _moment(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """An actuator's row of actuator_moment, which is a sparse matrix in MuJoCo 4.0."""
        names = ("moment_rowadr", "moment_rownnz", "moment_colind")
        starts, counts, columns = (np.asarray(getattr(self._arrays, name)) for name in names)
        found = np.zeros((*values.shape[:-1], int(self._arrays._rows.value(Role.MODEL, "nv"))))
        for row in np.ndindex(values.shape[:-1]):
            first = starts[row][self.id]
            held = slice(first, first + counts[row][self.id])
            found[row][columns[row][held]] = values[row][held]
        found.flags.writeable = False
        return found

    def _place(self, names: list[str]) -> tuple[int, tuple[int, ...]]:
        """Where the object's elements begin in the model's array, and their shape."""
        rows = self._arrays._rows
        # In MuJoCo 2.2.2, all textures have three channels.
        first, *shape = (
            int(rows.value(Role.MODEL, name)[self.id]) if rows.array(Role.MODEL, name) else 3 for name in names
        )
        return first, tuple(shape)

    @staticmethod
    def _sized(first: int, shape: tuple[int, ...], values: NDArray[Any]) -> NDArray[Any]:
        return values[..., first : first + math.prod(shape)].reshape(*values.shape[:-1], *shape)

    def _range(self, part: str, end: int) -> tuple[int, int]:
        address = {_QPOS: "jnt_qposadr", _DOF: "jnt_dofadr", _SENSOR: "sensor_adr"}[part]
        starts = self._arrays._rows.value(Role.MODEL, address)
        return int(starts[self.id]), int(starts[self.id + 1]) if self.id + 1 < len(starts) else end


def _objects(kind: str) -> Callable[[_Named, str | int], View]:
    """The method that gives the object of that kind with a name or a number."""

    def of(self: _Named, key: str | int) -> View:
        views = self._views
        found: View = views.get((kind, key)) or views.setdefault((kind, key), View(self, kind, key))
        return found

    return of


class _Named(Arrays):
    """Arrays that can also be accessed by object: data.body("torso").xpos."""

    def __init__(
        self, rows: Rows, row: int, role: Role, changed: Callable[[], None], prefix: str = "", keeps: bool = False
    ) -> None:
        super().__init__(rows, row, role, changed, prefix, keeps)
        self.__dict__["_views"] = {}

    body, joint, geom, site, camera, light, actuator, tendon, sensor = map(
        _objects, "body joint geom site camera light actuator tendon sensor".split()
    )
    # MuJoCo's short names.
    jnt, cam, ten = joint, camera, tendon

    def __repr__(self) -> str:
        kind = "mjData" if self._role == Role.DATA else "mjModel"
        return (
            f"<{kind} of {self._rows.id}, which functions of the mujoco package do not take: the environment has "
            "set_state, do_simulation, mj_forward, mj_resetData, mj_name2id and mj_id2name>"
        )

    @property
    def simulation(self) -> Any:
        """The environment, or the row, that this belongs to."""
        return self._changed.__self__

    def _part(self, kind: str, name: str) -> Part:
        """The array that holds an object's attribute, and which part of the array belongs to the object."""
        raise NotImplementedError

    def _names(self, kind: str) -> list[str]:
        """The attributes of an object of that kind."""
        raise NotImplementedError


class Data(_Named):
    """mjData as it is after the last reset, step or set_state."""

    def __init__(self, rows: Rows, row: int, changed: Callable[[], None], keeps: bool = False) -> None:
        super().__init__(rows, row, Role.DATA, changed, keeps=keeps)

    @cached_property
    def contact(self) -> Any:
        """The contacts that the last mj_step or mj_forward found. Of all rows: arrays with room for the most."""
        return self._part_named("contact.") if self._row == ALL_ROWS else Contacts(self)

    time, ncon, nefc = map(_Number, ("time", "ncon", "nefc"))

    @property
    def efc_force(self) -> NDArray[np.float64]:
        """The forces of the constraints: [njmax], as in MuJoCo 2.2.2, or [nefc], as in 4.0. Of all rows: [njmax]."""
        forces: NDArray[np.float64] = self.__getattr__("efc_force")
        return forces if self._row == ALL_ROWS or self._rows.engine.name == "2.2.2" else forces[: self.nefc]

    @property
    def warning(self) -> Warnings:
        """Of what MuJoCo has warned: warning[kind].number for a kind of mjtWarning."""
        return Warnings(self.warnings)

    def _part(self, kind: str, name: str) -> Part:
        found = _DATA[kind].get(name)
        field = self._rows.array(Role.DATA, found[0]) if found else None
        # MuJoCo 4.0's ten_J is sparse, and no part of it belongs to a tendon.
        return found if field and (name != "J" or len(field.shape) > 1) else None

    def _names(self, kind: str) -> list[str]:
        return [name for name in _DATA[kind] if self._part(kind, name)]


class Option(Arrays):
    """model.opt: numbers and flags of the simulation."""

    timestep, integrator, solver, cone, iterations, tolerance, disableflags, enableflags = map(
        _Number, "timestep integrator solver cone iterations tolerance disableflags enableflags".split()
    )


class Visual(_Attributes):
    """The part of model.vis that pictures need: vis.global_.azimuth, vis.map.znear and so on. Read-only."""

    __slots__ = ("global_", "map")

    global_: Arrays
    map: Arrays

    def __init__(self, model: Model) -> None:
        for name in ("global", "map"):
            arrays = model._part_named(f"vis.{name}.")
            object.__setattr__(self, "global_" if name == "global" else name, arrays)


def _text(name: str) -> property:
    """An array of letters, which MuJoCo's Python package gives as bytes."""

    def read(model: Model) -> Any:
        letters = model._block(name).lend()
        return letters if model._row == ALL_ROWS else letters.tobytes()

    return property(read)


class Model(_Named):
    """mjModel: sizes (nq), arrays (body_mass), and opt, stat and vis."""

    opt: Option
    stat: Arrays
    vis: Visual

    def __init__(self, rows: Rows, row: int, changed: Callable[[], None], keeps: bool = False) -> None:
        super().__init__(rows, row, Role.MODEL, changed, keeps=keeps)
        for name, kind in (("opt", Option), ("stat", Arrays)):
            self.__dict__[name] = kind(rows, row, Role.MODEL, changed, f"{name}.", keeps)
        self.__dict__["vis"] = Visual(self)

    names, paths, text_data = map(_text, ("names", "paths", "text_data"))

    mesh, skin, hfield, texture, material, pair, exclude, equality, numeric, tuple, key = map(_objects, _LISTED)
    # MuJoCo's other names.
    tex, mat, eq, keyframe = texture, material, equality, key

    def _part(self, kind: str, name: str) -> Part:
        if kind in _LISTED:
            prefix, names = _LISTED[kind]
            array = prefix + name
            if name not in names.split() or not self._rows.array(Role.MODEL, array):
                return None
            return array, _SIZED if array in _SIZED_ARRAYS else _ROW
        if kind == "joint" and name in _QPOS_OF_MODEL:
            return name, _QPOS
        prefixes = _MODEL[kind]
        if name in _OF_JOINTS and self._rows.engine.name != "2.2.2":
            prefixes = prefixes[::-1]
        found = ((prefix + name, _SIZED if prefix + name in _SIZED_ARRAYS else part) for prefix, part in prefixes)
        return next((array for array in found if self._rows.array(Role.MODEL, array[0])), None)

    def _names(self, kind: str) -> list[str]:
        if kind in _LISTED:
            return [name for name in _LISTED[kind][1].split() if self._part(kind, name)]
        own = list(_QPOS_OF_MODEL) if kind == "joint" else []
        for prefix, _ in _MODEL[kind]:
            own += [name.removeprefix(prefix) for name in self._all() if name.startswith(prefix)]
        return own


class Parameters(MutableMapping[str, Any]):
    """The live parameters of a task by name. Assign to an array or its elements to change the rows' numbers."""

    __slots__ = ("_arrays",)

    def __init__(self, arrays: Arrays) -> None:
        self._arrays = arrays

    def __getitem__(self, name: str) -> Any:
        if name not in self:
            raise UnknownNameError(
                f"there is no live parameter {name!r}; this task has {', '.join(self) or 'none'}", Status.E_NAME
            )
        return getattr(self._arrays, name)

    def __setitem__(self, name: str, value: Any) -> None:
        self[name]
        setattr(self._arrays, name, value)

    def __delitem__(self, name: str) -> None:
        raise TypeError("live parameters cannot be deleted")

    def __contains__(self, name: object) -> bool:
        return name in list(self)

    def __iter__(self) -> Iterator[str]:
        return (name.removeprefix("parameters.") for name in self._arrays._all())

    def __len__(self) -> int:
        return len(self._arrays._all())

    def __repr__(self) -> str:
        return f"Parameters({dict(self)})"

"""physics.named: arrays of mjModel and mjData whose rows and columns have names, as in dm_control."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjenv.capi.declarations import Role, Status
from mjenv.errors import UnknownNameError
from mjenv.rows.arrays import Arrays, Model

# The kind of object to which an array's rows belong, by the beginning of the array's name; the longest one counts.
# _RAGGED has the arrays with several numbers for each object.
_ROWS = {
    Role.MODEL: {
        "body_": "body",
        "jnt_": "jnt",
        "geom_": "geom",
        "site_": "site",
        "cam_": "cam",
        "light_": "light",
        "mesh_": "mesh",
        "skin_": "skin",
        "hfield_": "hfield",
        "tex_": "tex",
        "mat_": "mat",
        "pair_": "pair",
        "exclude_": "exclude",
        "eq_": "eq",
        "tendon_": "tendon",
        "actuator_": "actuator",
        "sensor_": "sensor",
        "numeric_": "numeric",
        "text_": "text",
        "tuple_": "tuple",
        "key_": "key",
    },
    Role.DATA: {
        **dict.fromkeys(("xpos", "xquat", "xmat", "xipos", "ximat", "xfrc_", "subtree_", "cinert", "crb"), "body"),
        **dict.fromkeys(("cvel", "cacc", "cfrc_", "body_", "parent_awake"), "body"),
        **dict.fromkeys(("xanchor", "xaxis"), "jnt"),
        "geom_": "geom",
        "site_": "site",
        "cam_": "cam",
        "light_": "light",
        "eq_": "eq",
        "ten_": "tendon",
        "actuator_": "actuator",
        "ctrl": "actuator",
    },
}
# Arrays with a range of elements for each object: the beginning of the name, the objects, and the ranges' addresses.
_RAGGED = {
    "qpos": ("jnt", "jnt_qposadr"),
    **dict.fromkeys(("qvel", "qacc", "qfrc_", "cdof", "dof_", "M_row"), ("jnt", "jnt_dofadr")),
    "sensordata": ("sensor", "sensor_adr"),
    "numeric_data": ("numeric", "numeric_adr"),
}
_COLUMNS = {
    "xyz": ("x", "y", "z"),
    "quat": ("qw", "qx", "qy", "qz"),
    "mat": ("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),
    "rgba": ("r", "g", "b", "a"),
}
# Arrays with three columns that are not x, y and z.
_NO_COORDINATES = (
    *("geom_friction", "key_mpos", "sensor_intprm"),
    *("light_ambient", "light_attenuation", "light_diffuse", "light_specular"),
)


class Axis:
    """The names of an array's rows or columns: name -> index, or name -> slice if an object has several."""

    def __init__(self, indices: dict[str, int | slice], is_ragged: bool = False) -> None:
        self._indices, self._is_ragged = indices, is_ragged

    def index(self, key: Any) -> Any:
        """NumPy's index for an index with names."""
        if key is None or key is Ellipsis:
            raise IndexError(f"{key} is no index of an array with names")
        if isinstance(key, str):
            return self._find(key)
        if not isinstance(key, (list, np.ndarray)):
            return key
        names = np.asarray(key)
        if names.dtype.kind != "U" or not names.size:
            return key
        found = [self._find(name) for name in names.ravel().tolist()]
        if not self._is_ragged:
            return np.array(found).reshape(names.shape)
        return [i for part in found for i in range(part.start, part.stop)]

    def _find(self, name: str) -> Any:
        if name not in self._indices:
            near = difflib.get_close_matches(name, self._indices, 3) or [*self._indices][:10]
            raise UnknownNameError(f"no name {name!r} here; there are {', '.join(near) or 'none'}", Status.E_NAME)
        return self._indices[name]

    @property
    def names(self) -> list[str]:
        """The names, in the order of their elements."""
        return [*self._indices]


class NamedArray:
    """An array with named indices: named.data.xpos["torso", "z"]. An assignment changes the simulation."""

    def __init__(self, arrays: Arrays, name: str, axes: Sequence[Axis]) -> None:
        self._arrays, self._name, self.axes = arrays, name, tuple(axes)

    def __getitem__(self, key: Any) -> Any:
        return self._values()[self._index(key)]

    def __setitem__(self, key: Any, value: Any) -> None:
        self._values()[self._index(key)] = value

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self._values(), dtype)

    def __len__(self) -> int:
        return len(self._values())

    def __iter__(self) -> Iterator[Any]:
        return iter(self._values())

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._values(), name)

    def __repr__(self) -> str:
        rows = self.axes[0].names
        return f"{self._name}[{', '.join(rows)}] =\n{self._values()!r}"

    def _values(self) -> Any:
        return getattr(self._arrays, self._name)

    def _index(self, key: Any) -> Any:
        if not isinstance(key, tuple):
            return self.axes[0].index(key)
        if len(key) > len(self.axes):
            raise IndexError(f"{self._name} has {len(self.axes)} dimension(s), not {len(key)}")
        return tuple(axis.index(part) for axis, part in zip(self.axes, key, strict=False))


class Named:
    """The arrays of physics.model or physics.data by name, with named rows and columns."""

    def __init__(self, arrays: Arrays, role: Role, names: Names) -> None:
        self._arrays, self._role, self._names = arrays, role, names
        self._found: dict[str, NamedArray] = {}

    def __getattr__(self, name: str) -> NamedArray:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._found:
            values = np.asarray(getattr(self._arrays, name))
            axes = [self._names.rows(self._role, name, values), *(self._names.columns(name, values))]
            self._found[name] = NamedArray(self._arrays, name, axes)
        return self._found[name]

    def __dir__(self) -> list[str]:
        return dir(self._arrays)


class Names:
    """The names of a model's objects, by their kind as MuJoCo abbreviates it: the "jnt" of name_jntadr."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self._of: dict[str, list[str]] = {}

    def of(self, kind: str) -> list[str]:
        """The names of all objects of a kind; "" for those without."""
        if kind not in self._of:
            text = self._model.names
            starts = np.asarray(getattr(self._model, f"name_{kind}adr")).ravel()
            self._of[kind] = [text[start : text.index(b"\0", start)].decode() for start in starts]
        return self._of[kind]

    def rows(self, role: Role, array: str, values: NDArray[Any]) -> Axis:
        """The names of an array's first dimension."""
        count = values.shape[0] if values.ndim else 0
        ragged = next((found for start, found in _RAGGED.items() if array.startswith(start)), None)
        if ragged:
            names, starts = self.of(ragged[0]), np.asarray(getattr(self._model, ragged[1])).ravel().tolist()
            ends = [*starts[1:], count]
            parts = zip(names, starts, ends, strict=True)
            return Axis({name: slice(start, end) for name, start, end in parts if name}, is_ragged=True)
        if array.startswith("name_") and array.endswith("adr"):
            names = self.of(array[len("name_") : -len("adr")])
        elif array in ("act", "act_dot"):
            names = self.of("actuator")[-count:] if count else []  # in MuJoCo, actuators with a state come last
        elif array.startswith("mocap_"):
            of_body = np.asarray(self._model.body_mocapid).ravel().tolist()
            names = [self.of("body")[of_body.index(i)] for i in range(count)]
        else:
            starts_of = [start for start in _ROWS[role] if array.startswith(start)]
            names = self.of(_ROWS[role][max(starts_of, key=len)]) if starts_of else []
        if len(names) != count:
            return Axis({})
        return Axis({name: i for i, name in enumerate(names) if name})

    @staticmethod
    def columns(array: str, values: NDArray[Any]) -> list[Axis]:
        """The names of an array's second dimension, if it has one."""
        if values.ndim < 2:
            return []
        kind = next((kind for kind in ("rgba", "quat") if array.endswith(kind)), None)
        if array.endswith(("mat", "mat0")) and values.shape[1] == len(_COLUMNS["mat"]):
            kind = "mat"
        elif values.shape[1] == len(_COLUMNS["xyz"]) and array not in _NO_COORDINATES:
            kind = "xyz"
        names = _COLUMNS[kind] if kind else ()
        return [Axis({name: i for i, name in enumerate(names)}), *(Axis({}) for _ in range(values.ndim - 2))]

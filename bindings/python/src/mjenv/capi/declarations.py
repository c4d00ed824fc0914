"""The C interface in ctypes. Written by tools/declarations.py from mjenv.h and task.h: do not edit."""
# ruff: noqa: N801

from ctypes import (
    CDLL,
    Structure,
    c_char_p,
    c_double,
    c_float,
    c_int32,
    c_int64,
    c_uint8,
    c_uint32,
    c_uint64,
    c_void_p,
)
from enum import IntEnum

from mjenv.capi.pointers import POINTER

ABI_VERSION = 1
ALL_ROWS = -1
CAMERA_FREE = -1
BODY_UNSET = -2


class Status(IntEnum):
    OK = 0
    DIVERGED = 1
    E_ARGUMENT = -1
    E_NAME = -2
    E_TYPE = -3
    E_VALUE = -4
    E_SIZE = -5
    E_NOT_RESET = -6
    E_EPISODE_ENDED = -7
    E_PENDING = -8
    E_NOT_PENDING = -9
    E_BUSY = -10
    E_FORKED = -11
    E_FILE = -12
    E_MODEL = -13
    E_PHYSICS = -14
    E_SNAPSHOT = -15
    E_RENDER = -16
    E_MEMORY = -17
    E_INTERNAL = -18
    E_TASK = -19


class Distribution(IntEnum):
    UNIFORM = 0
    NORMAL = 1
    INTEGERS = 2


class Dtype(IntEnum):
    FLOAT64 = 1
    FLOAT32 = 2
    INT64 = 3
    INT32 = 4
    UINT8 = 5
    ACTION = 6
    NATIVE_FLOAT = 7
    NATIVE_INT = 8


class Role(IntEnum):
    OBSERVATION = 1
    ACTION = 2
    INFO = 3
    RESET_INFO = 4
    REWARD = 5
    STRUCTURE = 6
    DATA = 7
    MODEL = 8
    ARRAYS = 9
    PARAMETERS = 10
    GROUPS = 11


class Kind(IntEnum):
    FLAG = 1
    INTEGER = 2
    REALS = 3
    STRING = 4
    STRING_OR_INT = 5


class Gl(IntEnum):
    AUTO = 0
    EGL = 1
    OSMESA = 2
    GLFW = 3
    WGL = 4


class Visual(IntEnum):
    CONVEXHULL = 0
    TEXTURE = 1
    JOINT = 2
    CAMERA = 3
    ACTUATOR = 4
    ACTIVATION = 5
    LIGHT = 6
    TENDON = 7
    RANGEFINDER = 8
    CONSTRAINT = 9
    INERTIA = 10
    SCLINERTIA = 11
    PERTFORCE = 12
    PERTOBJ = 13
    CONTACTPOINT = 14
    CONTACTFORCE = 15
    CONTACTSPLIT = 16
    TRANSPARENT = 17
    AUTOCONNECT = 18
    COM = 19
    SELECT = 20
    STATIC = 21
    SKIN = 22


class Label(IntEnum):
    NONE = 0
    BODY = 1
    JOINT = 2
    GEOM = 3
    SITE = 4
    CAMERA = 5
    LIGHT = 6
    TENDON = 7
    ACTUATOR = 8
    CONSTRAINT = 9
    SKIN = 10
    SELECTION = 11
    SELPNT = 12
    CONTACTFORCE = 13


class Frame(IntEnum):
    NONE = 0
    BODY = 1
    GEOM = 2
    SITE = 3
    CAMERA = 4
    LIGHT = 5
    CONTACT = 6
    WORLD = 7


class mjenv_option(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("kind", c_int32),
        ("name", c_char_p),
        ("doc", c_char_p),
        ("low", c_double),
        ("high", c_double),
        ("count", c_int64),
        ("choices", c_char_p),
    )


class mjenv_field(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("ndim", c_int32),
        ("name", c_char_p),
        ("doc", c_char_p),
        ("shape", c_int64 * 4),
        ("offset", c_int64),
        ("count", c_int64),
        ("dtype", c_int32),
        ("reserved", c_int32),
    )


class mjenv_space(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("dtype", c_int32),
        ("count", c_int64),
        ("low", POINTER(c_double)),
        ("high", POINTER(c_double)),
        ("ndim", c_int32),
        ("reserved", c_int32),
        ("shape", c_int64 * 4),
    )


class mjenv_info(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("threads", c_int32),
        ("rows", c_int64),
        ("frame_skip", c_int64),
        ("lanes", c_int64),
        ("lanes_reason", c_char_p),
    )


class mjenv_spec(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("version", c_int32),
        ("id", c_char_p),
        ("robot", c_char_p),
        ("max_episode_steps", c_int64),
        ("reward_threshold", c_double),
        ("camera_distance", c_double),
        ("camera_elevation", c_double),
        ("camera_lookat", c_double * 3),
        ("camera_trackbodyid", c_int32),
        ("revision", c_int32),
        ("model_xml", c_char_p),
    )


class mjenv_batch(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("obs_dtype", c_int32),
        ("rows", c_int64),
        ("obs_count", c_int64),
        ("info_count", c_int64),
        ("reset_info_count", c_int64),
        ("arrays_count", c_int64),
        ("obs", c_void_p),
        ("reward", POINTER(c_double)),
        ("terminated", POINTER(c_uint8)),
        ("truncated", POINTER(c_uint8)),
        ("status", POINTER(c_int32)),
        ("info", POINTER(c_double)),
        ("was_reset", POINTER(c_uint8)),
        ("reset_info", POINTER(c_double)),
        ("final_obs", c_void_p),
        ("final_info", POINTER(c_double)),
        ("arrays", POINTER(c_double)),
    )


class mjenv_render_settings(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("gl", c_int32),
        ("width", c_int32),
        ("height", c_int32),
        ("camera", c_int32),
        ("max_geom", c_int32),
        ("samples", c_int32),
        ("shadows", c_int32),
        ("reflections", c_int32),
        ("reserved", c_int32),
        ("camera_name", c_char_p),
        ("lookat", c_double * 3),
        ("distance", c_double),
        ("azimuth", c_double),
        ("elevation", c_double),
        ("visual", c_uint8 * 32),
        ("geomgroup", c_uint8 * 6),
        ("sitegroup", c_uint8 * 6),
        ("jointgroup", c_uint8 * 6),
        ("tendongroup", c_uint8 * 6),
        ("actuatorgroup", c_uint8 * 6),
        ("skingroup", c_uint8 * 6),
        ("reserved_bytes", c_uint8 * 4),
        ("label", c_int32),
        ("frame", c_int32),
        ("wireframe", c_int32),
        ("additive", c_int32),
        ("skybox", c_int32),
        ("fog", c_int32),
        ("haze", c_int32),
        ("cull_face", c_int32),
    )


class Library(CDLL):
    def __init__(self, path: str) -> None:
        super().__init__(path)
        self.mjenv_abi_version.argtypes = ()
        self.mjenv_abi_version.restype = c_uint32
        self.mjenv_version.argtypes = ()
        self.mjenv_version.restype = c_char_p
        self.mjenv_status_name.argtypes = (c_int32,)
        self.mjenv_status_name.restype = c_char_p
        self.mjenv_last_error.argtypes = ()
        self.mjenv_last_error.restype = c_char_p
        self.mjenv_error_of.argtypes = (c_void_p, c_char_p, c_int64, POINTER(c_int64))
        self.mjenv_error_of.restype = c_int32
        self.mjenv_id_count.argtypes = ()
        self.mjenv_id_count.restype = c_int64
        self.mjenv_id_at.argtypes = (c_int64,)
        self.mjenv_id_at.restype = c_char_p
        self.mjenv_spec_of.argtypes = (c_char_p, POINTER(mjenv_spec))
        self.mjenv_spec_of.restype = c_int32
        self.mjenv_options_create.argtypes = (c_char_p, POINTER(c_void_p))
        self.mjenv_options_create.restype = c_int32
        self.mjenv_options_copy.argtypes = (c_void_p, POINTER(c_void_p))
        self.mjenv_options_copy.restype = c_int32
        self.mjenv_options_destroy.argtypes = (c_void_p,)
        self.mjenv_options_destroy.restype = None
        self.mjenv_options_count.argtypes = (c_void_p,)
        self.mjenv_options_count.restype = c_int64
        self.mjenv_options_at.argtypes = (c_void_p, c_int64, POINTER(mjenv_option))
        self.mjenv_options_at.restype = c_int32
        self.mjenv_options_set_integer.argtypes = (c_void_p, c_char_p, c_int64)
        self.mjenv_options_set_integer.restype = c_int32
        self.mjenv_options_set_reals.argtypes = (c_void_p, c_char_p, POINTER(c_double), c_int64)
        self.mjenv_options_set_reals.restype = c_int32
        self.mjenv_options_set_string.argtypes = (c_void_p, c_char_p, c_char_p)
        self.mjenv_options_set_string.restype = c_int32
        self.mjenv_options_get_integer.argtypes = (c_void_p, c_char_p, POINTER(c_int64))
        self.mjenv_options_get_integer.restype = c_int32
        self.mjenv_options_get_reals.argtypes = (c_void_p, c_char_p, POINTER(c_double), c_int64, POINTER(c_int64))
        self.mjenv_options_get_reals.restype = c_int32
        self.mjenv_options_get_string.argtypes = (c_void_p, c_char_p, POINTER(c_char_p))
        self.mjenv_options_get_string.restype = c_int32
        self.mjenv_create.argtypes = (c_void_p, c_int64, POINTER(c_void_p))
        self.mjenv_create.restype = c_int32
        self.mjenv_destroy.argtypes = (c_void_p,)
        self.mjenv_destroy.restype = None
        self.mjenv_info_of.argtypes = (c_void_p, POINTER(mjenv_info))
        self.mjenv_info_of.restype = c_int32
        self.mjenv_lane_stages_of.argtypes = (c_void_p,)
        self.mjenv_lane_stages_of.restype = c_char_p
        self.mjenv_options_of.argtypes = (c_void_p,)
        self.mjenv_options_of.restype = c_void_p
        self.mjenv_space_of.argtypes = (c_void_p, c_int32, POINTER(mjenv_space))
        self.mjenv_space_of.restype = c_int32
        self.mjenv_field_count.argtypes = (c_void_p, c_int32)
        self.mjenv_field_count.restype = c_int64
        self.mjenv_field_at.argtypes = (c_void_p, c_int32, c_int64, POINTER(mjenv_field))
        self.mjenv_field_at.restype = c_int32
        self.mjenv_seed.argtypes = (c_void_p, POINTER(c_uint8), POINTER(c_uint64), c_int64)
        self.mjenv_seed.restype = c_int32
        self.mjenv_seed_row.argtypes = (c_void_p, c_int64, POINTER(c_uint64), c_int64)
        self.mjenv_seed_row.restype = c_int32
        self.mjenv_get_stream.argtypes = (c_void_p, c_int64, POINTER(c_uint64), c_int64)
        self.mjenv_get_stream.restype = c_int32
        self.mjenv_set_stream.argtypes = (c_void_p, c_int64, POINTER(c_uint64), c_int64)
        self.mjenv_set_stream.restype = c_int32
        self.mjenv_draw.argtypes = (POINTER(c_uint64), c_int64, c_int32, c_double, c_double, POINTER(c_double), c_int64)
        self.mjenv_draw.restype = c_int32
        self.mjenv_seed_actions.argtypes = (c_void_p, c_uint64)
        self.mjenv_seed_actions.restype = c_int32
        self.mjenv_sample_actions.argtypes = (c_void_p, POINTER(c_float), c_int64)
        self.mjenv_sample_actions.restype = c_int32
        self.mjenv_reset.argtypes = (c_void_p, POINTER(c_uint8), POINTER(mjenv_batch))
        self.mjenv_reset.restype = c_int32
        self.mjenv_step.argtypes = (c_void_p, POINTER(c_uint8), c_void_p, c_int64, c_int32, POINTER(mjenv_batch))
        self.mjenv_step.restype = c_int32
        self.mjenv_send.argtypes = (c_void_p, POINTER(c_int64), c_int64, c_void_p, c_int64, c_int32)
        self.mjenv_send.restype = c_int32
        self.mjenv_recv.argtypes = (
            c_void_p,
            c_int64,
            c_double,
            POINTER(c_int64),
            c_int64,
            POINTER(c_int64),
            POINTER(mjenv_batch),
        )
        self.mjenv_recv.restype = c_int32
        self.mjenv_rollout.argtypes = (c_void_p, c_void_p, c_int64, c_int32, c_int64, POINTER(mjenv_batch))
        self.mjenv_rollout.restype = c_int32
        self.mjenv_observe.argtypes = (c_void_p, POINTER(mjenv_batch))
        self.mjenv_observe.restype = c_int32
        self.mjenv_observe_row.argtypes = (c_void_p, c_int64, POINTER(mjenv_batch))
        self.mjenv_observe_row.restype = c_int32
        self.mjenv_begin.argtypes = (
            c_void_p,
            POINTER(c_uint8),
            POINTER(c_double),
            c_int64,
            POINTER(c_double),
            c_int64,
            POINTER(mjenv_batch),
        )
        self.mjenv_begin.restype = c_int32
        self.mjenv_act.argtypes = (c_void_p, POINTER(c_uint8), c_void_p, c_int64, c_int32, c_void_p)
        self.mjenv_act.restype = c_int32
        self.mjenv_advance.argtypes = (
            c_void_p,
            POINTER(c_uint8),
            c_void_p,
            c_int64,
            c_int32,
            POINTER(c_double),
            c_int64,
            POINTER(mjenv_batch),
        )
        self.mjenv_advance.restype = c_int32
        self.mjenv_finish.argtypes = (c_void_p, POINTER(c_uint8), POINTER(mjenv_batch), POINTER(mjenv_batch))
        self.mjenv_finish.restype = c_int32
        self.mjenv_compute_reward.argtypes = (
            c_void_p,
            POINTER(c_double),
            POINTER(c_double),
            c_int64,
            POINTER(c_double),
            c_int64,
        )
        self.mjenv_compute_reward.restype = c_int32
        self.mjenv_read.argtypes = (c_void_p, c_int64, c_char_p, POINTER(c_double), c_int64, POINTER(c_int64))
        self.mjenv_read.restype = c_int32
        self.mjenv_mirror.argtypes = (c_void_p, c_int64, c_char_p, c_void_p, c_int64)
        self.mjenv_mirror.restype = c_int32
        self.mjenv_object_count.argtypes = (c_void_p, c_char_p, POINTER(c_int64))
        self.mjenv_object_count.restype = c_int32
        self.mjenv_object_index.argtypes = (c_void_p, c_char_p, c_char_p, POINTER(c_int64))
        self.mjenv_object_index.restype = c_int32
        self.mjenv_object_name.argtypes = (c_void_p, c_char_p, c_int64, POINTER(c_char_p))
        self.mjenv_object_name.restype = c_int32
        self.mjenv_set_state.argtypes = (c_void_p, c_int64, POINTER(c_double), c_int64, POINTER(c_double), c_int64)
        self.mjenv_set_state.restype = c_int32
        self.mjenv_reset_data.argtypes = (c_void_p, POINTER(c_uint8))
        self.mjenv_reset_data.restype = c_int32
        self.mjenv_write.argtypes = (c_void_p, POINTER(c_uint8), c_char_p, POINTER(c_double), c_int64)
        self.mjenv_write.restype = c_int32
        self.mjenv_write_row.argtypes = (c_void_p, c_int64, c_char_p, POINTER(c_double), c_int64)
        self.mjenv_write_row.restype = c_int32
        self.mjenv_set_constants.argtypes = (c_void_p, POINTER(c_uint8))
        self.mjenv_set_constants.restype = c_int32
        self.mjenv_set_constants_row.argtypes = (c_void_p, c_int64)
        self.mjenv_set_constants_row.restype = c_int32
        self.mjenv_simulate.argtypes = (c_void_p, c_int64, POINTER(c_double), c_int64, c_int64)
        self.mjenv_simulate.restype = c_int32
        self.mjenv_copy_row.argtypes = (c_void_p, POINTER(c_uint8), c_int64)
        self.mjenv_copy_row.restype = c_int32
        self.mjenv_snapshot.argtypes = (c_void_p, c_int64, c_void_p, c_int64, POINTER(c_int64))
        self.mjenv_snapshot.restype = c_int32
        self.mjenv_restore.argtypes = (c_void_p, c_int64, c_void_p, c_int64)
        self.mjenv_restore.restype = c_int32
        self.mjenv_randomize.argtypes = (c_void_p, c_char_p)
        self.mjenv_randomize.restype = c_int32
        self.mjenv_randomization.argtypes = (c_void_p, POINTER(c_char_p))
        self.mjenv_randomization.restype = c_int32
        self.mjenv_render_defaults.argtypes = (c_void_p, POINTER(mjenv_render_settings))
        self.mjenv_render_defaults.restype = c_int32
        self.mjenv_renderer_create.argtypes = (c_void_p, POINTER(mjenv_render_settings), POINTER(c_void_p))
        self.mjenv_renderer_create.restype = c_int32
        self.mjenv_renderer_destroy.argtypes = (c_void_p,)
        self.mjenv_renderer_destroy.restype = None
        self.mjenv_renderer_gl.argtypes = (c_void_p,)
        self.mjenv_renderer_gl.restype = c_char_p
        self.mjenv_render.argtypes = (c_void_p, c_int64, POINTER(c_uint8), c_int64, POINTER(c_float), c_int64)
        self.mjenv_render.restype = c_int32
        self.mjenv_render_segmentation.argtypes = (c_void_p, c_int64, POINTER(c_int32), c_int64)
        self.mjenv_render_segmentation.restype = c_int32
        self.mjenv_window_create.argtypes = (c_void_p, POINTER(mjenv_render_settings), POINTER(c_void_p))
        self.mjenv_window_create.restype = c_int32
        self.mjenv_window_destroy.argtypes = (c_void_p,)
        self.mjenv_window_destroy.restype = None
        self.mjenv_window_is_open.argtypes = (c_void_p,)
        self.mjenv_window_is_open.restype = c_int32
        self.mjenv_window_draw.argtypes = (c_void_p, c_int64)
        self.mjenv_window_draw.restype = c_int32
        self.mjenv_load_tasks.argtypes = (c_char_p,)
        self.mjenv_load_tasks.restype = c_int32

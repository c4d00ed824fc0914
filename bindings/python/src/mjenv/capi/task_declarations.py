"""The structs of mjenv/task.h in ctypes."""
# ruff: noqa: N801

from ctypes import (
    CFUNCTYPE,
    Structure,
    c_char_p,
    c_double,
    c_int32,
    c_int64,
    c_uint32,
    c_void_p,
)

from mjenv.capi.declarations import mjenv_field
from mjenv.capi.pointers import POINTER


class mjenv_task_option(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("kind", c_int32),
        ("name", c_char_p),
        ("doc", c_char_p),
        ("value", c_double),
        ("low", c_double),
        ("high", c_double),
        ("values", POINTER(c_double)),
        ("count", c_int64),
        ("text", c_char_p),
        ("choices", c_char_p),
        ("live", c_int32),
        ("reserved", c_int32),
    )


class mjenv_task_field(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("role", c_int32),
        ("name", c_char_p),
        ("doc", c_char_p),
        ("dtype", c_int32),
        ("ndim", c_int32),
        ("shape", c_int64 * 4),
        ("group", c_char_p),
    )


class mjenv_task_camera(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("trackbodyid", c_int32),
        ("distance", c_double),
        ("lookat", c_double * 3),
        ("elevation", c_double),
    )


# The arrays of mjenv_sim in their order. What each holds is documented in task.h.
SIM_ARRAYS = (
    "time action carried qpos qvel act ctrl qacc xpos xquat xmat xipos ximat xanchor xaxis geom_xpos geom_xmat "
    "site_xpos site_xmat subtree_com cinert cvel cfrc_ext sensordata actuator_length actuator_velocity "
    "actuator_force qfrc_actuator qfrc_passive qfrc_bias qfrc_constraint ten_length ten_velocity contacts qpos0 "
    "body_mass"
).split()
SIM_COUNTS = "nq nv na nu nbody njnt ngeom nsite ntendon nsensordata contact_count reserved".split()


class mjenv_sim(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("action_dtype", c_int32),
        ("api", c_void_p),
        *((name, c_int32) for name in SIM_COUNTS),
        ("timestep", c_double),
        ("dt", c_double),
        *((name, c_void_p) for name in SIM_ARRAYS),
        ("arrays", POINTER(c_void_p)),
        ("parameters", c_void_p),
        ("action_count", c_int32),
        ("reserved2", c_int32),
    )


class mjenv_start(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_int32),
        *((name, c_void_p) for name in ("api", "random", "qpos0", "qpos", "qvel", "act", "carried", "arrays")),
        *((name, c_int32) for name in ("nq", "nv", "na", "carry_count")),
        *((name, c_void_p) for name in ("parameters", "sim", "time", "own")),
    )


class mjenv_outcome(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("terminated", c_int32),
        ("reward", c_double),
        ("info", c_void_p),
        ("carried", c_void_p),
        ("random", c_void_p),
        ("own", c_void_p),
        ("qvel", c_void_p),
    )


class mjenv_control(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("substep", c_int32),
        *((name, c_void_p) for name in ("ctrl", "carried", "random", "own", "qvel")),
    )


class mjenv_task_api(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("abi_version", c_uint32),
        ("fail_with", CFUNCTYPE(c_int32, c_char_p)),
        ("integer", CFUNCTYPE(c_int64, c_void_p, c_char_p)),
        ("reals", CFUNCTYPE(None, c_void_p, c_char_p, POINTER(c_double), c_int64)),
        ("is_integer", CFUNCTYPE(c_int32, c_void_p, c_char_p)),
        ("text", CFUNCTYPE(c_char_p, c_void_p, c_char_p)),
        ("index", CFUNCTYPE(c_int32, c_void_p, c_char_p, c_char_p)),
        ("option_index", CFUNCTYPE(c_int32, c_void_p, c_char_p, c_char_p)),
        ("norm_is_fused", CFUNCTYPE(c_int32, c_void_p)),
        ("need", CFUNCTYPE(None, c_void_p, c_char_p)),
        ("array", CFUNCTYPE(c_int32, c_void_p, c_char_p, POINTER(mjenv_field))),
        ("field", CFUNCTYPE(None, c_void_p, POINTER(mjenv_task_field))),
        ("carry", CFUNCTYPE(None, c_void_p, c_int64)),
        ("carry_bounds", CFUNCTYPE(None, c_void_p, c_int64, c_int64, c_double, c_double)),
        ("random", CFUNCTYPE(c_double, c_void_p)),
        ("uniform", CFUNCTYPE(c_double, c_void_p, c_double, c_double)),
        ("normal", CFUNCTYPE(c_double, c_void_p)),
        ("integers", CFUNCTYPE(c_int64, c_void_p, c_int64, c_int64)),
        ("choice", CFUNCTYPE(c_int64, c_void_p, c_int64, c_void_p)),
        ("sample", CFUNCTYPE(None, c_void_p, c_int64, c_int64, c_void_p)),
        ("permutation", CFUNCTYPE(None, c_void_p, c_int64, c_void_p)),
        ("parameter", CFUNCTYPE(c_int64, c_void_p, c_char_p)),
        ("keep", CFUNCTYPE(None, c_void_p, c_int64, c_int64)),
        ("current", CFUNCTYPE(None, c_void_p)),
        ("own", CFUNCTYPE(c_int32, c_void_p, c_char_p)),
        ("random_state", CFUNCTYPE(None, c_void_p)),
        ("forward", CFUNCTYPE(c_int32, c_void_p)),
        ("advance", CFUNCTYPE(c_int32, c_void_p, c_int64)),
        ("restart", CFUNCTYPE(c_int32, c_void_p)),
        ("contact_count", CFUNCTYPE(c_int64, c_void_p)),
        ("state_rand", CFUNCTYPE(c_double, c_void_p)),
        ("state_uniform", CFUNCTYPE(c_double, c_void_p, c_double, c_double)),
        ("state_randn", CFUNCTYPE(c_double, c_void_p)),
        ("state_randint", CFUNCTYPE(c_int64, c_void_p, c_int64, c_int64)),
        ("state_choice", CFUNCTYPE(c_int64, c_void_p, c_int64, c_void_p)),
        ("state_is_new", CFUNCTYPE(c_int32, c_void_p)),
        ("action", CFUNCTYPE(None, c_void_p, c_int64, POINTER(c_double), POINTER(c_double))),
        ("state_permutation", CFUNCTYPE(None, c_void_p, c_int64, c_void_p)),
        ("control_forward", CFUNCTYPE(c_int32, c_void_p)),
    )


class mjenv_random(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_int32),
        ("api", c_void_p),
    )


CALLBACKS = ("reset", "reset_info", "carry", "observe", "step")
MORE_CALLBACKS = ("before_step", "before_substep", "compute_reward")


class mjenv_task(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("revision", c_int32),
        ("id", c_char_p),
        ("model", c_char_p),
        ("model_text", c_char_p),
        ("frame_skip", c_int32),
        ("has_reward_threshold", c_int32),
        ("reward_threshold", c_double),
        ("time_limit", c_int64),
        ("carry_count", c_int64),
        ("camera", POINTER(mjenv_task_camera)),
        ("options", POINTER(mjenv_task_option)),
        ("option_count", c_int64),
        ("fields", POINTER(mjenv_task_field)),
        ("field_count", c_int64),
        ("user", c_void_p),
        ("build", c_void_p),
        ("destroy", c_void_p),
        *((name, c_void_p) for name in CALLBACKS),
        ("caller_thread", c_int32),
        ("physics_only", c_int32),
        ("fixed_model", c_int32),
        ("fixed_frame_skip", c_int32),
        *((name, c_void_p) for name in MORE_CALLBACKS),
    )


class mjenv_builder(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("failed", c_int32),
        ("api", POINTER(mjenv_task_api)),
        ("sim", POINTER(mjenv_sim)),
        ("random", c_void_p),
        ("task", POINTER(mjenv_task)),
    )


RESET = CFUNCTYPE(c_int32, c_void_p, POINTER(mjenv_start))
BUILD = CFUNCTYPE(c_int32, POINTER(mjenv_builder), c_void_p, POINTER(c_void_p))

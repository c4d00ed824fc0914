"""The structs of mjenv/task.h in ctypes. Written by tools/declarations.py: do not edit."""
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

# Those of mjenv_task, but build and destroy
CALLBACKS = (
    "reset",
    "reset_info",
    "carry",
    "observe",
    "step",
    "before_step",
    "before_substep",
    "compute_reward",
)


class mjenv_task_option(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("kind", c_int32),
        ("name", c_char_p),
        ("doc", c_char_p),
        ("value", c_double),
        ("low", c_double),
        ("high", c_double),
        ("values", c_void_p),
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


class mjenv_contact(Structure):
    _fields_ = (
        ("geom1", c_int32),
        ("geom2", c_int32),
        ("distance", c_double),
        ("position", c_double * 3),
        ("frame", c_double * 9),
        ("force", c_double * 6),
    )


class mjenv_sim(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("action_dtype", c_int32),
        ("api", c_void_p),
        ("nq", c_int32),
        ("nv", c_int32),
        ("na", c_int32),
        ("nu", c_int32),
        ("nbody", c_int32),
        ("njnt", c_int32),
        ("ngeom", c_int32),
        ("nsite", c_int32),
        ("ntendon", c_int32),
        ("nsensordata", c_int32),
        ("contact_count", c_int32),
        ("reserved", c_int32),
        ("timestep", c_double),
        ("dt", c_double),
        ("time", c_void_p),
        ("action", c_void_p),
        ("carried", c_void_p),
        ("qpos", c_void_p),
        ("qvel", c_void_p),
        ("act", c_void_p),
        ("ctrl", c_void_p),
        ("qacc", c_void_p),
        ("xpos", c_void_p),
        ("xquat", c_void_p),
        ("xmat", c_void_p),
        ("xipos", c_void_p),
        ("ximat", c_void_p),
        ("xanchor", c_void_p),
        ("xaxis", c_void_p),
        ("geom_xpos", c_void_p),
        ("geom_xmat", c_void_p),
        ("site_xpos", c_void_p),
        ("site_xmat", c_void_p),
        ("subtree_com", c_void_p),
        ("cinert", c_void_p),
        ("cvel", c_void_p),
        ("cfrc_ext", c_void_p),
        ("sensordata", c_void_p),
        ("actuator_length", c_void_p),
        ("actuator_velocity", c_void_p),
        ("actuator_force", c_void_p),
        ("qfrc_actuator", c_void_p),
        ("qfrc_passive", c_void_p),
        ("qfrc_bias", c_void_p),
        ("qfrc_constraint", c_void_p),
        ("ten_length", c_void_p),
        ("ten_velocity", c_void_p),
        ("contacts", POINTER(mjenv_contact)),
        ("qpos0", c_void_p),
        ("body_mass", c_void_p),
        ("arrays", POINTER(c_void_p)),
        ("parameters", c_void_p),
        ("action_count", c_int32),
        ("reserved2", c_int32),
    )


class mjenv_start(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_int32),
        ("api", c_void_p),
        ("random", c_void_p),
        ("qpos0", c_void_p),
        ("qpos", c_void_p),
        ("qvel", c_void_p),
        ("act", c_void_p),
        ("carried", c_void_p),
        ("arrays", POINTER(c_void_p)),
        ("nq", c_int32),
        ("nv", c_int32),
        ("na", c_int32),
        ("carry_count", c_int32),
        ("parameters", c_void_p),
        ("sim", POINTER(mjenv_sim)),
        ("time", c_void_p),
        ("own", POINTER(c_void_p)),
    )


class mjenv_outcome(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("terminated", c_int32),
        ("reward", c_double),
        ("info", c_void_p),
        ("carried", c_void_p),
        ("random", c_void_p),
        ("own", POINTER(c_void_p)),
        ("qvel", c_void_p),
    )


class mjenv_control(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("substep", c_int32),
        ("ctrl", c_void_p),
        ("carried", c_void_p),
        ("random", c_void_p),
        ("own", POINTER(c_void_p)),
        ("qvel", c_void_p),
    )


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
        ("reset", c_void_p),
        ("reset_info", c_void_p),
        ("carry", c_void_p),
        ("observe", c_void_p),
        ("step", c_void_p),
        ("caller_thread", c_int32),
        ("physics_only", c_int32),
        ("fixed_model", c_int32),
        ("fixed_frame_skip", c_int32),
        ("before_step", c_void_p),
        ("before_substep", c_void_p),
        ("compute_reward", c_void_p),
    )


class mjenv_plugin(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("abi_version", c_uint32),
        ("tasks", POINTER(mjenv_task)),
        ("task_count", c_int64),
    )


class mjenv_task_api(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("abi_version", c_uint32),
        ("fail_with", CFUNCTYPE(c_int32, c_char_p)),
        ("integer", CFUNCTYPE(c_int64, c_void_p, c_char_p)),
        ("reals", CFUNCTYPE(None, c_void_p, c_char_p, c_void_p, c_int64)),
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
        ("forward", CFUNCTYPE(c_int32, POINTER(mjenv_start))),
        ("advance", CFUNCTYPE(c_int32, POINTER(mjenv_start), c_int64)),
        ("restart", CFUNCTYPE(c_int32, POINTER(mjenv_start))),
        ("contact_count", CFUNCTYPE(c_int64, POINTER(mjenv_start))),
        ("state_rand", CFUNCTYPE(c_double, c_void_p)),
        ("state_uniform", CFUNCTYPE(c_double, c_void_p, c_double, c_double)),
        ("state_randn", CFUNCTYPE(c_double, c_void_p)),
        ("state_randint", CFUNCTYPE(c_int64, c_void_p, c_int64, c_int64)),
        ("state_choice", CFUNCTYPE(c_int64, c_void_p, c_int64, c_void_p)),
        ("state_is_new", CFUNCTYPE(c_int32, c_void_p)),
        ("action", CFUNCTYPE(None, c_void_p, c_int64, c_void_p, c_void_p)),
        ("state_permutation", CFUNCTYPE(None, c_void_p, c_int64, c_void_p)),
        ("control_forward", CFUNCTYPE(c_int32, POINTER(mjenv_control))),
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


class mjenv_random(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_int32),
        ("api", POINTER(mjenv_task_api)),
    )

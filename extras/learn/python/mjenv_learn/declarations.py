"""learn.h in ctypes. Written by tools/declarations.py: do not edit."""
# ruff: noqa: N801

from ctypes import (
    CDLL,
    Structure,
    c_char_p,
    c_double,
    c_float,
    c_int32,
    c_int64,
    c_uint32,
    c_uint64,
    c_void_p,
)
from enum import IntEnum

from mjenv.capi.declarations import mjenv_batch, mjenv_option, mjenv_space
from mjenv.capi.pointers import POINTER

ABI_VERSION = 1


class Learned(IntEnum):
    LAST = 1
    BEST = 2


class Precision(IntEnum):
    FLOAT64 = 1
    FLOAT32 = 2


class mjenv_learn_calls(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("last_error", c_void_p),
        ("info_of", c_void_p),
        ("options_of", c_void_p),
        ("options_get_string", c_void_p),
        ("space_of", c_void_p),
        ("seed", c_void_p),
        ("reset", c_void_p),
        ("step", c_void_p),
        ("snapshot", c_void_p),
        ("restore", c_void_p),
        ("field_at", c_void_p),
    )


class mjenv_learn_report(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("updates", c_int64),
        ("steps", c_int64),
        ("episodes", c_int64),
        ("mean_return", c_double),
        ("mean_length", c_double),
        ("learning_rate", c_double),
        ("policy_loss", c_double),
        ("value_loss", c_double),
        ("entropy", c_double),
        ("approx_kl", c_double),
        ("clip_fraction", c_double),
        ("grad_norm", c_double),
        ("explained_variance", c_double),
        ("std", c_double),
        ("epochs", c_int64),
    )


class mjenv_policy_spec(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("layer_count", c_int64),
        ("clip", c_double),
        ("mean", POINTER(c_double)),
        ("scale", POINTER(c_double)),
        ("low", POINTER(c_double)),
        ("high", POINTER(c_double)),
        ("input_count", c_int64),
        ("about", c_char_p),
    )


class mjenv_policy_input(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("name", c_char_p),
        ("count", c_int64),
        ("seen", c_int64),
        ("elements", POINTER(c_int64)),
    )


class mjenv_policy_layer(Structure):
    _fields_ = (
        ("struct_size", c_uint32),
        ("reserved", c_uint32),
        ("activation", c_char_p),
        ("inputs", c_int64),
        ("outputs", c_int64),
        ("weights", POINTER(c_double)),
        ("bias", POINTER(c_double)),
    )


class Library(CDLL):
    def __init__(self, path: str) -> None:
        super().__init__(path)
        self.mjenv_learn_abi_version.argtypes = ()
        self.mjenv_learn_abi_version.restype = c_uint32
        self.mjenv_learn_last_error.argtypes = ()
        self.mjenv_learn_last_error.restype = c_char_p
        self.mjenv_learn_instructions.argtypes = ()
        self.mjenv_learn_instructions.restype = c_char_p
        self.mjenv_learn_setting_count.argtypes = ()
        self.mjenv_learn_setting_count.restype = c_int64
        self.mjenv_learn_setting_at.argtypes = (c_int64, POINTER(mjenv_option))
        self.mjenv_learn_setting_at.restype = c_int32
        self.mjenv_learn_settings.argtypes = (c_char_p, c_char_p, c_char_p, c_int64, POINTER(c_int64))
        self.mjenv_learn_settings.restype = c_int32
        self.mjenv_learner_create.argtypes = (
            POINTER(mjenv_learn_calls),
            c_void_p,
            c_char_p,
            c_char_p,
            POINTER(c_void_p),
        )
        self.mjenv_learner_create.restype = c_int32
        self.mjenv_learner_create_apart.argtypes = (
            POINTER(mjenv_space),
            POINTER(mjenv_space),
            c_char_p,
            c_char_p,
            POINTER(c_double),
            c_int64,
            POINTER(c_void_p),
        )
        self.mjenv_learner_create_apart.restype = c_int32
        self.mjenv_learner_destroy.argtypes = (c_void_p,)
        self.mjenv_learner_destroy.restype = None
        self.mjenv_learner_train.argtypes = (c_void_p, c_int64)
        self.mjenv_learner_train.restype = c_int32
        self.mjenv_learner_act.argtypes = (c_void_p, POINTER(c_float), c_int64)
        self.mjenv_learner_act.restype = c_int32
        self.mjenv_learner_feed.argtypes = (c_void_p, POINTER(mjenv_batch))
        self.mjenv_learner_feed.restype = c_int32
        self.mjenv_learner_restart.argtypes = (c_void_p, POINTER(c_double), c_int64)
        self.mjenv_learner_restart.restype = c_int32
        self.mjenv_learner_set_env.argtypes = (c_void_p, c_void_p)
        self.mjenv_learner_set_env.restype = c_int32
        self.mjenv_learner_set.argtypes = (c_void_p, c_char_p)
        self.mjenv_learner_set.restype = c_int32
        self.mjenv_learner_report.argtypes = (c_void_p, POINTER(mjenv_learn_report))
        self.mjenv_learner_report.restype = c_int32
        self.mjenv_learner_report_at.argtypes = (c_void_p, c_int64, POINTER(mjenv_learn_report))
        self.mjenv_learner_report_at.restype = c_int32
        self.mjenv_learner_save.argtypes = (c_void_p, c_char_p, c_char_p)
        self.mjenv_learner_save.restype = c_int32
        self.mjenv_checkpoint_note.argtypes = (c_char_p, c_char_p, c_int64, POINTER(c_int64))
        self.mjenv_checkpoint_note.restype = c_int32
        self.mjenv_learner_load.argtypes = (c_void_p, c_char_p)
        self.mjenv_learner_load.restype = c_int32
        self.mjenv_learner_policy.argtypes = (c_void_p, c_int32, c_char_p, c_int64, POINTER(c_int64))
        self.mjenv_learner_policy.restype = c_int32
        self.mjenv_learner_save_policy.argtypes = (c_void_p, c_int32, c_char_p)
        self.mjenv_learner_save_policy.restype = c_int32
        self.mjenv_learner_describe.argtypes = (c_void_p, c_char_p, POINTER(c_char_p), POINTER(c_int64), c_int64)
        self.mjenv_learner_describe.restype = c_int32
        self.mjenv_policy_parse.argtypes = (c_char_p, c_int64, POINTER(c_void_p))
        self.mjenv_policy_parse.restype = c_int32
        self.mjenv_policy_load.argtypes = (c_char_p, POINTER(c_void_p))
        self.mjenv_policy_load.restype = c_int32
        self.mjenv_policy_destroy.argtypes = (c_void_p,)
        self.mjenv_policy_destroy.restype = None
        self.mjenv_policy_id.argtypes = (c_void_p,)
        self.mjenv_policy_id.restype = c_char_p
        self.mjenv_policy_sizes.argtypes = (c_void_p, POINTER(c_int64), POINTER(c_int64))
        self.mjenv_policy_sizes.restype = c_int32
        self.mjenv_policy_spec_of.argtypes = (c_void_p, POINTER(mjenv_policy_spec))
        self.mjenv_policy_spec_of.restype = c_int32
        self.mjenv_policy_layer_at.argtypes = (c_void_p, c_int64, POINTER(mjenv_policy_layer))
        self.mjenv_policy_layer_at.restype = c_int32
        self.mjenv_policy_input_at.argtypes = (c_void_p, c_int64, POINTER(mjenv_policy_input))
        self.mjenv_policy_input_at.restype = c_int32
        self.mjenv_policy_find.argtypes = (
            c_void_p,
            POINTER(c_char_p),
            POINTER(c_int64),
            c_int64,
            POINTER(c_int64),
            c_int64,
        )
        self.mjenv_policy_find.restype = c_int32
        self.mjenv_policy_act.argtypes = (
            c_void_p,
            c_int32,
            c_int64,
            POINTER(c_double),
            c_int64,
            POINTER(c_float),
            c_int64,
        )
        self.mjenv_policy_act.restype = c_int32
        self.mjenv_evaluate.argtypes = (
            POINTER(mjenv_learn_calls),
            c_void_p,
            c_void_p,
            c_int32,
            c_uint64,
            c_int64,
            POINTER(c_double),
            POINTER(c_int64),
        )
        self.mjenv_evaluate.restype = c_int32

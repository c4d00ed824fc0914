"""The recorded cases: ids, options, seeds, lengths."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np

IS_MUJOCO_4 = mujoco.__version__.startswith("4.")
# Of MuJoCo 4.0 less is recorded, because tests/live compares the rest.
STEPS = 50 if IS_MUJOCO_4 else 100
LONG_STEPS = 30 if IS_MUJOCO_4 else 60  # where an observation has hundreds of numbers
EPISODE = 20 if IS_MUJOCO_4 else 40
SEED = 3
OPTIONS_SEED = 2**40 + 7
EXAMPLE_SEED = 42
EXAMPLE_EPISODES = 3

ROBOTS = (
    "Ant",
    "HalfCheetah",
    "Hopper",
    "Humanoid",
    "HumanoidStandup",
    "InvertedDoublePendulum",
    "InvertedPendulum",
    "Pusher",
    "Reacher",
    "Swimmer",
    "Walker2d",
)
# Gymnasium refuses Pusher-v4 from MuJoCo 3 on.
LACKING = {"Pusher-v4"} if IS_MUJOCO_4 else set()
IDS = sorted({f"{robot}-v{version}" for robot in ROBOTS for version in (4, 5)} - LACKING)
RENDER_OPTIONS = ("default_camera_config",)
INF = math.inf

# Values far from the defaults, with which episodes still make sense; ints where Gymnasium then returns another type.
OPTIONS: dict[str, dict[str, Any]] = {
    "Ant-v4": {
        "ctrl_cost_weight": 0.3,
        "use_contact_forces": True,
        "contact_cost_weight": 1e-3,
        "healthy_reward": 2,
        "terminate_when_unhealthy": False,
        "healthy_z_range": (0.45, 0.8),
        "contact_force_range": (-0.5, 0.7),
        "reset_noise_scale": 0.2,
        "exclude_current_positions_from_observation": False,
    },
    "Ant-v5": {
        "frame_skip": 3,
        "forward_reward_weight": 1.3,
        "ctrl_cost_weight": 0.3,
        "contact_cost_weight": 1e-3,
        "healthy_reward": 2,
        "main_body": "front_left_leg",
        "healthy_z_range": (0.4, 0.85),
        "contact_force_range": (-INF, 0.7),
        "reset_noise_scale": 0.15,
        "exclude_current_positions_from_observation": False,
        "include_cfrc_ext_in_observation": False,
    },
    "HalfCheetah-v4": {
        "forward_reward_weight": 0.7,
        "ctrl_cost_weight": 0.3,
        "reset_noise_scale": 0.3,
        "exclude_current_positions_from_observation": False,
    },
    "HalfCheetah-v5": {
        "frame_skip": 2,
        "forward_reward_weight": 0.7,
        "ctrl_cost_weight": 0.3,
        "reset_noise_scale": 0.3,
        "exclude_current_positions_from_observation": False,
    },
    "Hopper-v4": {
        "forward_reward_weight": 1.7,
        "ctrl_cost_weight": 3e-3,
        "healthy_reward": 0.7,
        "terminate_when_unhealthy": False,
        "healthy_state_range": (-5.0, 4.0),
        "healthy_z_range": (0.9, 1.6),
        "healthy_angle_range": (-0.1, INF),
        "reset_noise_scale": 2e-2,
        "exclude_current_positions_from_observation": False,
    },
    "Hopper-v5": {
        "frame_skip": 7,
        "forward_reward_weight": 1.7,
        "ctrl_cost_weight": 3e-3,
        "healthy_reward": 2,
        "healthy_state_range": (-9.0, 8.0),
        "healthy_z_range": (-INF, 1.6),
        "healthy_angle_range": (-0.3, 0.25),
        "reset_noise_scale": 2e-2,
        "exclude_current_positions_from_observation": False,
    },
    "Humanoid-v4": {
        "forward_reward_weight": 0.9,
        "ctrl_cost_weight": 0.3,
        "healthy_reward": 3,
        "terminate_when_unhealthy": False,
        "healthy_z_range": (1.2, 1.6),
        "reset_noise_scale": 5e-2,
        "exclude_current_positions_from_observation": False,
    },
    "Humanoid-v5": {
        "xml_file": "humanoidstandup.xml",
        "frame_skip": 4,
        "forward_reward_weight": 0.9,
        "ctrl_cost_weight": 0.3,
        "contact_cost_weight": 3e-6,
        "contact_cost_range": (0.1, 2.0),
        "healthy_reward": 3,
        "healthy_z_range": (0.07, 0.16),
        "reset_noise_scale": 2e-2,
        "exclude_current_positions_from_observation": False,
        "include_cvel_in_observation": False,
        "include_cfrc_ext_in_observation": False,
    },
    "HumanoidStandup-v4": {},
    "HumanoidStandup-v5": {
        "xml_file": "humanoid.xml",
        "frame_skip": 3,
        "uph_cost_weight": 7,
        "ctrl_cost_weight": 0.2,
        "impact_cost_weight": 3e-6,
        "impact_cost_range": (0.05, 3.0),
        "reset_noise_scale": 5e-2,
        "exclude_current_positions_from_observation": False,
        "include_cinert_in_observation": False,
        "include_qfrc_actuator_in_observation": False,
    },
    "InvertedDoublePendulum-v4": {},
    "InvertedDoublePendulum-v5": {"frame_skip": 2, "healthy_reward": 3, "reset_noise_scale": 0.05},
    "InvertedPendulum-v4": {},
    "InvertedPendulum-v5": {"frame_skip": 1, "reset_noise_scale": 0.05},
    "Pusher-v4": {},
    "Pusher-v5": {
        "xml_file": "pusher.xml",
        "frame_skip": 3,
        "reward_near_weight": 0.9,
        "reward_dist_weight": 1.7,
        "reward_control_weight": 0.3,
    },
    "Reacher-v4": {},
    "Reacher-v5": {"frame_skip": 3, "reward_dist_weight": 1.7, "reward_control_weight": 0.3},
    "Swimmer-v4": {
        "forward_reward_weight": 1.3,
        "ctrl_cost_weight": 3e-3,
        "reset_noise_scale": 0.3,
        "exclude_current_positions_from_observation": False,
    },
    "Swimmer-v5": {
        "frame_skip": 2,
        "forward_reward_weight": 1.3,
        "ctrl_cost_weight": 3e-3,
        "reset_noise_scale": 0.3,
        "exclude_current_positions_from_observation": False,
    },
    "Walker2d-v4": {
        "forward_reward_weight": 1.3,
        "ctrl_cost_weight": 3e-3,
        "healthy_reward": 0.7,
        "terminate_when_unhealthy": False,
        "healthy_z_range": (1.1, INF),
        "healthy_angle_range": (-0.2, 0.3),
        "reset_noise_scale": 2e-2,
        "exclude_current_positions_from_observation": False,
    },
    "Walker2d-v5": {
        "xml_file": "walker2d.xml",
        "frame_skip": 6,
        "forward_reward_weight": 1.3,
        "ctrl_cost_weight": 3e-3,
        "healthy_reward": 2,
        "healthy_z_range": (0.9, 1.5),
        "healthy_angle_range": (-0.5, 0.6),
        "reset_noise_scale": 2e-2,
        "exclude_current_positions_from_observation": False,
    },
}
# Cases that the option "strict" would refuse; the noise of HalfCheetah makes MuJoCo restart the simulation.
UNGUARDED: dict[str, tuple[type, dict[str, Any]]] = {
    "Ant-v5": (np.float32, {}),
    "HalfCheetah-v5": (np.float64, {"reset_noise_scale": 1.2e10}),
    "Humanoid-v4": (np.float64, {}),
    "InvertedDoublePendulum-v5": (np.float32, {}),
}
# Models of our own, for the robots that take models.
CUSTOM_MODELS = {
    "spider": ("Ant-v5", {"healthy_z_range": (0.3, 1.0), "contact_cost_weight": 1e-3}),
    "tailed_cheetah": ("HalfCheetah-v5", {}),
    "chain": ("Swimmer-v5", {"frame_skip": 3}),
    "stickman": ("Humanoid-v5", {"contact_cost_weight": 1e-5}),
}
if IS_MUJOCO_4:
    del CUSTOM_MODELS["chain"]  # chooses which geoms collide by an option that MuJoCo 3 removed

RESET, STEP, SET_STATE, SIMULATE = 0, 1, 2, 3
STAGES = (
    *(RESET, STEP, STEP, SET_STATE, STEP, STEP, SIMULATE, STEP, RESET, SET_STATE, STEP, SIMULATE, SET_STATE, STEP),
    *(STEP, STEP, SET_STATE, SET_STATE, STEP, SIMULATE, STEP, SET_STATE, RESET),
)
FRAMES = 3
STATE_IDS = ("Ant-v5", "HalfCheetah-v5", "Humanoid-v5", "InvertedDoublePendulum-v4", "Pusher-v4", "Reacher-v4")
if IS_MUJOCO_4:
    STATE_IDS = ("Ant-v5", "InvertedDoublePendulum-v4", "Pusher-v5", "Reacher-v4")
INERTIA = "M" if IS_MUJOCO_4 else "qM"
DATA_ARRAYS = (
    "time qpos qvel qacc qacc_warmstart ctrl qfrc_applied xfrc_applied xpos xquat xmat xipos xanchor xaxis geom_xpos "
    "site_xpos cam_xpos light_xpos subtree_com cinert cvel ten_length ten_velocity actuator_length actuator_velocity "
    f"actuator_force {INERTIA} qfrc_bias qfrc_passive qfrc_actuator qfrc_smooth qacc_smooth qfrc_constraint cacc "
    "cfrc_int cfrc_ext ncon nefc"
).split()
MODEL_ARRAYS = (
    "nq nv nu nbody njnt ngeom qpos0 body_mass body_inertia body_parentid geom_size geom_friction geom_rgba jnt_range "
    "jnt_limited actuator_ctrlrange actuator_gear opt.timestep opt.gravity opt.iterations stat.extent"
).split()

# Vectors whose rows fall, and vectors whose rows never do.
VECTOR_IDS = ("Ant-v5", "HalfCheetah-v4", "Hopper-v5", "InvertedDoublePendulum-v4", "Reacher-v5", "Walker2d-v4")
VECTOR_ROWS = 3
VECTOR_STEPS = 36
VECTOR_SEED = 4
VECTOR_SEEDS = [None, 2**40 + 7, None]

"""make and make_vec with the keywords of each id. Written by tools/keywords.py from the library: do not edit."""

from collections.abc import Sequence
from os import PathLike
from typing import Any, Literal, TypedDict, overload

from gymnasium.envs.registration import EnvSpec
from numpy.typing import DTypeLike
from typing_extensions import Unpack

from mjenv.capi.keywords import Randomizing, Rendering
from mjenv.gym.env import Environment
from mjenv.gym.vector import VectorEnv
from mjenv.rows.arguments import AutoresetMode

class Common(Rendering, Randomizing, total=False):
    norm: Literal["auto", "fused", "plain"]
    strict: bool
    on_divergence: Literal["continue", "terminate"]
    lanes: Literal["auto", "max"] | int
    cpu_affinity: bool
    arrays: str
    max_contacts: int
    observation: Literal["auto", "flat", "dict"]
    time_aware: bool
    normalize_time: bool
    history: str | int
    history_padding: Literal["reset", "zero"]
    clip_actions: bool
    rescale_actions: Sequence[float]
    engine: str | None
    disable_env_checker: bool | None

class Vector(TypedDict, total=False):
    max_episode_steps: int | None
    num_threads: int
    autoreset_mode: AutoresetMode | str
    dtype: DTypeLike
    copy: bool
    pixels: tuple[int, int] | None
    camera: int | str | None
    action_repeat: int
    frame_stack: int

class AntV4(Common, total=False):
    xml_file: str | PathLike[str]
    ctrl_cost_weight: float
    use_contact_forces: bool
    contact_cost_weight: float
    healthy_reward: float
    terminate_when_unhealthy: bool
    healthy_z_range: Sequence[float]
    contact_force_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class AntV4Vector(AntV4, Vector, total=False): ...

class AntV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    forward_reward_weight: float
    ctrl_cost_weight: float
    contact_cost_weight: float
    healthy_reward: float
    main_body: str | int
    terminate_when_unhealthy: bool
    healthy_z_range: Sequence[float]
    contact_force_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool
    include_cfrc_ext_in_observation: bool
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class AntV5Vector(AntV5, Vector, total=False): ...

class HalfCheetahV4(Common, total=False):
    forward_reward_weight: float
    ctrl_cost_weight: float
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool

class HalfCheetahV4Vector(HalfCheetahV4, Vector, total=False): ...

class HalfCheetahV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    forward_reward_weight: float
    ctrl_cost_weight: float
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class HalfCheetahV5Vector(HalfCheetahV5, Vector, total=False): ...

class HopperV4(Common, total=False):
    forward_reward_weight: float
    ctrl_cost_weight: float
    healthy_reward: float
    terminate_when_unhealthy: bool
    healthy_state_range: Sequence[float]
    healthy_z_range: Sequence[float]
    healthy_angle_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool

class HopperV4Vector(HopperV4, Vector, total=False): ...

class HopperV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    forward_reward_weight: float
    ctrl_cost_weight: float
    healthy_reward: float
    terminate_when_unhealthy: bool
    healthy_state_range: Sequence[float]
    healthy_z_range: Sequence[float]
    healthy_angle_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class HopperV5Vector(HopperV5, Vector, total=False): ...

class HumanoidV4(Common, total=False):
    forward_reward_weight: float
    ctrl_cost_weight: float
    healthy_reward: float
    terminate_when_unhealthy: bool
    healthy_z_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool

class HumanoidV4Vector(HumanoidV4, Vector, total=False): ...

class HumanoidV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    forward_reward_weight: float
    ctrl_cost_weight: float
    contact_cost_weight: float
    contact_cost_range: Sequence[float]
    healthy_reward: float
    terminate_when_unhealthy: bool
    healthy_z_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool
    include_cinert_in_observation: bool
    include_cvel_in_observation: bool
    include_qfrc_actuator_in_observation: bool
    include_cfrc_ext_in_observation: bool
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class HumanoidV5Vector(HumanoidV5, Vector, total=False): ...
class HumanoidStandupV4(Common, total=False): ...
class HumanoidStandupV4Vector(HumanoidStandupV4, Vector, total=False): ...

class HumanoidStandupV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    uph_cost_weight: float
    ctrl_cost_weight: float
    impact_cost_weight: float
    impact_cost_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool
    include_cinert_in_observation: bool
    include_cvel_in_observation: bool
    include_qfrc_actuator_in_observation: bool
    include_cfrc_ext_in_observation: bool
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class HumanoidStandupV5Vector(HumanoidStandupV5, Vector, total=False): ...
class InvertedDoublePendulumV4(Common, total=False): ...
class InvertedDoublePendulumV4Vector(InvertedDoublePendulumV4, Vector, total=False): ...

class InvertedDoublePendulumV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    healthy_reward: float
    reset_noise_scale: float
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class InvertedDoublePendulumV5Vector(InvertedDoublePendulumV5, Vector, total=False): ...
class InvertedPendulumV4(Common, total=False): ...
class InvertedPendulumV4Vector(InvertedPendulumV4, Vector, total=False): ...

class InvertedPendulumV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    reset_noise_scale: float
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class InvertedPendulumV5Vector(InvertedPendulumV5, Vector, total=False): ...
class PusherV4(Common, total=False): ...
class PusherV4Vector(PusherV4, Vector, total=False): ...

class PusherV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    reward_near_weight: float
    reward_dist_weight: float
    reward_control_weight: float
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class PusherV5Vector(PusherV5, Vector, total=False): ...
class ReacherV4(Common, total=False): ...
class ReacherV4Vector(ReacherV4, Vector, total=False): ...

class ReacherV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    reward_dist_weight: float
    reward_control_weight: float
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class ReacherV5Vector(ReacherV5, Vector, total=False): ...

class SwimmerV4(Common, total=False):
    forward_reward_weight: float
    ctrl_cost_weight: float
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool

class SwimmerV4Vector(SwimmerV4, Vector, total=False): ...

class SwimmerV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    forward_reward_weight: float
    ctrl_cost_weight: float
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class SwimmerV5Vector(SwimmerV5, Vector, total=False): ...

class Walker2dV4(Common, total=False):
    forward_reward_weight: float
    ctrl_cost_weight: float
    healthy_reward: float
    terminate_when_unhealthy: bool
    healthy_z_range: Sequence[float]
    healthy_angle_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool

class Walker2dV4Vector(Walker2dV4, Vector, total=False): ...

class Walker2dV5(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    forward_reward_weight: float
    ctrl_cost_weight: float
    healthy_reward: float
    terminate_when_unhealthy: bool
    healthy_z_range: Sequence[float]
    healthy_angle_range: Sequence[float]
    reset_noise_scale: float
    exclude_current_positions_from_observation: bool
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class Walker2dV5Vector(Walker2dV5, Vector, total=False): ...

class ModelV0(Common, total=False):
    xml_file: str | PathLike[str]
    frame_skip: int
    xml_string: str
    trust_xml: Literal["auto", "yes", "no"]

class ModelV0Vector(ModelV0, Vector, total=False): ...

@overload
def make(id: Literal["Ant-v4"], max_episode_steps: int | None = None, **options: Unpack[AntV4]) -> Environment: ...
@overload
def make(id: Literal["Ant-v5"], max_episode_steps: int | None = None, **options: Unpack[AntV5]) -> Environment: ...
@overload
def make(
    id: Literal["HalfCheetah-v4"], max_episode_steps: int | None = None, **options: Unpack[HalfCheetahV4]
) -> Environment: ...
@overload
def make(
    id: Literal["HalfCheetah-v5"], max_episode_steps: int | None = None, **options: Unpack[HalfCheetahV5]
) -> Environment: ...
@overload
def make(
    id: Literal["Hopper-v4"], max_episode_steps: int | None = None, **options: Unpack[HopperV4]
) -> Environment: ...
@overload
def make(
    id: Literal["Hopper-v5"], max_episode_steps: int | None = None, **options: Unpack[HopperV5]
) -> Environment: ...
@overload
def make(
    id: Literal["Humanoid-v4"], max_episode_steps: int | None = None, **options: Unpack[HumanoidV4]
) -> Environment: ...
@overload
def make(
    id: Literal["Humanoid-v5"], max_episode_steps: int | None = None, **options: Unpack[HumanoidV5]
) -> Environment: ...
@overload
def make(
    id: Literal["HumanoidStandup-v4"], max_episode_steps: int | None = None, **options: Unpack[HumanoidStandupV4]
) -> Environment: ...
@overload
def make(
    id: Literal["HumanoidStandup-v5"], max_episode_steps: int | None = None, **options: Unpack[HumanoidStandupV5]
) -> Environment: ...
@overload
def make(
    id: Literal["InvertedDoublePendulum-v4"],
    max_episode_steps: int | None = None,
    **options: Unpack[InvertedDoublePendulumV4],
) -> Environment: ...
@overload
def make(
    id: Literal["InvertedDoublePendulum-v5"],
    max_episode_steps: int | None = None,
    **options: Unpack[InvertedDoublePendulumV5],
) -> Environment: ...
@overload
def make(
    id: Literal["InvertedPendulum-v4"], max_episode_steps: int | None = None, **options: Unpack[InvertedPendulumV4]
) -> Environment: ...
@overload
def make(
    id: Literal["InvertedPendulum-v5"], max_episode_steps: int | None = None, **options: Unpack[InvertedPendulumV5]
) -> Environment: ...
@overload
def make(
    id: Literal["Pusher-v4"], max_episode_steps: int | None = None, **options: Unpack[PusherV4]
) -> Environment: ...
@overload
def make(
    id: Literal["Pusher-v5"], max_episode_steps: int | None = None, **options: Unpack[PusherV5]
) -> Environment: ...
@overload
def make(
    id: Literal["Reacher-v4"], max_episode_steps: int | None = None, **options: Unpack[ReacherV4]
) -> Environment: ...
@overload
def make(
    id: Literal["Reacher-v5"], max_episode_steps: int | None = None, **options: Unpack[ReacherV5]
) -> Environment: ...
@overload
def make(
    id: Literal["Swimmer-v4"], max_episode_steps: int | None = None, **options: Unpack[SwimmerV4]
) -> Environment: ...
@overload
def make(
    id: Literal["Swimmer-v5"], max_episode_steps: int | None = None, **options: Unpack[SwimmerV5]
) -> Environment: ...
@overload
def make(
    id: Literal["Walker2d-v4"], max_episode_steps: int | None = None, **options: Unpack[Walker2dV4]
) -> Environment: ...
@overload
def make(
    id: Literal["Walker2d-v5"], max_episode_steps: int | None = None, **options: Unpack[Walker2dV5]
) -> Environment: ...
@overload
def make(id: Literal["Model-v0"], max_episode_steps: int | None = None, **options: Unpack[ModelV0]) -> Environment: ...
@overload
def make(
    id: str | EnvSpec, max_episode_steps: int | None = None, disable_env_checker: bool | None = None, **options: Any
) -> Environment: ...
@overload
def make_vec(id: Literal["Ant-v4"], num_envs: int = 1, **options: Unpack[AntV4Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Ant-v5"], num_envs: int = 1, **options: Unpack[AntV5Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["HalfCheetah-v4"], num_envs: int = 1, **options: Unpack[HalfCheetahV4Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["HalfCheetah-v5"], num_envs: int = 1, **options: Unpack[HalfCheetahV5Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Hopper-v4"], num_envs: int = 1, **options: Unpack[HopperV4Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Hopper-v5"], num_envs: int = 1, **options: Unpack[HopperV5Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Humanoid-v4"], num_envs: int = 1, **options: Unpack[HumanoidV4Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Humanoid-v5"], num_envs: int = 1, **options: Unpack[HumanoidV5Vector]) -> VectorEnv: ...
@overload
def make_vec(
    id: Literal["HumanoidStandup-v4"], num_envs: int = 1, **options: Unpack[HumanoidStandupV4Vector]
) -> VectorEnv: ...
@overload
def make_vec(
    id: Literal["HumanoidStandup-v5"], num_envs: int = 1, **options: Unpack[HumanoidStandupV5Vector]
) -> VectorEnv: ...
@overload
def make_vec(
    id: Literal["InvertedDoublePendulum-v4"], num_envs: int = 1, **options: Unpack[InvertedDoublePendulumV4Vector]
) -> VectorEnv: ...
@overload
def make_vec(
    id: Literal["InvertedDoublePendulum-v5"], num_envs: int = 1, **options: Unpack[InvertedDoublePendulumV5Vector]
) -> VectorEnv: ...
@overload
def make_vec(
    id: Literal["InvertedPendulum-v4"], num_envs: int = 1, **options: Unpack[InvertedPendulumV4Vector]
) -> VectorEnv: ...
@overload
def make_vec(
    id: Literal["InvertedPendulum-v5"], num_envs: int = 1, **options: Unpack[InvertedPendulumV5Vector]
) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Pusher-v4"], num_envs: int = 1, **options: Unpack[PusherV4Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Pusher-v5"], num_envs: int = 1, **options: Unpack[PusherV5Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Reacher-v4"], num_envs: int = 1, **options: Unpack[ReacherV4Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Reacher-v5"], num_envs: int = 1, **options: Unpack[ReacherV5Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Swimmer-v4"], num_envs: int = 1, **options: Unpack[SwimmerV4Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Swimmer-v5"], num_envs: int = 1, **options: Unpack[SwimmerV5Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Walker2d-v4"], num_envs: int = 1, **options: Unpack[Walker2dV4Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Walker2d-v5"], num_envs: int = 1, **options: Unpack[Walker2dV5Vector]) -> VectorEnv: ...
@overload
def make_vec(id: Literal["Model-v0"], num_envs: int = 1, **options: Unpack[ModelV0Vector]) -> VectorEnv: ...
@overload
def make_vec(id: str | EnvSpec, num_envs: int = 1, **options: Any) -> VectorEnv: ...

# Written by tools/declarations.py from mjenv.h and task.h in capi/include/mjenv: do not edit.

const MJENV_ABI_VERSION = 1
const MJENV_ALL_ROWS = -1
const MJENV_CAMERA_FREE = -1
const MJENV_BODY_UNSET = -2

struct mjenv_options end
struct mjenv_env end
struct mjenv_renderer end
struct mjenv_window end

@enum mjenv_status::Int32 begin
    MJENV_OK = 0
    MJENV_DIVERGED = 1
    MJENV_E_ARGUMENT = -1
    MJENV_E_NAME = -2
    MJENV_E_TYPE = -3
    MJENV_E_VALUE = -4
    MJENV_E_SIZE = -5
    MJENV_E_NOT_RESET = -6
    MJENV_E_EPISODE_ENDED = -7
    MJENV_E_PENDING = -8
    MJENV_E_NOT_PENDING = -9
    MJENV_E_BUSY = -10
    MJENV_E_FORKED = -11
    MJENV_E_FILE = -12
    MJENV_E_MODEL = -13
    MJENV_E_PHYSICS = -14
    MJENV_E_SNAPSHOT = -15
    MJENV_E_RENDER = -16
    MJENV_E_MEMORY = -17
    MJENV_E_INTERNAL = -18
    MJENV_E_TASK = -19
end

@enum mjenv_distribution::Int32 begin
    MJENV_DISTRIBUTION_UNIFORM = 0
    MJENV_DISTRIBUTION_NORMAL = 1
    MJENV_DISTRIBUTION_INTEGERS = 2
end

@enum mjenv_dtype::Int32 begin
    MJENV_DTYPE_FLOAT64 = 1
    MJENV_DTYPE_FLOAT32 = 2
    MJENV_DTYPE_INT64 = 3
    MJENV_DTYPE_INT32 = 4
    MJENV_DTYPE_UINT8 = 5
    MJENV_DTYPE_ACTION = 6
    MJENV_DTYPE_NATIVE_FLOAT = 7
    MJENV_DTYPE_NATIVE_INT = 8
end

@enum mjenv_role::Int32 begin
    MJENV_ROLE_OBSERVATION = 1
    MJENV_ROLE_ACTION = 2
    MJENV_ROLE_INFO = 3
    MJENV_ROLE_RESET_INFO = 4
    MJENV_ROLE_REWARD = 5
    MJENV_ROLE_STRUCTURE = 6
    MJENV_ROLE_DATA = 7
    MJENV_ROLE_MODEL = 8
    MJENV_ROLE_ARRAYS = 9
    MJENV_ROLE_PARAMETERS = 10
    MJENV_ROLE_GROUPS = 11
end

@enum mjenv_kind::Int32 begin
    MJENV_KIND_FLAG = 1
    MJENV_KIND_INTEGER = 2
    MJENV_KIND_REALS = 3
    MJENV_KIND_STRING = 4
    MJENV_KIND_STRING_OR_INT = 5
end

@enum mjenv_gl::Int32 begin
    MJENV_GL_AUTO = 0
    MJENV_GL_EGL = 1
    MJENV_GL_OSMESA = 2
    MJENV_GL_GLFW = 3
    MJENV_GL_WGL = 4
end

@enum mjenv_visual::Int32 begin
    MJENV_VISUAL_CONVEXHULL = 0
    MJENV_VISUAL_TEXTURE = 1
    MJENV_VISUAL_JOINT = 2
    MJENV_VISUAL_CAMERA = 3
    MJENV_VISUAL_ACTUATOR = 4
    MJENV_VISUAL_ACTIVATION = 5
    MJENV_VISUAL_LIGHT = 6
    MJENV_VISUAL_TENDON = 7
    MJENV_VISUAL_RANGEFINDER = 8
    MJENV_VISUAL_CONSTRAINT = 9
    MJENV_VISUAL_INERTIA = 10
    MJENV_VISUAL_SCLINERTIA = 11
    MJENV_VISUAL_PERTFORCE = 12
    MJENV_VISUAL_PERTOBJ = 13
    MJENV_VISUAL_CONTACTPOINT = 14
    MJENV_VISUAL_CONTACTFORCE = 15
    MJENV_VISUAL_CONTACTSPLIT = 16
    MJENV_VISUAL_TRANSPARENT = 17
    MJENV_VISUAL_AUTOCONNECT = 18
    MJENV_VISUAL_COM = 19
    MJENV_VISUAL_SELECT = 20
    MJENV_VISUAL_STATIC = 21
    MJENV_VISUAL_SKIN = 22
end

@enum mjenv_label::Int32 begin
    MJENV_LABEL_NONE = 0
    MJENV_LABEL_BODY = 1
    MJENV_LABEL_JOINT = 2
    MJENV_LABEL_GEOM = 3
    MJENV_LABEL_SITE = 4
    MJENV_LABEL_CAMERA = 5
    MJENV_LABEL_LIGHT = 6
    MJENV_LABEL_TENDON = 7
    MJENV_LABEL_ACTUATOR = 8
    MJENV_LABEL_CONSTRAINT = 9
    MJENV_LABEL_SKIN = 10
    MJENV_LABEL_SELECTION = 11
    MJENV_LABEL_SELPNT = 12
    MJENV_LABEL_CONTACTFORCE = 13
end

@enum mjenv_frame::Int32 begin
    MJENV_FRAME_NONE = 0
    MJENV_FRAME_BODY = 1
    MJENV_FRAME_GEOM = 2
    MJENV_FRAME_SITE = 3
    MJENV_FRAME_CAMERA = 4
    MJENV_FRAME_LIGHT = 5
    MJENV_FRAME_CONTACT = 6
    MJENV_FRAME_WORLD = 7
end

Base.@kwdef struct mjenv_option
    struct_size::UInt32 = sizeof(mjenv_option)
    kind::Int32 = 0
    name::Cstring = Cstring(C_NULL)
    doc::Cstring = Cstring(C_NULL)
    low::Float64 = 0
    high::Float64 = 0
    count::Int64 = 0
    choices::Cstring = Cstring(C_NULL)
end

Base.@kwdef struct mjenv_field
    struct_size::UInt32 = sizeof(mjenv_field)
    ndim::Int32 = 0
    name::Cstring = Cstring(C_NULL)
    doc::Cstring = Cstring(C_NULL)
    shape::NTuple{4, Int64} = (0, 0, 0, 0)
    offset::Int64 = 0
    count::Int64 = 0
    dtype::Int32 = 0
    reserved::Int32 = 0
end

Base.@kwdef struct mjenv_space
    struct_size::UInt32 = sizeof(mjenv_space)
    dtype::Int32 = 0
    count::Int64 = 0
    low::Ptr{Float64} = Ptr{Float64}(C_NULL)
    high::Ptr{Float64} = Ptr{Float64}(C_NULL)
    ndim::Int32 = 0
    reserved::Int32 = 0
    shape::NTuple{4, Int64} = (0, 0, 0, 0)
end

Base.@kwdef struct mjenv_info
    struct_size::UInt32 = sizeof(mjenv_info)
    threads::Int32 = 0
    rows::Int64 = 0
    frame_skip::Int64 = 0
    lanes::Int64 = 0
    lanes_reason::Cstring = Cstring(C_NULL)
end

Base.@kwdef struct mjenv_spec
    struct_size::UInt32 = sizeof(mjenv_spec)
    version::Int32 = 0
    id::Cstring = Cstring(C_NULL)
    robot::Cstring = Cstring(C_NULL)
    max_episode_steps::Int64 = 0
    reward_threshold::Float64 = 0
    camera_distance::Float64 = 0
    camera_elevation::Float64 = 0
    camera_lookat::NTuple{3, Float64} = (0, 0, 0)
    camera_trackbodyid::Int32 = 0
    revision::Int32 = 0
    model_xml::Cstring = Cstring(C_NULL)
end

Base.@kwdef struct mjenv_batch
    struct_size::UInt32 = sizeof(mjenv_batch)
    obs_dtype::Int32 = 0
    rows::Int64 = 0
    obs_count::Int64 = 0
    info_count::Int64 = 0
    reset_info_count::Int64 = 0
    arrays_count::Int64 = 0
    obs::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    reward::Ptr{Float64} = Ptr{Float64}(C_NULL)
    terminated::Ptr{UInt8} = Ptr{UInt8}(C_NULL)
    truncated::Ptr{UInt8} = Ptr{UInt8}(C_NULL)
    status::Ptr{Int32} = Ptr{Int32}(C_NULL)
    info::Ptr{Float64} = Ptr{Float64}(C_NULL)
    was_reset::Ptr{UInt8} = Ptr{UInt8}(C_NULL)
    reset_info::Ptr{Float64} = Ptr{Float64}(C_NULL)
    final_obs::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    final_info::Ptr{Float64} = Ptr{Float64}(C_NULL)
    arrays::Ptr{Float64} = Ptr{Float64}(C_NULL)
end

Base.@kwdef struct mjenv_render_settings
    struct_size::UInt32 = sizeof(mjenv_render_settings)
    gl::Int32 = 0
    width::Int32 = 0
    height::Int32 = 0
    camera::Int32 = 0
    max_geom::Int32 = 0
    samples::Int32 = 0
    shadows::Int32 = 0
    reflections::Int32 = 0
    reserved::Int32 = 0
    camera_name::Cstring = Cstring(C_NULL)
    lookat::NTuple{3, Float64} = (0, 0, 0)
    distance::Float64 = 0
    azimuth::Float64 = 0
    elevation::Float64 = 0
    visual::NTuple{32, UInt8} = (0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    geomgroup::NTuple{6, UInt8} = (0, 0, 0, 0, 0, 0)
    sitegroup::NTuple{6, UInt8} = (0, 0, 0, 0, 0, 0)
    jointgroup::NTuple{6, UInt8} = (0, 0, 0, 0, 0, 0)
    tendongroup::NTuple{6, UInt8} = (0, 0, 0, 0, 0, 0)
    actuatorgroup::NTuple{6, UInt8} = (0, 0, 0, 0, 0, 0)
    skingroup::NTuple{6, UInt8} = (0, 0, 0, 0, 0, 0)
    reserved_bytes::NTuple{4, UInt8} = (0, 0, 0, 0)
    label::Int32 = 0
    frame::Int32 = 0
    wireframe::Int32 = 0
    additive::Int32 = 0
    skybox::Int32 = 0
    fog::Int32 = 0
    haze::Int32 = 0
    cull_face::Int32 = 0
end

Base.@kwdef struct mjenv_task_option
    struct_size::UInt32 = sizeof(mjenv_task_option)
    kind::Int32 = 0
    name::Cstring = Cstring(C_NULL)
    doc::Cstring = Cstring(C_NULL)
    value::Float64 = 0
    low::Float64 = 0
    high::Float64 = 0
    values::Ptr{Float64} = Ptr{Float64}(C_NULL)
    count::Int64 = 0
    text::Cstring = Cstring(C_NULL)
    choices::Cstring = Cstring(C_NULL)
    live::Int32 = 0
    reserved::Int32 = 0
end

Base.@kwdef struct mjenv_task_field
    struct_size::UInt32 = sizeof(mjenv_task_field)
    role::Int32 = 0
    name::Cstring = Cstring(C_NULL)
    doc::Cstring = Cstring(C_NULL)
    dtype::Int32 = 0
    ndim::Int32 = 0
    shape::NTuple{4, Int64} = (0, 0, 0, 0)
    group::Cstring = Cstring(C_NULL)
end

Base.@kwdef struct mjenv_task_camera
    struct_size::UInt32 = sizeof(mjenv_task_camera)
    trackbodyid::Int32 = 0
    distance::Float64 = 0
    lookat::NTuple{3, Float64} = (0, 0, 0)
    elevation::Float64 = 0
end

Base.@kwdef struct mjenv_contact
    geom1::Int32 = 0
    geom2::Int32 = 0
    distance::Float64 = 0
    position::NTuple{3, Float64} = (0, 0, 0)
    frame::NTuple{9, Float64} = (0, 0, 0, 0, 0, 0, 0, 0, 0)
    force::NTuple{6, Float64} = (0, 0, 0, 0, 0, 0)
end

Base.@kwdef struct mjenv_task
    struct_size::UInt32 = sizeof(mjenv_task)
    revision::Int32 = 0
    id::Cstring = Cstring(C_NULL)
    model::Cstring = Cstring(C_NULL)
    model_text::Cstring = Cstring(C_NULL)
    frame_skip::Int32 = 0
    has_reward_threshold::Int32 = 0
    reward_threshold::Float64 = 0
    time_limit::Int64 = 0
    carry_count::Int64 = 0
    camera::Ptr{mjenv_task_camera} = Ptr{mjenv_task_camera}(C_NULL)
    options::Ptr{mjenv_task_option} = Ptr{mjenv_task_option}(C_NULL)
    option_count::Int64 = 0
    fields::Ptr{mjenv_task_field} = Ptr{mjenv_task_field}(C_NULL)
    field_count::Int64 = 0
    user::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    build::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    destroy::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    reset::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    reset_info::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    carry::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    observe::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    step::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    caller_thread::Int32 = 0
    physics_only::Int32 = 0
    fixed_model::Int32 = 0
    fixed_frame_skip::Int32 = 0
    before_step::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    before_substep::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    compute_reward::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
end

Base.@kwdef struct mjenv_plugin
    struct_size::UInt32 = sizeof(mjenv_plugin)
    abi_version::UInt32 = 0
    tasks::Ptr{Ptr{mjenv_task}} = Ptr{Ptr{mjenv_task}}(C_NULL)
    task_count::Int64 = 0
end

Base.@kwdef struct mjenv_task_api
    struct_size::UInt32 = sizeof(mjenv_task_api)
    abi_version::UInt32 = 0
    fail_with::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    integer::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    reals::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    is_integer::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    text::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    index::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    option_index::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    norm_is_fused::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    need::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    array::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    field::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    carry::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    carry_bounds::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    random::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    uniform::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    normal::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    integers::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    choice::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    sample::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    permutation::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    parameter::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    keep::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    current::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    own::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    random_state::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    forward::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    advance::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    restart::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    contact_count::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    state_rand::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    state_uniform::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    state_randn::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    state_randint::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    state_choice::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    state_is_new::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    action::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    state_permutation::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    control_forward::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
end

Base.@kwdef struct mjenv_sim
    struct_size::UInt32 = sizeof(mjenv_sim)
    action_dtype::Int32 = 0
    api::Ptr{mjenv_task_api} = Ptr{mjenv_task_api}(C_NULL)
    nq::Int32 = 0
    nv::Int32 = 0
    na::Int32 = 0
    nu::Int32 = 0
    nbody::Int32 = 0
    njnt::Int32 = 0
    ngeom::Int32 = 0
    nsite::Int32 = 0
    ntendon::Int32 = 0
    nsensordata::Int32 = 0
    contact_count::Int32 = 0
    reserved::Int32 = 0
    timestep::Float64 = 0
    dt::Float64 = 0
    time::Ptr{Float64} = Ptr{Float64}(C_NULL)
    action::Ptr{Float64} = Ptr{Float64}(C_NULL)
    carried::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qpos::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qvel::Ptr{Float64} = Ptr{Float64}(C_NULL)
    act::Ptr{Float64} = Ptr{Float64}(C_NULL)
    ctrl::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qacc::Ptr{Float64} = Ptr{Float64}(C_NULL)
    xpos::Ptr{Float64} = Ptr{Float64}(C_NULL)
    xquat::Ptr{Float64} = Ptr{Float64}(C_NULL)
    xmat::Ptr{Float64} = Ptr{Float64}(C_NULL)
    xipos::Ptr{Float64} = Ptr{Float64}(C_NULL)
    ximat::Ptr{Float64} = Ptr{Float64}(C_NULL)
    xanchor::Ptr{Float64} = Ptr{Float64}(C_NULL)
    xaxis::Ptr{Float64} = Ptr{Float64}(C_NULL)
    geom_xpos::Ptr{Float64} = Ptr{Float64}(C_NULL)
    geom_xmat::Ptr{Float64} = Ptr{Float64}(C_NULL)
    site_xpos::Ptr{Float64} = Ptr{Float64}(C_NULL)
    site_xmat::Ptr{Float64} = Ptr{Float64}(C_NULL)
    subtree_com::Ptr{Float64} = Ptr{Float64}(C_NULL)
    cinert::Ptr{Float64} = Ptr{Float64}(C_NULL)
    cvel::Ptr{Float64} = Ptr{Float64}(C_NULL)
    cfrc_ext::Ptr{Float64} = Ptr{Float64}(C_NULL)
    sensordata::Ptr{Float64} = Ptr{Float64}(C_NULL)
    actuator_length::Ptr{Float64} = Ptr{Float64}(C_NULL)
    actuator_velocity::Ptr{Float64} = Ptr{Float64}(C_NULL)
    actuator_force::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qfrc_actuator::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qfrc_passive::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qfrc_bias::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qfrc_constraint::Ptr{Float64} = Ptr{Float64}(C_NULL)
    ten_length::Ptr{Float64} = Ptr{Float64}(C_NULL)
    ten_velocity::Ptr{Float64} = Ptr{Float64}(C_NULL)
    contacts::Ptr{mjenv_contact} = Ptr{mjenv_contact}(C_NULL)
    qpos0::Ptr{Float64} = Ptr{Float64}(C_NULL)
    body_mass::Ptr{Float64} = Ptr{Float64}(C_NULL)
    arrays::Ptr{Ptr{Cvoid}} = Ptr{Ptr{Cvoid}}(C_NULL)
    parameters::Ptr{Float64} = Ptr{Float64}(C_NULL)
    action_count::Int32 = 0
    reserved2::Int32 = 0
end

Base.@kwdef struct mjenv_random
    struct_size::UInt32 = sizeof(mjenv_random)
    reserved::Int32 = 0
    api::Ptr{mjenv_task_api} = Ptr{mjenv_task_api}(C_NULL)
end

Base.@kwdef struct mjenv_start
    struct_size::UInt32 = sizeof(mjenv_start)
    reserved::Int32 = 0
    api::Ptr{mjenv_task_api} = Ptr{mjenv_task_api}(C_NULL)
    random::Ptr{mjenv_random} = Ptr{mjenv_random}(C_NULL)
    qpos0::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qpos::Ptr{Float64} = Ptr{Float64}(C_NULL)
    qvel::Ptr{Float64} = Ptr{Float64}(C_NULL)
    act::Ptr{Float64} = Ptr{Float64}(C_NULL)
    carried::Ptr{Float64} = Ptr{Float64}(C_NULL)
    arrays::Ptr{Ptr{Cvoid}} = Ptr{Ptr{Cvoid}}(C_NULL)
    nq::Int32 = 0
    nv::Int32 = 0
    na::Int32 = 0
    carry_count::Int32 = 0
    parameters::Ptr{Float64} = Ptr{Float64}(C_NULL)
    sim::Ptr{mjenv_sim} = Ptr{mjenv_sim}(C_NULL)
    time::Ptr{Float64} = Ptr{Float64}(C_NULL)
    own::Ptr{Ptr{Float64}} = Ptr{Ptr{Float64}}(C_NULL)
end

Base.@kwdef struct mjenv_outcome
    struct_size::UInt32 = sizeof(mjenv_outcome)
    terminated::Int32 = 0
    reward::Float64 = 0
    info::Ptr{Float64} = Ptr{Float64}(C_NULL)
    carried::Ptr{Float64} = Ptr{Float64}(C_NULL)
    random::Ptr{mjenv_random} = Ptr{mjenv_random}(C_NULL)
    own::Ptr{Ptr{Float64}} = Ptr{Ptr{Float64}}(C_NULL)
    qvel::Ptr{Float64} = Ptr{Float64}(C_NULL)
end

Base.@kwdef struct mjenv_control
    struct_size::UInt32 = sizeof(mjenv_control)
    substep::Int32 = 0
    ctrl::Ptr{Float64} = Ptr{Float64}(C_NULL)
    carried::Ptr{Float64} = Ptr{Float64}(C_NULL)
    random::Ptr{mjenv_random} = Ptr{mjenv_random}(C_NULL)
    own::Ptr{Ptr{Float64}} = Ptr{Ptr{Float64}}(C_NULL)
    qvel::Ptr{Float64} = Ptr{Float64}(C_NULL)
end

Base.@kwdef struct mjenv_builder
    struct_size::UInt32 = sizeof(mjenv_builder)
    failed::Int32 = 0
    api::Ptr{mjenv_task_api} = Ptr{mjenv_task_api}(C_NULL)
    sim::Ptr{mjenv_sim} = Ptr{mjenv_sim}(C_NULL)
    random::Ptr{mjenv_random} = Ptr{mjenv_random}(C_NULL)
    task::Ptr{mjenv_task} = Ptr{mjenv_task}(C_NULL)
end

# address(of, index) is the function at this index in FUNCTIONS, in the library of an engine or a handle.
const FUNCTIONS = (
    :mjenv_abi_version, :mjenv_version, :mjenv_status_name, :mjenv_last_error, :mjenv_error_of, :mjenv_id_count,
    :mjenv_id_at, :mjenv_spec_of, :mjenv_options_create, :mjenv_options_copy, :mjenv_options_destroy,
    :mjenv_options_count, :mjenv_options_at, :mjenv_options_set_integer, :mjenv_options_set_reals,
    :mjenv_options_set_string, :mjenv_options_get_integer, :mjenv_options_get_reals, :mjenv_options_get_string,
    :mjenv_create, :mjenv_destroy, :mjenv_info_of, :mjenv_lane_stages_of, :mjenv_options_of, :mjenv_space_of,
    :mjenv_field_count, :mjenv_field_at, :mjenv_seed, :mjenv_seed_row, :mjenv_get_stream, :mjenv_set_stream,
    :mjenv_draw, :mjenv_seed_actions, :mjenv_sample_actions, :mjenv_reset, :mjenv_step, :mjenv_send, :mjenv_recv,
    :mjenv_rollout, :mjenv_observe, :mjenv_observe_row, :mjenv_begin, :mjenv_act, :mjenv_advance, :mjenv_finish,
    :mjenv_compute_reward, :mjenv_read, :mjenv_mirror, :mjenv_object_count, :mjenv_object_index, :mjenv_object_name,
    :mjenv_set_state, :mjenv_reset_data, :mjenv_write, :mjenv_write_row, :mjenv_set_constants, :mjenv_set_constants_row,
    :mjenv_simulate, :mjenv_copy_row, :mjenv_snapshot, :mjenv_restore, :mjenv_randomize, :mjenv_randomization,
    :mjenv_render_defaults, :mjenv_renderer_create, :mjenv_renderer_destroy, :mjenv_renderer_gl, :mjenv_render,
    :mjenv_render_segmentation, :mjenv_window_create, :mjenv_window_destroy, :mjenv_window_is_open, :mjenv_window_draw,
    :mjenv_register_task, :mjenv_load_tasks, :mjenv_task_functions
)
mjenv_abi_version(engine) =
    ccall(address(engine, 1), UInt32, ())
mjenv_version(engine) =
    ccall(address(engine, 2), Cstring, ())
mjenv_status_name(engine, status) =
    ccall(address(engine, 3), Cstring, (mjenv_status,), status)
mjenv_last_error(engine) =
    ccall(address(engine, 4), Cstring, ())
mjenv_error_of(engine, handle, text, capacity, size) =
    ccall(address(engine, 5), mjenv_status, (Ptr{Cvoid}, Ptr{Cchar}, Int64, Ptr{Int64}), handle, text, capacity, size)
mjenv_id_count(engine) =
    ccall(address(engine, 6), Int64, ())
mjenv_id_at(engine, index) =
    ccall(address(engine, 7), Cstring, (Int64,), index)
mjenv_spec_of(engine, id, spec) =
    ccall(address(engine, 8), mjenv_status, (Cstring, Ptr{mjenv_spec}), id, spec)
mjenv_options_create(engine, id, options) =
    ccall(address(engine, 9), mjenv_status, (Cstring, Ptr{Ptr{mjenv_options}}), id, options)
mjenv_options_copy(options, copy) =
    ccall(address(options, 10), mjenv_status, (Ptr{mjenv_options}, Ptr{Ptr{mjenv_options}}), options, copy)
mjenv_options_destroy(options) =
    ccall(address(options, 11), Cvoid, (Ptr{mjenv_options},), options)
mjenv_options_count(options) =
    ccall(address(options, 12), Int64, (Ptr{mjenv_options},), options)
mjenv_options_at(options, index, option) =
    ccall(address(options, 13), mjenv_status, (Ptr{mjenv_options}, Int64, Ptr{mjenv_option}), options, index, option)
mjenv_options_set_integer(options, name, value) =
    ccall(address(options, 14), mjenv_status, (Ptr{mjenv_options}, Cstring, Int64), options, name, value)
mjenv_options_set_reals(options, name, values, count) =
    ccall(address(options, 15), mjenv_status, (Ptr{mjenv_options}, Cstring, Ptr{Float64}, Int64), options, name, values, count)
mjenv_options_set_string(options, name, value) =
    ccall(address(options, 16), mjenv_status, (Ptr{mjenv_options}, Cstring, Cstring), options, name, value)
mjenv_options_get_integer(options, name, value) =
    ccall(address(options, 17), mjenv_status, (Ptr{mjenv_options}, Cstring, Ptr{Int64}), options, name, value)
mjenv_options_get_reals(options, name, values, capacity, count) =
    ccall(address(options, 18), mjenv_status, (Ptr{mjenv_options}, Cstring, Ptr{Float64}, Int64, Ptr{Int64}), options, name, values, capacity, count)
mjenv_options_get_string(options, name, value) =
    ccall(address(options, 19), mjenv_status, (Ptr{mjenv_options}, Cstring, Ptr{Cstring}), options, name, value)
mjenv_create(options, rows, env) =
    ccall(address(options, 20), mjenv_status, (Ptr{mjenv_options}, Int64, Ptr{Ptr{mjenv_env}}), options, rows, env)
mjenv_destroy(env) =
    ccall(address(env, 21), Cvoid, (Ptr{mjenv_env},), env)
mjenv_info_of(env, info) =
    ccall(address(env, 22), mjenv_status, (Ptr{mjenv_env}, Ptr{mjenv_info}), env, info)
mjenv_lane_stages_of(env) =
    ccall(address(env, 23), Cstring, (Ptr{mjenv_env},), env)
mjenv_options_of(env) =
    ccall(address(env, 24), Ptr{mjenv_options}, (Ptr{mjenv_env},), env)
mjenv_space_of(env, role, space) =
    ccall(address(env, 25), mjenv_status, (Ptr{mjenv_env}, mjenv_role, Ptr{mjenv_space}), env, role, space)
mjenv_field_count(env, role) =
    ccall(address(env, 26), Int64, (Ptr{mjenv_env}, mjenv_role), env, role)
mjenv_field_at(env, role, index, field) =
    ccall(address(env, 27), mjenv_status, (Ptr{mjenv_env}, mjenv_role, Int64, Ptr{mjenv_field}), env, role, index, field)
mjenv_seed(env, mask, seeds, count) =
    ccall(address(env, 28), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Ptr{UInt64}, Int64), env, mask, seeds, count)
mjenv_seed_row(env, row, words, count) =
    ccall(address(env, 29), mjenv_status, (Ptr{mjenv_env}, Int64, Ptr{UInt64}, Int64), env, row, words, count)
mjenv_get_stream(env, row, words, count) =
    ccall(address(env, 30), mjenv_status, (Ptr{mjenv_env}, Int64, Ptr{UInt64}, Int64), env, row, words, count)
mjenv_set_stream(env, row, words, count) =
    ccall(address(env, 31), mjenv_status, (Ptr{mjenv_env}, Int64, Ptr{UInt64}, Int64), env, row, words, count)
mjenv_draw(engine, words, streams, kind, low, high, values, count) =
    ccall(address(engine, 32), mjenv_status, (Ptr{UInt64}, Int64, mjenv_distribution, Float64, Float64, Ptr{Float64}, Int64), words, streams, kind, low, high, values, count)
mjenv_seed_actions(env, seed) =
    ccall(address(env, 33), mjenv_status, (Ptr{mjenv_env}, UInt64), env, seed)
mjenv_sample_actions(env, action, count) =
    ccall(address(env, 34), mjenv_status, (Ptr{mjenv_env}, Ptr{Float32}, Int64), env, action, count)
mjenv_reset(env, mask, out) =
    ccall(address(env, 35), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Ptr{mjenv_batch}), env, mask, out)
mjenv_step(env, mask, action, count, dtype, out) =
    ccall(address(env, 36), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Ptr{Cvoid}, Int64, mjenv_dtype, Ptr{mjenv_batch}), env, mask, action, count, dtype, out)
mjenv_send(env, rows, row_count, action, count, dtype) =
    ccall(address(env, 37), mjenv_status, (Ptr{mjenv_env}, Ptr{Int64}, Int64, Ptr{Cvoid}, Int64, mjenv_dtype), env, rows, row_count, action, count, dtype)
mjenv_recv(env, least, timeout, rows, capacity, count, out) =
    ccall(address(env, 38), mjenv_status, (Ptr{mjenv_env}, Int64, Float64, Ptr{Int64}, Int64, Ptr{Int64}, Ptr{mjenv_batch}), env, least, timeout, rows, capacity, count, out)
mjenv_rollout(env, action, count, dtype, steps, out) =
    ccall(address(env, 39), mjenv_status, (Ptr{mjenv_env}, Ptr{Cvoid}, Int64, mjenv_dtype, Int64, Ptr{mjenv_batch}), env, action, count, dtype, steps, out)
mjenv_observe(env, out) =
    ccall(address(env, 40), mjenv_status, (Ptr{mjenv_env}, Ptr{mjenv_batch}), env, out)
mjenv_observe_row(env, row, out) =
    ccall(address(env, 41), mjenv_status, (Ptr{mjenv_env}, Int64, Ptr{mjenv_batch}), env, row, out)
mjenv_begin(env, mask, qpos, nq, qvel, nv, out) =
    ccall(address(env, 42), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Ptr{Float64}, Int64, Ptr{Float64}, Int64, Ptr{mjenv_batch}), env, mask, qpos, nq, qvel, nv, out)
mjenv_act(env, mask, action, count, dtype, seen) =
    ccall(address(env, 43), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Ptr{Cvoid}, Int64, mjenv_dtype, Ptr{Cvoid}), env, mask, action, count, dtype, seen)
mjenv_advance(env, mask, action, count, dtype, ctrl, ctrl_count, out) =
    ccall(address(env, 44), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Ptr{Cvoid}, Int64, mjenv_dtype, Ptr{Float64}, Int64, Ptr{mjenv_batch}), env, mask, action, count, dtype, ctrl, ctrl_count, out)
mjenv_finish(env, mask, given, out) =
    ccall(address(env, 45), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Ptr{mjenv_batch}, Ptr{mjenv_batch}), env, mask, given, out)
mjenv_compute_reward(env, achieved, desired, count, rewards, reward_count) =
    ccall(address(env, 46), mjenv_status, (Ptr{mjenv_env}, Ptr{Float64}, Ptr{Float64}, Int64, Ptr{Float64}, Int64), env, achieved, desired, count, rewards, reward_count)
mjenv_read(env, row, array, values, capacity, count) =
    ccall(address(env, 47), mjenv_status, (Ptr{mjenv_env}, Int64, Cstring, Ptr{Float64}, Int64, Ptr{Int64}), env, row, array, values, capacity, count)
mjenv_mirror(env, row, array, values, bytes) =
    ccall(address(env, 48), mjenv_status, (Ptr{mjenv_env}, Int64, Cstring, Ptr{Cvoid}, Int64), env, row, array, values, bytes)
mjenv_object_count(env, type, count) =
    ccall(address(env, 49), mjenv_status, (Ptr{mjenv_env}, Cstring, Ptr{Int64}), env, type, count)
mjenv_object_index(env, type, name, index) =
    ccall(address(env, 50), mjenv_status, (Ptr{mjenv_env}, Cstring, Cstring, Ptr{Int64}), env, type, name, index)
mjenv_object_name(env, type, index, name) =
    ccall(address(env, 51), mjenv_status, (Ptr{mjenv_env}, Cstring, Int64, Ptr{Cstring}), env, type, index, name)
mjenv_set_state(env, row, qpos, nq, qvel, nv) =
    ccall(address(env, 52), mjenv_status, (Ptr{mjenv_env}, Int64, Ptr{Float64}, Int64, Ptr{Float64}, Int64), env, row, qpos, nq, qvel, nv)
mjenv_reset_data(env, mask) =
    ccall(address(env, 53), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}), env, mask)
mjenv_write(env, mask, array, values, count) =
    ccall(address(env, 54), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Cstring, Ptr{Float64}, Int64), env, mask, array, values, count)
mjenv_write_row(env, row, array, values, count) =
    ccall(address(env, 55), mjenv_status, (Ptr{mjenv_env}, Int64, Cstring, Ptr{Float64}, Int64), env, row, array, values, count)
mjenv_set_constants(env, mask) =
    ccall(address(env, 56), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}), env, mask)
mjenv_set_constants_row(env, row) =
    ccall(address(env, 57), mjenv_status, (Ptr{mjenv_env}, Int64), env, row)
mjenv_simulate(env, row, ctrl, count, frames) =
    ccall(address(env, 58), mjenv_status, (Ptr{mjenv_env}, Int64, Ptr{Float64}, Int64, Int64), env, row, ctrl, count, frames)
mjenv_copy_row(env, mask, from) =
    ccall(address(env, 59), mjenv_status, (Ptr{mjenv_env}, Ptr{UInt8}, Int64), env, mask, from)
mjenv_snapshot(env, row, image, capacity_bytes, size_bytes) =
    ccall(address(env, 60), mjenv_status, (Ptr{mjenv_env}, Int64, Ptr{Cvoid}, Int64, Ptr{Int64}), env, row, image, capacity_bytes, size_bytes)
mjenv_restore(env, row, image, size_bytes) =
    ccall(address(env, 61), mjenv_status, (Ptr{mjenv_env}, Int64, Ptr{Cvoid}, Int64), env, row, image, size_bytes)
mjenv_randomize(env, document) =
    ccall(address(env, 62), mjenv_status, (Ptr{mjenv_env}, Cstring), env, document)
mjenv_randomization(env, document) =
    ccall(address(env, 63), mjenv_status, (Ptr{mjenv_env}, Ptr{Cstring}), env, document)
mjenv_render_defaults(env, settings) =
    ccall(address(env, 64), mjenv_status, (Ptr{mjenv_env}, Ptr{mjenv_render_settings}), env, settings)
mjenv_renderer_create(env, settings, renderer) =
    ccall(address(env, 65), mjenv_status, (Ptr{mjenv_env}, Ptr{mjenv_render_settings}, Ptr{Ptr{mjenv_renderer}}), env, settings, renderer)
mjenv_renderer_destroy(renderer) =
    ccall(address(renderer, 66), Cvoid, (Ptr{mjenv_renderer},), renderer)
mjenv_renderer_gl(renderer) =
    ccall(address(renderer, 67), Cstring, (Ptr{mjenv_renderer},), renderer)
mjenv_render(renderer, row, rgb, rgb_count, depth, depth_count) =
    ccall(address(renderer, 68), mjenv_status, (Ptr{mjenv_renderer}, Int64, Ptr{UInt8}, Int64, Ptr{Float32}, Int64), renderer, row, rgb, rgb_count, depth, depth_count)
mjenv_render_segmentation(renderer, row, objects, count) =
    ccall(address(renderer, 69), mjenv_status, (Ptr{mjenv_renderer}, Int64, Ptr{Int32}, Int64), renderer, row, objects, count)
mjenv_window_create(env, settings, window) =
    ccall(address(env, 70), mjenv_status, (Ptr{mjenv_env}, Ptr{mjenv_render_settings}, Ptr{Ptr{mjenv_window}}), env, settings, window)
mjenv_window_destroy(window) =
    ccall(address(window, 71), Cvoid, (Ptr{mjenv_window},), window)
mjenv_window_is_open(window) =
    ccall(address(window, 72), Int32, (Ptr{mjenv_window},), window)
mjenv_window_draw(window, row) =
    ccall(address(window, 73), mjenv_status, (Ptr{mjenv_window}, Int64), window, row)
mjenv_register_task(engine, task) =
    ccall(address(engine, 74), mjenv_status, (Ptr{mjenv_task},), task)
mjenv_load_tasks(engine, path) =
    ccall(address(engine, 75), mjenv_status, (Cstring,), path)
mjenv_task_functions(engine) =
    ccall(address(engine, 76), Ptr{mjenv_task_api}, ())

# The library's functions for callbacks; api is a Ptr{mjenv_task_api}.
task_fail_with(api, message) =
    ccall(unsafe_load(api).fail_with, Int32, (Cstring,), message)
task_integer(api, builder, option) =
    ccall(unsafe_load(api).integer, Int64, (Ptr{mjenv_builder}, Cstring), builder, option)
task_reals(api, builder, option, values, count) =
    ccall(unsafe_load(api).reals, Cvoid, (Ptr{mjenv_builder}, Cstring, Ptr{Float64}, Int64), builder, option, values, count)
task_is_integer(api, builder, option) =
    ccall(unsafe_load(api).is_integer, Int32, (Ptr{mjenv_builder}, Cstring), builder, option)
task_text(api, builder, option) =
    ccall(unsafe_load(api).text, Cstring, (Ptr{mjenv_builder}, Cstring), builder, option)
task_index(api, builder, type, name) =
    ccall(unsafe_load(api).index, Int32, (Ptr{mjenv_builder}, Cstring, Cstring), builder, type, name)
task_option_index(api, builder, option, type) =
    ccall(unsafe_load(api).option_index, Int32, (Ptr{mjenv_builder}, Cstring, Cstring), builder, option, type)
task_norm_is_fused(api, builder) =
    ccall(unsafe_load(api).norm_is_fused, Int32, (Ptr{mjenv_builder},), builder)
task_need(api, builder, array) =
    ccall(unsafe_load(api).need, Cvoid, (Ptr{mjenv_builder}, Cstring), builder, array)
task_array(api, builder, name, field) =
    ccall(unsafe_load(api).array, Int32, (Ptr{mjenv_builder}, Cstring, Ptr{mjenv_field}), builder, name, field)
task_field(api, builder, field) =
    ccall(unsafe_load(api).field, Cvoid, (Ptr{mjenv_builder}, Ptr{mjenv_task_field}), builder, field)
task_carry(api, builder, count) =
    ccall(unsafe_load(api).carry, Cvoid, (Ptr{mjenv_builder}, Int64), builder, count)
task_carry_bounds(api, builder, first, count, low, high) =
    ccall(unsafe_load(api).carry_bounds, Cvoid, (Ptr{mjenv_builder}, Int64, Int64, Float64, Float64), builder, first, count, low, high)
task_random(api, random) =
    ccall(unsafe_load(api).random, Float64, (Ptr{mjenv_random},), random)
task_uniform(api, random, low, high) =
    ccall(unsafe_load(api).uniform, Float64, (Ptr{mjenv_random}, Float64, Float64), random, low, high)
task_normal(api, random) =
    ccall(unsafe_load(api).normal, Float64, (Ptr{mjenv_random},), random)
task_integers(api, random, low, high) =
    ccall(unsafe_load(api).integers, Int64, (Ptr{mjenv_random}, Int64, Int64), random, low, high)
task_choice(api, random, count, p) =
    ccall(unsafe_load(api).choice, Int64, (Ptr{mjenv_random}, Int64, Ptr{Float64}), random, count, p)
task_sample(api, random, count, size, chosen) =
    ccall(unsafe_load(api).sample, Cvoid, (Ptr{mjenv_random}, Int64, Int64, Ptr{Int64}), random, count, size, chosen)
task_permutation(api, random, count, order) =
    ccall(unsafe_load(api).permutation, Cvoid, (Ptr{mjenv_random}, Int64, Ptr{Int64}), random, count, order)
task_parameter(api, builder, option) =
    ccall(unsafe_load(api).parameter, Int64, (Ptr{mjenv_builder}, Cstring), builder, option)
task_keep(api, builder, first, count) =
    ccall(unsafe_load(api).keep, Cvoid, (Ptr{mjenv_builder}, Int64, Int64), builder, first, count)
task_current(api, builder) =
    ccall(unsafe_load(api).current, Cvoid, (Ptr{mjenv_builder},), builder)
task_own(api, builder, name) =
    ccall(unsafe_load(api).own, Int32, (Ptr{mjenv_builder}, Cstring), builder, name)
task_random_state(api, builder) =
    ccall(unsafe_load(api).random_state, Cvoid, (Ptr{mjenv_builder},), builder)
task_forward(api, start) =
    ccall(unsafe_load(api).forward, Int32, (Ptr{mjenv_start},), start)
task_advance(api, start, count) =
    ccall(unsafe_load(api).advance, Int32, (Ptr{mjenv_start}, Int64), start, count)
task_restart(api, start) =
    ccall(unsafe_load(api).restart, Int32, (Ptr{mjenv_start},), start)
task_contact_count(api, start) =
    ccall(unsafe_load(api).contact_count, Int64, (Ptr{mjenv_start},), start)
task_state_rand(api, random) =
    ccall(unsafe_load(api).state_rand, Float64, (Ptr{mjenv_random},), random)
task_state_uniform(api, random, low, high) =
    ccall(unsafe_load(api).state_uniform, Float64, (Ptr{mjenv_random}, Float64, Float64), random, low, high)
task_state_randn(api, random) =
    ccall(unsafe_load(api).state_randn, Float64, (Ptr{mjenv_random},), random)
task_state_randint(api, random, low, high) =
    ccall(unsafe_load(api).state_randint, Int64, (Ptr{mjenv_random}, Int64, Int64), random, low, high)
task_state_choice(api, random, count, p) =
    ccall(unsafe_load(api).state_choice, Int64, (Ptr{mjenv_random}, Int64, Ptr{Float64}), random, count, p)
task_state_is_new(api, random) =
    ccall(unsafe_load(api).state_is_new, Int32, (Ptr{mjenv_random},), random)
task_action(api, builder, count, low, high) =
    ccall(unsafe_load(api).action, Cvoid, (Ptr{mjenv_builder}, Int64, Ptr{Float64}, Ptr{Float64}), builder, count, low, high)
task_state_permutation(api, random, count, order) =
    ccall(unsafe_load(api).state_permutation, Cvoid, (Ptr{mjenv_random}, Int64, Ptr{Int64}), random, count, order)
task_control_forward(api, control) =
    ccall(unsafe_load(api).control_forward, Int32, (Ptr{mjenv_control},), control)

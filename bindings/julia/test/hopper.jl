# Hopper-v5, written outside of the library in Julia.

struct Hopper <: MJEnv.Task
    forward_reward_weight::Float64
    ctrl_cost_weight::Float64
    healthy_reward::Float64
    survive_type::MJEnv.mjenv_dtype
    terminate_when_unhealthy::Bool
    state_range::NTuple{2,Float64}
    z_range::NTuple{2,Float64}
    angle_range::NTuple{2,Float64}
    noise::Float64
    skipped::Int
    x_before::Int
end

function MJEnv.build(
    ::Type{Hopper},
    b;
    forward_reward_weight,
    ctrl_cost_weight,
    healthy_reward,
    terminate_when_unhealthy,
    healthy_state_range,
    healthy_z_range,
    healthy_angle_range,
    reset_noise_scale,
    exclude_current_positions_from_observation,
)
    b.sim.nq >= 3 || error("the model has less than 3 positions")
    skipped = Int(exclude_current_positions_from_observation)
    MJEnv.structure!(b; skipped_qpos = skipped)
    return Hopper(
        forward_reward_weight,
        ctrl_cost_weight,
        healthy_reward,
        MJEnv.is_integer(b, :healthy_reward) ? MJEnv.MJENV_DTYPE_NATIVE_INT : MJEnv.MJENV_DTYPE_NATIVE_FLOAT,
        terminate_when_unhealthy,
        healthy_state_range,
        healthy_z_range,
        healthy_angle_range,
        reset_noise_scale,
        skipped,
        MJEnv.keep!(b),
    )
end

function MJEnv.reset!(task::Hopper, start, rng)
    for values in (start.qpos, start.qvel), i in eachindex(values)
        values[i] += MJEnv.uniform(rng, -task.noise, task.noise)
    end
end

MJEnv.reset_info(::Hopper, sim) =
    (x_position = sim.qpos[1], z_distance_from_origin = sim.qpos[2] - sim.qpos0[2])

MJEnv.carry!(task::Hopper, sim, carried) = carried[task.x_before] = sim.qpos[1]

MJEnv.observe(task::Hopper, sim) =
    (qpos = view(sim.qpos, (task.skipped + 1):sim.nq), qvel = (clamp(v, -10, 10) for v in sim.qvel))

within(value, (low, high)) = low < value < high

function MJEnv.step!(task::Hopper, sim, row)
    qpos = sim.qpos
    x, z, angle = qpos[1], qpos[2], qpos[3]
    velocity = (x - row.carried[task.x_before]) / sim.dt
    healthy =
        all(within(qpos[i], task.state_range) for i in 3:length(qpos)) &&
        all(within(v, task.state_range) for v in sim.qvel) &&
        within(z, task.z_range) &&
        within(angle, task.angle_range)

    forward = task.forward_reward_weight * velocity
    survive = healthy * task.healthy_reward
    ctrl = task.ctrl_cost_weight * MJEnv.sum_square(sim.action)
    return (
        reward = (forward + survive) - Float64(ctrl),
        terminated = task.terminate_when_unhealthy && !healthy,
        info = (
            x_position = x,
            z_distance_from_origin = z - sim.qpos0[2],
            x_velocity = velocity,
            reward_forward = forward,
            reward_ctrl = -ctrl,
            reward_survive = MJEnv.typed(survive, task.survive_type),
        ),
    )
end

MJEnv.register(
    "JuliaHopper-v5",
    Hopper;
    model = "hopper.xml",
    frame_skip = 4,
    time_limit = 1000,
    reward_threshold = 3800,
    camera = (trackbodyid = 2, distance = 3, lookat = (0, 0, 1.15), elevation = -20),
    options = (
        forward_reward_weight = MJEnv.Setting(1.0, "weight of the velocity along x"),
        ctrl_cost_weight = MJEnv.Setting(1e-3, "weight of the squared action"),
        healthy_reward = MJEnv.Setting(1.0, "reward for each step while healthy"),
        terminate_when_unhealthy = MJEnv.Setting(true, "terminate the episode when unhealthy"),
        healthy_state_range = MJEnv.Setting((-100, 100), "open bounds of the state except x and z while healthy"),
        healthy_z_range = MJEnv.Setting((0.7, Inf), "open bounds of the height while healthy, m"),
        healthy_angle_range = MJEnv.Setting((-0.2, 0.2), "open bounds of the pitch while healthy, rad"),
        reset_noise_scale = MJEnv.Setting(5e-3, "spread of the random initial state"; low = 0, high = floatmax() / 2),
        exclude_current_positions_from_observation = MJEnv.Setting(true, "do not observe x"),
    ),
)

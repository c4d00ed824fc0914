# Resets and steps whose outputs the program computes.

# The observations of Hopper-v5, from the exported arrays.
function hopper(batch)
    qpos, qvel = (reshape(batch.arrays[range], 6, 3) for range in (1:18, 19:36))
    return vcat(qpos[2:end, :], clamp.(qvel, -10, 10))
end

@testset "Hopper" begin
    built_in = Env("Hopper-v5"; rows = 3, history = 2, terminate_when_unhealthy = false)
    own = (observations = 11, arrays = "qpos qvel", max_episode_steps = 30)
    env = Env("Batch-v0"; rows = 3, history = 2, xml_file = "hopper.xml", frame_skip = 4, own...)
    want, batch = Batch(built_in), Batch(env)
    seed!(built_in, 1:3)
    reset!(want, built_in)
    states(array) = hcat((read(built_in, array; row = row) for row in 1:3)...)
    begin!(batch, env, states(:qpos), states(:qvel))
    finish!(batch, env; obs = hopper(batch))
    for step in 1:30
        action = [((7i + 11row + 3step) % 19) / 9 - 1 for i in 1:3, row in 1:3]
        step!(want, built_in, action)
        @test act(env, action) == action
        advance!(batch, env, action)
        @test_throws MJEnvError advance!(batch, env, action)
        @test_throws DimensionMismatch finish!(batch, env; obs = hopper(batch), reward = [1.0])
        finish!(batch, env; obs = hopper(batch), reward = [1.0, 2.0, 3.0], terminated = zeros(Bool, 3))
        @test same(batch.obs, want.obs)
        @test batch.reward == [1, 2, 3]
        @test batch.truncated == fill(step == 30, 3)
    end
    begin!(batch, env; rows = 2)
    finish!(batch, env, nothing)
    @test_throws MJEnvError step!(env, zeros(3, 3))
    @test_throws MJEnvError finish!(want, built_in, nothing)
end

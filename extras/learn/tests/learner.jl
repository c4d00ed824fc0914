# MJEnv.train and what belongs to it. learner.c tests what the learner learns, and that it computes the same bits however
# it is told to.

using MJEnv
using Test

@testset "a training, its checkpoint and its policy" begin
    mktempdir() do folder
        checkpoint, file = joinpath(folder, "checkpoint"), joinpath(folder, "policy.txt")
        learner = MJEnv.train("InvertedPendulum-v5"; steps = 20_000, settings = (decay_steps = 100_000,))
        MJEnv.save(learner, checkpoint; note = "speed=2, für später")
        @test MJEnv.checkpoint_note(checkpoint) == "speed=2, für später"
        MJEnv.train!(learner, 40_000)
        @test MJEnv.report(learner).mean_return == 1000
        curve = MJEnv.curve(learner)
        @test length(curve) == 30 && curve[1].steps == 2048 && curve[end].updates == 30
        @test curve[end] == MJEnv.report(learner)

        env = Env("InvertedPendulum-v5"; rows = 8, autoreset_mode = :same_step)
        resumed = MJEnv.Learner(env; decay_steps = 100_000, threads = 2)
        @test isnan(MJEnv.report(resumed).mean_return)
        MJEnv.load!(resumed, checkpoint)
        MJEnv.train!(resumed, 40_000)
        @test MJEnv.policy_text(resumed) == MJEnv.policy_text(learner)

        write(file, MJEnv.policy_text(learner))
        policy = MJEnv.Policy(file)
        @test (policy.id, policy.observations, policy.actuators) == ("InvertedPendulum-v5", 4, 1)
        for precision in (Float64, Float32)
            played = MJEnv.evaluate(policy; episodes = 10, seed = 100, precision = precision)
            @test played.returns == fill(1000.0, 10) && played.lengths == fill(1000, 10)
        end
        single = policy([0.1, 0.2, 0.3, 0.4])
        @test single isa Vector{Float32} && size(policy(zeros(4, 3))) == (1, 3)
        @test policy([0.1 0; 0.2 0; 0.3 0; 0.4 0])[:, 1] == single
        @test MJEnv.Policy(learner)([0.1, 0.2, 0.3, 0.4]) == single
        @test MJEnv.Policy(learner; best = true).id == "InvertedPendulum-v5"
    end
end

@testset "settings" begin
    settings = MJEnv.learn_settings("Hopper-v5")
    @test settings.hidden == (64, 64) && settings.activation === :tanh && settings.normalize_obs === true
    @test settings.rows == 8 && settings.learning_rate == 5e-4 && settings.actor_obs == ()
    @test MJEnv.learn_settings("Hopper-v5"; gamma = 0.1 + 0.2, hidden = (3,)).gamma === 0.1 + 0.2
    env = Env("Hopper-v5"; rows = 4, autoreset_mode = :same_step)
    small = (rollout_steps = 20, minibatch_size = 40, epochs = 1)
    seen = [index != 3 for index in 1:11]
    learner = MJEnv.Learner(env; small..., activation = :elu, hidden = (16,), actor_obs = seen)
    MJEnv.train!(learner, 80)
    @test occursin("elu", MJEnv.policy_text(learner))
    policy = MJEnv.Policy(learner)
    @test MJEnv.places(policy, env) == [1, 2, 4, 5, 6, 7, 8, 9, 10, 11]
    @test size(policy(collect(0.1:0.1:1.0))) == (3,)
    @test_throws MJEnvError MJEnv.places(policy, Env("Ant-v5"))
    MJEnv.set!(learner; learning_rate = 1e-4)
    MJEnv.train!(learner, 1)
    @test MJEnv.report(learner).learning_rate < 1e-4 + eps() && MJEnv.report(learner).updates == 2
    @test_throws MJEnvError MJEnv.set!(learner; hidden = (8,))
    @test learner.settings.hidden == (16,)
end

@testset "what is refused" begin
    env = Env("Hopper-v5"; rows = 4, autoreset_mode = :same_step)
    refusal(f) =
        try
            f()
            "nothing was refused"
        catch error
            sprint(showerror, error)
        end
    @test occursin("nearest: gamma", refusal(() -> MJEnv.Learner(env; gama = 1)))
    @test occursin("but the environment has 4 rows", refusal(() -> MJEnv.Learner(env; rows = 8)))
    @test occursin("settings.gamma is 2", refusal(() -> MJEnv.Learner(env; gamma = 2)))
    @test occursin("not one of tanh relu elu", refusal(() -> MJEnv.Learner(env; activation = :sine)))
    @test occursin("autoreset_mode", refusal(() -> MJEnv.Learner(Env("Hopper-v5"; rows = 4))))
    @test occursin("actor_obs has 1", refusal(() -> MJEnv.Learner(env; actor_obs = [true])))
    @test occursin("has a blank", refusal(() -> MJEnv.Learner(env; gamma = "0.5 seed=7")))
    @test occursin("No such file", refusal(() -> MJEnv.Policy("/nowhere/policy.txt")))
    learner = MJEnv.Learner(env)
    @test occursin("No such file", refusal(() -> MJEnv.load!(learner, "/nowhere/checkpoint")))
    @test occursin("less than 0", refusal(() -> MJEnv.train!(learner, -1)))
    policy = MJEnv.Policy(learner)
    @test occursin("obs_count", refusal(() -> policy(zeros(12))))
    @test occursin("sees \"qpos\", 5 numbers", refusal(() -> MJEnv.evaluate(policy; episodes = 1, id = "Ant-v5")))
    @test occursin("precision", refusal(() -> policy(zeros(11); precision = Int)))
    close(learner)
    @test !isopen(learner) && occursin("closed", refusal(() -> MJEnv.train!(learner, 1)))
    learner = MJEnv.Learner(env)
    close(env)
    @test occursin("closed", refusal(() -> MJEnv.train!(learner, 1)))
    close(learner)
    close(learner)
end

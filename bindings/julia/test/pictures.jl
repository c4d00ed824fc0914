# Pictures are Gymnasium's, which tests/pictures/record draws on the same machine.

function recorded(id)
    path = joinpath(REPOSITORY, "build", "pictures", id)
    isfile(path) || error("$path is missing: run tests/pictures/record")
    return open(path) do file
        seed, width, height, steps = parse.(Int, split(readline(file))[2:end])
        rgb = read!(file, Array{UInt8}(undef, 3, width, height))
        depth = read!(file, Array{Float32}(undef, width, height))
        return (; seed, width, height, steps, rgb, depth)
    end
end

@testset "equal to Gymnasium's: $id" for id in ("Ant-v5", "Reacher-v5")
    expected = recorded(id)
    Env(id) do env
        seed!(env, expected.seed)
        reset!(env)
        for _ in 1:expected.steps
            step!(env, zeros(Float32, env.action_count))
        end
        renderer = Renderer(env; width = expected.width, height = expected.height)
        rgb, depth = render_both(renderer)
        @test size(rgb) == (3, expected.height, expected.width)
        @test size(depth) == (expected.height, expected.width)
        @test all(rgb[:, y, x] == expected.rgb[:, x, y] for y in 1:expected.height, x in 1:expected.width)
        @test reinterpret(UInt32, permutedims(depth)) == reinterpret(UInt32, expected.depth)
        @test render(renderer) == rgb
        @test render_depth(renderer) == depth
        @test occursin(r"^(egl|osmesa|glfw), ", MJEnv.gl(renderer))
        close(renderer)
        @test !isopen(renderer)
        @test_throws MJEnvError render(renderer)
        @test_throws ArgumentError MJEnv.gl(renderer)
    end
end

@testset "settings" begin
    env = Env("Walker2d-v5"; rows = 2)
    seed!(env, 1)
    reset!(env)
    picture(; settings...) = render(Renderer(env; width = 33, height = 21, settings...))
    track = picture()
    @test track == picture(camera = 1) == picture(camera = "track") == picture(camera = :track)
    @test track != picture(camera = :free)
    @test picture(camera = :free, lookat = (0, 0, 1.15), distance = 4, elevation = -20) == picture(camera = :free)
    @test track != picture(fast = true)
    @test track != picture(visual_options = (2 => true,))
    @test_throws ArgumentError picture(colour = 1)
    @test_throws ArgumentError picture(gl = :vulkan)
    @test_throws ArgumentError picture(visual_options = (99 => true,))
    for (settings, status) in (
        ((; width = 0), MJEnv.MJENV_E_VALUE),
        ((; height = typemax(Int)), MJEnv.MJENV_E_VALUE),
        ((; camera = 0), MJEnv.MJENV_E_VALUE),
        ((; camera = 2), MJEnv.MJENV_E_VALUE),
        ((; camera = "front"), MJEnv.MJENV_E_NAME),
    )
        @test status == try
            picture(; settings...)
        catch error
            error.status
        end
    end
    renderer = Renderer(env; width = 33, height = 21)
    @test render(renderer; row = 2) != track
    @test_throws MJEnvError render(renderer; row = 3)
    close(env)
    @test_throws MJEnvError render(renderer)
end

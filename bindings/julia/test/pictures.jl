# Compares pictures with Gymnasium's, which tests/pictures/record draws on the same machine.

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
        # Each pixel shows a geom (mjOBJ_GEOM) of the model, or nothing.
        objects = render_segmentation(renderer)
        @test size(objects) == (2, expected.height, expected.width)
        @test all(in(((-1, -1), ((i, 5) for i in 0:object_count(env, "geom")-1)...)), zip(objects[1, :, :], objects[2, :, :]))
        @test any(>(0), objects[1, :, :])
        plain = Renderer(env; width = expected.width, height = expected.height, wireframe = 1, label = :geom)
        @test render(plain) != rgb
        close(plain)
        @test_throws ArgumentError Renderer(env; label = :gem)
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
    free = picture()
    @test free == picture(camera = :free)
    @test picture(camera = 1) == picture(camera = "track") != free
    @test free == picture(lookat = (0, 0, 1.15), distance = 4, elevation = -20)
    @test free != picture(fast = true)
    @test free != picture(visual_options = (2 => true,))
    # All geoms of the model are in group 0.
    @test free != picture(geomgroup = (0 => false,))
    @test free == picture(geomgroup = (0 => true, 3 => true), sitegroup = (0 => false,))
    @test_throws ArgumentError picture(geomgroup = (6 => true,))
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
    @test render(renderer; row = 2) != free
    @test_throws MJEnvError render(renderer; row = 3)
    close(env)
    @test_throws MJEnvError render(renderer)
end

# Returns the bytes of all chunks of a kind in a PNG file, and tests the check sums of all chunks.
function png_chunks(bytes, kind)
    found, place = UInt8[], 9
    number(at) = foldl((sum, byte) -> sum << 8 | byte, bytes[at:(at + 3)]; init = 0)
    while place < length(bytes)
        data = (place + 8):(place + 7 + number(place))
        @test number(last(data) + 1) == MJEnv.crc32(bytes[(place + 4):last(data)])
        String(bytes[(place + 4):(place + 7)]) == kind && append!(found, bytes[data])
        place = last(data) + 5
    end
    return found
end

@testset "a picture as a PNG file" begin
    # These are the check values that are published with the two algorithms.
    @test MJEnv.crc32(b"123456789") == 0xcbf43926
    @test MJEnv.adler32(b"Wikipedia") == 0x11e60398
    pixels = rand(UInt8, 3, 200, 300)  # more than a block of zlib's holds
    picture = MJEnv.Picture(pixels)
    @test sprint(show, picture) == "MJEnv.Picture(300 × 200 pixels)"
    file = sprint(io -> show(io, MIME("image/png"), picture))
    bytes = Vector{UInt8}(codeunits(file))
    @test bytes[1:8] == [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]
    @test png_chunks(bytes, "IHDR") == [0, 0, 1, 44, 0, 0, 0, 200, 8, 2, 0, 0, 0]
    stream = png_chunks(bytes, "IDAT")
    @test (Int(stream[1]) << 8 | stream[2]) % 31 == 0 && stream[1] & 0x0f == 8
    lines, place, last_block = UInt8[], 3, false
    while !last_block
        last_block = stream[place] == 1
        count = stream[place + 1] | Int(stream[place + 2]) << 8
        @test (stream[place + 3] | Int(stream[place + 4]) << 8) == count ⊻ 0xffff
        append!(lines, stream[(place + 5):(place + 4 + count)])
        place += 5 + count
    end
    @test length(stream) == place + 3
    lines = reshape(lines, 901, 200)
    @test all(==(0), lines[1, :])
    @test permutedims(reshape(lines[2:end, :], 3, 300, 200), (1, 3, 2)) == pixels
end

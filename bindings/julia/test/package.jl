# Tests that the package manager takes the package in the way that the documentation describes.

# Returns the code block of a page that contains the words.
function block_with(page, words)
    blocks = split(read(joinpath(REPOSITORY, "docs", page), String), "```")
    return replace(only(filter(block -> occursin(words, block), blocks)), r"^julia\n" => "")
end

@testset "Pkg.develop" begin
    mktempdir() do depot
        # With an empty registry the package manager does not download one.
        registry = mkpath(joinpath(depot, "registries", "Empty"))
        write(
            joinpath(registry, "Registry.toml"),
            "name = \"Empty\"\nuuid = \"00000000-0000-4000-8000-000000000000\"\nrepo = \"none\"\n[packages]\n",
        )
        script = block_with(joinpath("start", "julia.md"), "Pkg.develop") * """
        using MJEnv
        print(pathof(MJEnv), " ", length(MJEnv.ids()))
        """
        julia = setenv(`$(Base.julia_cmd()) --startup-file=no -e $script`; dir = REPOSITORY)
        own = ("JULIA_DEPOT_PATH" => depot, "JULIA_LOAD_PATH" => nothing, "JULIA_PROJECT" => nothing)
        said = withenv(() -> read(pipeline(julia; stderr = devnull), String), own...)
        @test endswith(said, joinpath(PACKAGE, "src", "MJEnv.jl") * " 22")
    end
end

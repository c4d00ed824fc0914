"""
Gymnasium's MuJoCo environments (v4 and v5 of eleven robots) in native code. For the same seed and actions every output
equals that of Gymnasium 1.4.0 on MuJoCo 2.2.2, or on MuJoCo 4.0 with `Env(...; engine = "4.0")`, bit for bit.

```julia
using MJEnv

env = Env("Ant-v5"; terminate_when_unhealthy = false)
seed!(env, 42)
obs, info = reset!(env)
obs, reward, terminated, truncated, info = step!(env, zeros(Float32, 8))
close(env)
```

An [`Env`](@ref) holds one or many rows. A row is an episode; rows do not influence each other. An array for many rows
has a column for each row. To step without allocating memory, write into a [`Batch`](@ref).

Functions that are for one or many rows take [`MJEnv.Rows`](@ref) as `rows`; by default they are for all.

Rows and objects are numbered from 1. The texts of errors come from the C library, where they are numbered from 0.

The module does not export names that programs like to use for variables: `MJEnv.info`, `MJEnv.reset_info`,
`MJEnv.final_info`, `MJEnv.arrays`, `MJEnv.stream`, `MJEnv.spec`, `MJEnv.options`, `MJEnv.fields`, `MJEnv.gl`,
`MJEnv.ids`, `MJEnv.schema`, `MJEnv.version`, `MJEnv.engines`.

Algorithms written for CommonRLInterface or ReinforcementLearningBase take an environment of one row: load that package
and call `convert(CommonRLInterface.AbstractEnv, env)` or `convert(ReinforcementLearningBase.AbstractEnv, env)`.

Programs beside the library add to this module, such as `MJEnv.train`, which trains policies.

Robots and tasks of your own are types derived from [`MJEnv.Task`](@ref). `MJEnv.register` gives them ids, and
`MJEnv.load_tasks` loads plug-ins.

The module loads a C library, for each version of MuJoCo one, at the first call that needs it; docs/start/julia.md says
where it looks for them.
"""
module MJEnv

export Env, Batch, MJEnvError
export seed!, reset!, step!, observe, observe!
export observation_space, action_space, seed_actions!, sample_actions, sample_actions!
export rollout, rollout!, send!, recv!
export begin!, act, advance!, finish!
export object_count, object_index, object_name, set_state!, simulate!, snapshot, restore!, copy_row!, set_stream!
export write!, set_constants!, randomize!, randomization, lanes, lane_stages
export Renderer, render, render_depth, render_both, render_segmentation, Window, draw!

include("capi.jl")
include("library.jl")
include("options.jl")
include("fields.jl")
include("rows.jl")
include("box.jl")
include("env.jl")
include("batch.jl")
include("halves.jl")
include("state.jl")
include("randomisation.jl")
include("render.jl")
include("picture.jl")
include("extensions.jl")
include("many.jl")
include("task/memory.jl")
include("task/numpy.jl")
include("task/sim.jl")
include("task/task.jl")
include("task/builder.jl")
include("task/locomotion.jl")
include("task/callbacks.jl")

# What programs beside the library add, in a released package or in the repository: extras/NAME/julia/NAME.jl.
for root in (dirname(@__DIR__), REPOSITORY)
    isfile(joinpath(root, "extras", "README.md")) || continue
    include_dependency(joinpath(root, "extras"))
    for name in readdir(joinpath(root, "extras"))
        file = joinpath(root, "extras", name, "julia", "$name.jl")
        isfile(file) && include(file)
    end
    break
end

# Broadcasting treats them as scalars: read.(env, [:qpos, :qvel]).
Base.broadcastable(single::Union{Env,Batch,Renderer,Window}) = Ref(single)

end

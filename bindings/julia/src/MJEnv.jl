"""
Gymnasium's MuJoCo environments at native speed, bit for bit.

```julia
using MJEnv

env = Env("Ant-v5"; terminate_when_unhealthy = false)
seed!(env, 42)
obs, info = reset!(env)
obs, reward, terminated, truncated, info = step!(env, zeros(Float32, 8))
close(env)
```

An [`Env`](@ref) holds one or many rows; a row is one episode. Arrays of many rows have a column for each row.
Rows and indices of objects count from 1; in the text of an error, which comes from the C library, they count from 0.
For loops that must not allocate, step into a [`Batch`](@ref).

Names that a program wants for its variables are not exported: `MJEnv.info`, `MJEnv.reset_info`, `MJEnv.final_info`,
`MJEnv.arrays`, `MJEnv.stream`, `MJEnv.spec`, `MJEnv.options`, `MJEnv.fields`, `MJEnv.gl`, `MJEnv.ids`, `MJEnv.schema`,
`MJEnv.version`.

An environment of one row is also one of CommonRLInterface and of ReinforcementLearningBase, once these packages are
loaded: `convert(CommonRLInterface.AbstractEnv, env)`, `convert(ReinforcementLearningBase.AbstractEnv, env)`.

The library is the file that `ENV["MJENV_LIBRARY"]` names, else the one that came with the package or was built in
this repository, else the system's.
"""
module MJEnv

export Env, Batch, MJEnvError
export seed!, reset!, step!, observe, observe!
export observation_space, action_space, seed_actions!, sample_actions, sample_actions!
export rollout, rollout!, send!, recv!
export object_index, object_name, set_state!, simulate!, snapshot, restore!, copy_row!, set_stream!
export Renderer, render, render_depth, render_both, Window, draw!

include("capi.jl")
include("library.jl")
include("options.jl")
include("fields.jl")
include("env.jl")
include("batch.jl")
include("state.jl")
include("render.jl")
include("picture.jl")
include("extensions.jl")
include("many.jl")

# `f.(env, ...)` takes them as one thing each.
Base.broadcastable(single::Union{Env,Batch,Renderer,Window}) = Ref(single)

end

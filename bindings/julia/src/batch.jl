# Resetting and stepping.

"""
    Batch(env; dtype = Float64, steps = 1)

Preallocated outputs of [`step!`](@ref), [`reset!`](@ref), [`observe!`](@ref) and [`send!`](@ref) for all rows of `env`:

- `obs`: a `Matrix{dtype}`, a column for each row; `Float32` is rounded to nearest
- `reward`: `Vector{Float64}`; `terminated`, `truncated`: `Vector{Bool}`. A reset writes 0.
- `status`: a `Vector{MJEnv.Status}`, `MJENV_E_PHYSICS` where MuJoCo found the state diverged and restarted it
- `was_reset`: a `Vector{Bool}`, true where the last call began an episode: see the option `autoreset_mode`
- `final_obs`: as `obs`, without columns unless `autoreset_mode` is `:same_step`: the last observation of the episode
  that a step ended and reset, written in the columns of those rows
- `step_info`, `reset_info`, `final_info`, `arrays`: the numbers of [`MJEnv.info`](@ref), [`MJEnv.reset_info`](@ref),
  [`MJEnv.final_info`](@ref) and [`MJEnv.arrays`](@ref), field by field: element `e` of a field `f` of row `r`, all from
  1, is at `(first(f.range) - 1) * rows + (r - 1) * length(f.range) + e`

With `steps`, the outputs of [`rollout!`](@ref): a column, or an element, for each step of each row, step `t` of row `r`
at `(r - 1) * steps + t`.

A batch fits every environment with as many rows and outputs of the same sizes; else a `DimensionMismatch` is thrown.
"""
mutable struct Batch{T<:Union{Float32,Float64}}
    obs::Matrix{T}
    reward::Vector{Float64}
    terminated::Vector{Bool}
    truncated::Vector{Bool}
    status::Vector{Status}
    was_reset::Vector{Bool}
    step_info::Vector{Float64}
    reset_info::Vector{Float64}
    final_obs::Matrix{T}
    final_info::Vector{Float64}
    arrays::Vector{Float64}
    # What info reads, of the last call.
    fields::Vector{Field}
    values::Vector{Float64}
    action_type::DataType
    # What else there is to read.
    info_fields::Vector{Field}
    reset_info_fields::Vector{Field}
    array_fields::Vector{Field}
end

function Batch(env::Env; dtype::Type{T} = Float64, steps::Integer = 1) where {T<:Union{Float32,Float64}}
    columns = env.rows * steps
    final = steps == 1 && env.same_step ? columns : 0
    info_count = record_length(env.info_fields)
    return Batch{T}(
        zeros(T, env.obs_count, columns),
        zeros(columns),
        zeros(Bool, columns),
        zeros(Bool, columns),
        fill(MJENV_OK, columns),
        zeros(Bool, columns),
        zeros(info_count * columns),
        zeros(record_length(env.reset_info_fields) * columns),
        zeros(T, env.obs_count, final),
        zeros(info_count * final),
        zeros(record_length(env.array_fields) * columns),
        Field[],
        Float64[],
        Float64,
        env.info_fields,
        env.reset_info_fields,
        env.array_fields,
    )
end

Base.show(io::IO, batch::Batch) =
    print(io, typeof(batch), " of ", size(batch.obs, 1), " observations × ", size(batch.obs, 2), " rows")

dtype_of(::Type{Float64}) = MJENV_FLOAT64
dtype_of(::Type{Float32}) = MJENV_FLOAT32

# The batch as C takes it; its pointers are valid while the batch is preserved. Inlined, the Ref stays on the stack.
@inline function raw(batch::Batch{T}, env::Env, fields::Vector{Field}, columns::Int = env.rows) where {T}
    stepping = fields === env.info_fields
    info = stepping ? batch.step_info : batch.reset_info
    info_count, reset_info_count = record_length(fields), record_length(env.reset_info_fields)
    array_count = record_length(env.array_fields)
    keeps_final = stepping && !isempty(batch.final_obs)
    fits(env, "obs", size(batch.obs), (env.obs_count, columns))
    fits(env, "reward", size(batch.reward), (columns,))
    fits(env, "terminated", size(batch.terminated), (columns,))
    fits(env, "truncated", size(batch.truncated), (columns,))
    fits(env, "status", size(batch.status), (columns,))
    fits(env, "was_reset", size(batch.was_reset), (columns,))
    fits(env, stepping ? "step_info" : "reset_info", size(info), (info_count * columns,))
    fits(env, "reset_info", size(batch.reset_info), (reset_info_count * columns,))
    fits(env, "arrays", size(batch.arrays), (array_count * columns,))
    if keeps_final
        fits(env, "final_obs", size(batch.final_obs), (env.obs_count, columns))
        fits(env, "final_info", size(batch.final_info), (info_count * columns,))
    end
    c = mjenv_batch(
        obs_dtype = Int32(dtype_of(T)),
        rows = columns,
        obs_count = env.obs_count,
        info_count = info_count,
        obs = pointer(batch.obs),
        reward = pointer(batch.reward),
        terminated = pointer(batch.terminated),
        truncated = pointer(batch.truncated),
        info = pointer(info),
        status = pointer(batch.status),
        reset_info_count = reset_info_count,
        arrays_count = array_count,
        was_reset = pointer(batch.was_reset),
        reset_info = stepping ? pointer(batch.reset_info) : Ptr{Float64}(C_NULL),
        final_obs = keeps_final ? pointer(batch.final_obs) : Ptr{T}(C_NULL),
        final_info = keeps_final ? pointer(batch.final_info) : Ptr{Float64}(C_NULL),
        arrays = pointer(batch.arrays),
    )
    return Ref(c)
end

@inline fits(env, name, given, needed) = given == needed || refuse_size(env, name, given, needed)

@noinline refuse_size(env, name, given, needed) =
    throw(DimensionMismatch("$name of the batch has size $given; this $env needs $needed"))

# After a call: a failure of physics has written the other rows.
@inline function note!(batch, env, status, fields, action_type)
    status == MJENV_OK || status == MJENV_E_PHYSICS || return
    batch.fields = fields
    batch.values = fields === env.info_fields ? batch.step_info : batch.reset_info
    batch.action_type = action_type
    batch.info_fields = env.info_fields
    batch.reset_info_fields = env.reset_info_fields
    batch.array_fields = env.array_fields
    return
end

# Numbers for the actuators.
const Action = Union{AbstractVecOrMat{<:Real},Tuple{Real,Vararg{Real}}}

as_mask(env::Env, ::Nothing) = C_NULL

function as_mask(env::Env, mask::AbstractVector{Bool})
    length(mask) == env.rows && return convert(Vector{Bool}, mask)
    throw(DimensionMismatch("a mask of $(length(mask)) for an environment of $(env.rows) rows"))
end

"""
    reset!(env; mask = nothing)

Begins a new episode in every row, or in those where the `Bool` vector `mask` is true, going on with the row's random
stream. Returns `(obs = ..., info = ...)`: for one row a vector, for many a matrix with a column for each row. Rows
outside the mask show their present observation and an info of zeros.

    reset!(batch, env; mask = nothing)

Writes the outputs into a [`Batch`](@ref), of the rows in the mask alone, and returns it.
"""
function reset!(batch::Batch, env::Env; mask::Union{Nothing,AbstractVector{Bool}} = nothing)
    chosen = as_mask(env, mask)
    fields = env.reset_info_fields
    GC.@preserve batch begin
        out = raw(batch, env, fields)
        status = inside(handle -> mjenv_reset(handle, chosen, out), env)
        note!(batch, env, status, fields, Float64)
        check(status)
    end
    return batch
end

function reset!(env::Env; mask::Union{Nothing,AbstractVector{Bool}} = nothing)
    batch = Batch(env)
    mask === nothing || observe!(batch, env)
    env.latest = reset!(batch, env; mask = mask)
    return (obs = outputs(env, batch).obs, info = info(batch))
end

"""
    step!(env, action)

Steps every row. `action` is a vector or a tuple for one row, a matrix with a column for each row for many. Its element
type takes part in the arithmetic as in NumPy when it is `Float32` or `Float64`; every other is converted to `Float64`.

Returns `(obs = ..., reward = ..., terminated = ..., truncated = ..., info = ...)`: for one row a vector, a `Float64`
and two `Bool`s, for many a matrix with a column for each row and vectors. `info` is that of [`MJEnv.info`](@ref).

Unless the option `strict` is false, a NaN or infinite action and a step after the end of an episode throw an
[`MJEnvError`](@ref). After an error all rows are as they were, except when MuJoCo fails in some of them
(`MJENV_E_PHYSICS`): then the others are stepped.

    step!(batch, env, action)

Writes the outputs into a [`Batch`](@ref) and returns it; allocates nothing where `action` is an `Array` of `Float32` or
`Float64`, and copies no contiguous view of one. After an error the batch is as it was.
"""
step!(batch::Batch, env::Env, action::Action) = step_dense!(batch, env, dense(action))

function step!(env::Env, action::Action)
    batch = step!(Batch(env), env, action)
    env.latest = batch
    return merge(outputs(env, batch), (info = info(batch),))
end

function step_dense!(batch::Batch, env::Env, action::StridedVecOrMat{T}) where {T}
    check_action(env, action)
    fields = env.info_fields
    GC.@preserve batch begin
        out = raw(batch, env, fields)
        status = inside(handle -> mjenv_step(handle, action, length(action), dtype_of(T), out), env)
        note!(batch, env, status, fields, T)
        check(status)
    end
    return batch
end

# Elements without gaps, of a type that C knows.
dense(action::Tuple) = dense([action...])
dense(action::AbstractArray{<:Real}) = Array{Float64}(action)
dense(action::AbstractArray{T}) where {T<:Union{Float32,Float64}} = Array{T}(action)
dense(action::Array{<:Union{Float32,Float64}}) = action
dense(action::StridedVector{T}) where {T<:Union{Float32,Float64}} = stride(action, 1) == 1 ? action : Array{T}(action)
dense(action::StridedMatrix{T}) where {T<:Union{Float32,Float64}} =
    strides(action) == (1, size(action, 1)) ? action : Array{T}(action)

# The arrays of a batch as the caller of an environment of one row, or of many, wants them.
function outputs(env::Env, batch::Batch)
    obs, reward, terminated, truncated = batch.obs, batch.reward, batch.terminated, batch.truncated
    env.rows == 1 || return (obs = obs, reward = reward, terminated = terminated, truncated = truncated)
    return (obs = vec(obs), reward = reward[1], terminated = terminated[1], truncated = truncated[1])
end

"""
    observe(env)

The observation of each row as it is, without a step: for one row a vector, for many a matrix with a column for each.
"""
observe(env::Env) = outputs(env, observe!(Batch(env), env)).obs

"""
    observe!(batch, env)

Writes the observation of each row as it is into the `obs` of a [`Batch`](@ref), the exported arrays into its `arrays`,
nothing else, and returns the batch.
"""
function observe!(batch::Batch, env::Env)
    GC.@preserve batch begin
        out = raw(batch, env, env.info_fields)
        check(inside(handle -> mjenv_observe(handle, out), env))
    end
    return batch
end

"""
    MJEnv.info(batch)
    MJEnv.info(env)

What the last reset or step of the batch, or the last `reset!(env)` or `step!(env, action)`, reported: a NamedTuple with
Gymnasium's keys in Gymnasium's order. For one row its values are numbers of the type Gymnasium gives them, or arrays;
for many rows arrays whose last dimension are the rows.
"""
info(batch::Batch) = named(batch, batch.fields, batch.values)

info(env::Env) = env.latest === nothing ? NamedTuple() : info(env.latest)

"""
    MJEnv.reset_info(batch)

As [`MJEnv.info`](@ref), of the last reset of each row: of [`reset!`](@ref), or of the step that reset it.
"""
reset_info(batch::Batch) = named(batch, batch.reset_info_fields, batch.reset_info)

"""
    MJEnv.final_info(batch)

As [`MJEnv.info`](@ref), of the last step of the episodes that a step ended and reset: with the option `autoreset_mode`
at `:same_step`, in the rows where `was_reset` is true after it. Without that mode there are none.
"""
final_info(batch::Batch) =
    isempty(batch.final_obs) ? NamedTuple() : named(batch, batch.info_fields, batch.final_info)

"""
    MJEnv.arrays(batch)

The mjData arrays that the option `arrays` names, of the last call, in the form of [`MJEnv.info`](@ref); their shapes
are those of `read`.
"""
arrays(batch::Batch) = named(batch, batch.array_fields, batch.arrays)

# The rows are the last dimension, where there are many.
function named(batch::Batch, fields::Vector{Field}, values::Vector{Float64})
    columns = length(batch.reward)
    return named(batch, fields, values, columns == 1 ? () : (columns,))
end

function named(batch::Batch, fields::Vector{Field}, values::Vector{Float64}, dimensions)
    names = Tuple(Symbol(field.name) for field in fields)
    return NamedTuple{names}(Tuple(value_of(batch, field, values, dimensions) for field in fields))
end

function value_of(batch::Batch, field::Field, values::Vector{Float64}, dimensions)
    columns = length(batch.reward)
    part = view(values, ((first(field.range) - 1) * columns + 1):(last(field.range) * columns))
    return shaped(part, field, julia_type(field.type, batch.action_type), dimensions)
end

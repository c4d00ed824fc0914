# Resetting and stepping.

"""
    Batch(env; dtype = Float64)

Preallocated outputs of [`step!`](@ref), [`reset!`](@ref) and [`observe!`](@ref) for all rows of `env`:

- `obs`: a `Matrix{dtype}`, a column for each row; `Float32` is rounded to nearest
- `reward`: `Vector{Float64}`; `terminated`, `truncated`: `Vector{Bool}`. A reset writes 0.
- `status`: a `Vector{MJEnv.Status}`, `MJENV_E_PHYSICS` where MuJoCo found the state diverged and restarted it
- `step_info`, `reset_info`: the numbers of [`MJEnv.info`](@ref), field by field: element `e` of a field `f` of row `r`,
  all from 1, is at `(first(f.range) - 1) * rows + (r - 1) * length(f.range) + e`

A batch fits every environment with as many rows and outputs of the same sizes; else a `DimensionMismatch` is thrown.
"""
mutable struct Batch{T<:Union{Float32,Float64}}
    obs::Matrix{T}
    reward::Vector{Float64}
    terminated::Vector{Bool}
    truncated::Vector{Bool}
    status::Vector{Status}
    step_info::Vector{Float64}
    reset_info::Vector{Float64}
    # What info reads, of the last call.
    fields::Vector{Field}
    values::Vector{Float64}
    action_type::DataType
end

function Batch(env::Env; dtype::Type{T} = Float64) where {T<:Union{Float32,Float64}}
    rows = env.rows
    return Batch{T}(
        zeros(T, env.obs_count, rows),
        zeros(rows),
        zeros(Bool, rows),
        zeros(Bool, rows),
        fill(MJENV_OK, rows),
        zeros(record_length(env.info_fields) * rows),
        zeros(record_length(env.reset_info_fields) * rows),
        Field[],
        Float64[],
        Float64,
    )
end

Base.show(io::IO, batch::Batch) =
    print(io, typeof(batch), " of ", size(batch.obs, 1), " observations × ", size(batch.obs, 2), " rows")

dtype_of(::Type{Float64}) = MJENV_FLOAT64
dtype_of(::Type{Float32}) = MJENV_FLOAT32

# The batch as C takes it; its pointers are valid while the batch is preserved. Inlined, the Ref stays on the stack.
@inline function raw(batch::Batch{T}, env::Env, info::Vector{Float64}, fields::Vector{Field}) where {T}
    info_count = record_length(fields)
    fits(env, "obs", size(batch.obs), (env.obs_count, env.rows))
    fits(env, "reward", size(batch.reward), (env.rows,))
    fits(env, "terminated", size(batch.terminated), (env.rows,))
    fits(env, "truncated", size(batch.truncated), (env.rows,))
    fits(env, "status", size(batch.status), (env.rows,))
    fits(env, fields === env.info_fields ? "step_info" : "reset_info", size(info), (info_count * env.rows,))
    c = mjenv_batch(
        obs_dtype = Int32(dtype_of(T)),
        rows = env.rows,
        obs_count = env.obs_count,
        info_count = info_count,
        obs = pointer(batch.obs),
        reward = pointer(batch.reward),
        terminated = pointer(batch.terminated),
        truncated = pointer(batch.truncated),
        info = pointer(info),
        status = pointer(batch.status),
    )
    return Ref(c)
end

@inline fits(env, name, given, needed) = given == needed || refuse_size(env, name, given, needed)

@noinline refuse_size(env, name, given, needed) =
    throw(DimensionMismatch("$name of the batch has size $given; this $env needs $needed"))

# After a call: a failure of physics has written the other rows.
@inline function note!(batch, status, fields, values, action_type)
    status == MJENV_OK || status == MJENV_E_PHYSICS || return
    batch.fields = fields
    batch.values = values
    batch.action_type = action_type
    return
end

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
        out = raw(batch, env, batch.reset_info, fields)
        status = inside(handle -> mjenv_reset(handle, chosen, out), env)
        note!(batch, status, fields, batch.reset_info, Float64)
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

Steps every row. `action` is a vector for one row, a matrix with a column for each row for many. Its element type takes
part in the arithmetic as in NumPy when it is `Float32` or `Float64`; every other is converted to `Float64`.

Returns `(obs = ..., reward = ..., terminated = ..., truncated = ..., info = ...)`: for one row a vector, a `Float64`
and two `Bool`s, for many a matrix with a column for each row and vectors. `info` is that of [`MJEnv.info`](@ref).

Unless the option `strict` is false, a NaN or infinite action and a step after the end of an episode throw an
[`MJEnvError`](@ref). After an error all rows are as they were, except when MuJoCo fails in some of them
(`MJENV_E_PHYSICS`): then the others are stepped.

    step!(batch, env, action)

Writes the outputs into a [`Batch`](@ref) and returns it; allocates nothing where `action` is an `Array` of `Float32` or
`Float64`, and copies no contiguous view of one. After an error the batch is as it was.
"""
step!(batch::Batch, env::Env, action::AbstractVecOrMat{<:Real}) = step_dense!(batch, env, dense(action))

function step!(env::Env, action::AbstractVecOrMat{<:Real})
    batch = step!(Batch(env), env, action)
    env.latest = batch
    return merge(outputs(env, batch), (info = info(batch),))
end

function step_dense!(batch::Batch, env::Env, action::StridedVecOrMat{T}) where {T}
    check_action(env, action)
    fields = env.info_fields
    GC.@preserve batch begin
        out = raw(batch, env, batch.step_info, fields)
        status = inside(handle -> mjenv_step(handle, action, length(action), dtype_of(T), out), env)
        note!(batch, status, fields, batch.step_info, T)
        check(status)
    end
    return batch
end

# Elements without gaps, of a type that C knows.
dense(action::AbstractVecOrMat{<:Real}) = Array{Float64}(action)
dense(action::AbstractVecOrMat{T}) where {T<:Union{Float32,Float64}} = Array{T}(action)
dense(action::VecOrMat{<:Union{Float32,Float64}}) = action
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

Writes the observation of each row as it is into the `obs` of a [`Batch`](@ref), nothing else, and returns the batch.
"""
function observe!(batch::Batch, env::Env)
    GC.@preserve batch begin
        out = raw(batch, env, batch.step_info, env.info_fields)
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
function info(batch::Batch)
    names = Tuple(Symbol(field.name) for field in batch.fields)
    return NamedTuple{names}(Tuple(info_value(batch, field) for field in batch.fields))
end

info(env::Env) = env.latest === nothing ? NamedTuple() : info(env.latest)

function info_value(batch::Batch, field::Field)
    rows = length(batch.reward)
    part = view(batch.values, ((first(field.range) - 1) * rows + 1):(last(field.range) * rows))
    T = julia_type(field.type, batch.action_type)
    return rows == 1 ? shaped(part, field, T) : shaped(part, field, T, rows)
end

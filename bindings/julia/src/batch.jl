# Resets and steps, and the arrays that they write.

"""
    Batch(env; dtype = Float64, steps = 1)

Allocates the outputs of all rows of `env`. [`reset!`](@ref), [`step!`](@ref), [`observe!`](@ref) and [`recv!`](@ref)
write into them, so that these calls need not allocate. The fields are:

- `obs`: a `Matrix{dtype}` with a column for each row. `Float64` is Gymnasium's; `Float32` is rounded to nearest.
- `reward`: a `Vector{Float64}`; 0 after a reset
- `terminated`, `truncated`: two `Vector{Bool}`; false after a reset
- `status`: a `Vector{MJEnv.Status}`: `MJENV_DIVERGED` for a row whose state diverged so that MuJoCo restarted it,
  `MJENV_E_PHYSICS` for a row in which MuJoCo failed and which kept its state, `MJENV_OK` for other rows
- `was_reset`: a `Vector{Bool}`, true where the last call began an episode (see the option `autoreset_mode`)
- `final_obs`: the last observation of the episode that a step ended and reset. It has the size of `obs` if the option
  `autoreset_mode` is `:same_step`, and no columns otherwise. A step writes the columns of the rows that it resets.
- `step_info`, `reset_info`, `final_info`, `arrays`: the numbers that [`MJEnv.info`](@ref), [`MJEnv.reset_info`](@ref),
  [`MJEnv.final_info`](@ref) and [`MJEnv.arrays`](@ref) show, field by field. Element `e` of the field `f` of row `r`,
  all counted from 1, is at `(first(f.range) - 1) * rows + (r - 1) * length(f.range) + e`.

With `steps` the batch has room for [`rollout!`](@ref): for each row and step a column, or an element. Step `t` of row
`r` is at `(r - 1) * steps + t`.

A batch fits every environment that has as many rows and outputs of the same sizes. With another environment, calls
throw a `DimensionMismatch`.
"""
Base.@kwdef mutable struct Batch{T<:Union{Float32,Float64}}
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
    outputs::Outputs
    # What MJEnv.info shows of the last call.
    fields::Vector{Field} = Field[]
    values::Vector{Float64} = Float64[]
    action_type::DataType = Float64
end

function Batch(env::Env; dtype::Type{T} = Float64, steps::Integer = 1) where {T<:Union{Float32,Float64}}
    columns = env.rows * steps
    final = steps == 1 && env.same_step ? columns : 0
    info_count = record_length(env.fields.info)
    return Batch{T}(
        obs = zeros(T, env.obs_count, columns),
        reward = zeros(columns),
        terminated = zeros(Bool, columns),
        truncated = zeros(Bool, columns),
        status = fill(MJENV_OK, columns),
        was_reset = zeros(Bool, columns),
        step_info = zeros(info_count * columns),
        reset_info = zeros(record_length(env.fields.reset_info) * columns),
        final_obs = zeros(T, env.obs_count, final),
        final_info = zeros(info_count * final),
        arrays = zeros(record_length(env.fields.arrays) * columns),
        outputs = env.fields,
    )
end

Base.show(io::IO, batch::Batch) =
    print(io, typeof(batch), " of ", size(batch.obs, 1), " observations × ", size(batch.obs, 2), " rows")

dtype_of(::Type{Float64}) = MJENV_DTYPE_FLOAT64
dtype_of(::Type{Float32}) = MJENV_DTYPE_FLOAT32

# The arrays of a batch, their members in C's struct, and their sizes.
const BATCH_ARRAYS = (
    (:obs, :obs, :((env.obs_count, columns))),
    ((name, name, :((columns,))) for name in (:reward, :terminated, :truncated, :status, :was_reset))...,
    (:step_info, :info, :((info_count * columns,))),
    (:reset_info, :reset_info, :((reset_info_count * columns,))),
    (:arrays, :arrays, :((arrays_count * columns,))),
)

# Returns the batch as C's struct. Its pointers are valid while the batch is preserved. Inlining keeps the Ref on the
# stack.
@eval @inline function raw(batch::Batch{T}, env::Env, columns::Int = env.rows) where {T}
    info_count, reset_info_count = record_length(env.fields.info), record_length(env.fields.reset_info)
    arrays_count = record_length(env.fields.arrays)
    keeps_final = !isempty(batch.final_obs)
    $((:(fits(env, $(String(name)), size(batch.$name), $size)) for (name, _, size) in BATCH_ARRAYS)...)
    if keeps_final
        fits(env, "final_obs", size(batch.final_obs), (env.obs_count, columns))
        fits(env, "final_info", size(batch.final_info), (info_count * columns,))
    end
    c = mjenv_batch(;
        obs_dtype = Int32(dtype_of(T)),
        rows = columns,
        obs_count = env.obs_count,
        info_count = info_count,
        reset_info_count = reset_info_count,
        arrays_count = arrays_count,
        final_obs = keeps_final ? pointer(batch.final_obs) : Ptr{T}(C_NULL),
        final_info = keeps_final ? pointer(batch.final_info) : Ptr{Float64}(C_NULL),
        $((Expr(:kw, member, :(pointer(batch.$name))) for (name, member, _) in BATCH_ARRAYS)...),
    )
    return Ref(c)
end

@inline fits(env, name, given, needed) = given == needed || refuse_size(env, name, given, needed)

@noinline refuse_size(env, name, given, needed) =
    throw(DimensionMismatch("$name has size $given; this $env needs $needed"))

# Records what a call has written. If MuJoCo failed in some rows, the others were written.
@inline function note!(batch, env, status, fields, action_type)
    status == MJENV_OK || status == MJENV_E_PHYSICS || return
    batch.fields = fields
    batch.values = fields === env.fields.info ? batch.step_info : batch.reset_info
    batch.action_type = action_type
    batch.outputs = env.fields
    return
end

# Calls f with the handle and the batch, and records what it has written.
@inline function written!(f::F, batch, env, fields, action_type, columns = env.rows) where {F}
    GC.@preserve batch begin
        out = raw(batch, env, columns)
        status = inside(handle -> f(handle, out), env)
        note!(batch, env, status, fields, action_type)
        check(env.handle, status)
    end
    return batch
end

# The types of actions that callers may pass.
const Action = Union{AbstractVecOrMat{<:Real},Tuple{Real,Vararg{Real}}}

"""
    reset!(env; rows = :)

Begins a new episode in the [`MJEnv.Rows`](@ref) `rows`. The start is drawn from the row's random stream. Returns
`(obs = ..., info = ...)`: `obs` is a vector for an environment of one row, and a matrix with a column for each row
otherwise. For the other rows, `obs` is their present observation and `info` is zero.

    reset!(batch, env; rows = :)

Writes the outputs of the rows into a [`Batch`](@ref), which it returns. The outputs of the other rows keep their values.
"""
function reset!(batch::Batch, env::Env; rows::Rows = (:))
    chosen = mask_of(env, rows)
    return written!((handle, out) -> mjenv_reset(handle, chosen, out), batch, env, env.fields.reset_info, Float64)
end

function reset!(env::Env; rows::Rows = (:))
    batch = Batch(env)
    rows isa Colon || observe!(batch, env)
    env.latest = reset!(batch, env; rows = rows)
    return (obs = outputs(env, batch).obs, info = info(batch))
end

"""
    step!(env, action; rows = :)

Steps the [`MJEnv.Rows`](@ref) `rows`. `action` is a vector or a tuple for one row, and a matrix with a column for each
row for many. `Float32` and `Float64` actions give different bits, as in NumPy. Elements of every other type are converted
to `Float64`.

Returns `(obs = ..., reward = ..., terminated = ..., truncated = ..., info = ...)`. For an environment of one row `obs` is
a vector, `reward` a `Float64`, and `terminated` and `truncated` are `Bool`s. Otherwise `obs` is a matrix with a column
for each row, and these three are vectors. `info` is the NamedTuple of [`MJEnv.info`](@ref). Rows that are not stepped keep
their state; for them `obs` is the present observation, and the other results are zero or false.

A NaN or infinite action and a step after the end of an episode throw an [`MJEnvError`](@ref), unless the option
`strict` is false. After an error all rows are as they were, with one exception: if MuJoCo fails in some rows
(`MJENV_E_PHYSICS`), these keep their state and the others are stepped.

    step!(batch, env, action; rows = :)

Writes the outputs into a [`Batch`](@ref), which it returns. The outputs of rows that are not stepped keep their values. It
allocates nothing if it steps all rows and `action` is an `Array` of `Float32` or `Float64`, or a contiguous view of one.
After an error the batch is as it was.
"""
step!(batch::Batch, env::Env, action::Action; rows::Rows = (:)) =
    step_dense!(batch, env, columns_of_all(env, dense(action), rows), mask_of(env, rows))

function step!(env::Env, action::Action; rows::Rows = (:))
    batch = Batch(env)
    rows isa Colon || observe!(batch, env)
    env.latest = step!(batch, env, action; rows = rows)
    return merge(outputs(env, batch), (info = info(batch),))
end

function step_dense!(batch::Batch, env::Env, action::StridedVecOrMat{T}, chosen) where {T}
    check_columns(env, action, env.rows)
    return written!(batch, env, env.fields.info, T) do handle, out
        mjenv_step(handle, chosen, action, length(action), dtype_of(T), out)
    end
end

# The action with a column for each row of the environment.
columns_of_all(::Env, action, ::Union{Colon,AbstractVector{Bool}}) = action

function columns_of_all(env::Env, action, rows::Union{Integer,AbstractVector{<:Integer}})
    check_columns(env, action, length(rows))
    all_rows = zeros(eltype(action), env.action_count, env.rows)
    for (column, row) in enumerate(rows)
        all_rows[:, row_index(env, row) + 1] = view(action, :, column)
    end
    return all_rows
end

# Returns the elements without gaps between them, in a type that C knows.
dense(action::Tuple) = dense([action...])
dense(action::AbstractArray{<:Real}) = Array{Float64}(action)
dense(action::AbstractArray{T}) where {T<:Union{Float32,Float64}} = Array{T}(action)
dense(action::Array{<:Union{Float32,Float64}}) = action
dense(action::StridedVector{T}) where {T<:Union{Float32,Float64}} = stride(action, 1) == 1 ? action : Array{T}(action)
dense(action::StridedMatrix{T}) where {T<:Union{Float32,Float64}} =
    strides(action) == (1, size(action, 1)) ? action : Array{T}(action)

# The arrays of a batch; for an environment of one row, a vector and numbers.
function outputs(env::Env, batch::Batch)
    env.rows == 1 ||
        return (obs = batch.obs, reward = batch.reward, terminated = batch.terminated, truncated = batch.truncated)
    return (obs = vec(batch.obs), reward = batch.reward[1], terminated = batch.terminated[1], truncated = batch.truncated[1])
end

"""
    observe(env)

Returns the present observation of each row, without a step: a vector for one row, and a matrix with a column for each
row for many.
"""
observe(env::Env) = outputs(env, observe!(Batch(env), env)).obs

"""
    observe!(batch, env)

Writes the present observation of each row into the `obs` of a [`Batch`](@ref), and the arrays that the option `arrays`
names into its `arrays`. The other outputs keep their values. Returns the batch.
"""
function observe!(batch::Batch, env::Env)
    GC.@preserve batch begin
        out = raw(batch, env)
        check(env.handle, inside(handle -> mjenv_observe(handle, out), env))
    end
    return batch
end

"""
    MJEnv.info(batch)
    MJEnv.info(env)

Returns the info of the last reset or step that wrote into the batch, or of the last `reset!(env)` or
`step!(env, action)`. It is a NamedTuple with Gymnasium's keys in Gymnasium's order. For one row a value is an array, or
a number of the type that Gymnasium gives it; for many rows it is an array whose last dimension is the row.
"""
info(batch::Batch) = named(batch, batch.fields, batch.values)

info(env::Env) = env.latest === nothing ? NamedTuple() : info(env.latest)

"""
    MJEnv.reset_info(batch)

Returns the info of the last reset of each row in the form of [`MJEnv.info`](@ref). Both [`reset!`](@ref) and a step
with automatic resets write it.
"""
reset_info(batch::Batch) = named(batch, batch.outputs.reset_info, batch.reset_info)

"""
    MJEnv.final_info(batch)

Returns the info of the last step of the episodes that a step ended and reset, in the form of [`MJEnv.info`](@ref). It
is valid for the rows where `was_reset` is true. Without the option `autoreset_mode` at `:same_step` it is empty.
"""
final_info(batch::Batch) =
    isempty(batch.final_obs) ? NamedTuple() : named(batch, batch.outputs.info, batch.final_info)

"""
    MJEnv.arrays(batch)

Returns the mjData arrays that the option `arrays` names, as the last call left them, in the form of
[`MJEnv.info`](@ref). Their shapes are those of `read`.
"""
arrays(batch::Batch) = named(batch, batch.outputs.arrays, batch.arrays)

"""
    MJEnv.groups(batch)

Returns the observation of a [`Batch`](@ref) by group: a NamedTuple of the task's groups of terms and of the terms
without a group. The values are views of `obs`, with a column for each row. It is empty unless the observation is a
Gymnasium Dict (the option `observation`).
"""
function groups(batch::Batch)
    names = Tuple(Symbol(field.name) for field in batch.outputs.groups)
    return NamedTuple{names}(Tuple(view(batch.obs, field.range, :) for field in batch.outputs.groups))
end

# For many rows, the last dimension is the row.
function named(
    batch::Batch, fields::Vector{Field}, values::Vector{Float64}, dimensions = length(batch.reward) == 1 ? () : (length(batch.reward),)
)
    names = Tuple(Symbol(field.name) for field in fields)
    return NamedTuple{names}(Tuple(value_of(batch, field, values, dimensions) for field in fields))
end

function value_of(batch::Batch, field::Field, values::Vector{Float64}, dimensions)
    columns = length(batch.reward)
    part = view(values, ((first(field.range) - 1) * columns + 1):(last(field.range) * columns))
    return shaped(part, field, julia_type(field.dtype, batch.action_type), dimensions)
end

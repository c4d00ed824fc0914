# Sums, norms and scalars that round as NumPy's do, for tasks that must return the same bits as a Python original.

"""
    MJEnv.Scalar

A number of the action's type, such as [`MJEnv.sum_square`](@ref)`(sim.action)`. As in NumPy, its product with a number
is computed in the action's type: `weight * scalar`. `-scalar` and `Float64(scalar)` work, too. As an info, Python
shows it in the action's dtype.
"""
struct Scalar
    value::Float64
    narrow::Bool  # the action is Float32
end

Base.:*(factor::Real, scalar::Scalar) =
    scalar.narrow ? Scalar(Float32(factor) * Float32(scalar.value), true) : Scalar(factor * scalar.value, false)
Base.:*(scalar::Scalar, factor::Real) = factor * scalar
Base.:-(scalar::Scalar) = Scalar(-scalar.value, scalar.narrow)
Base.Float64(scalar::Scalar) = scalar.value

"""
    MJEnv.numpy_sum(values)

Returns `numpy.sum(values)` with NumPy's rounding. Julia's `sum` adds in another order.
"""
numpy_sum(values::AbstractVector{Float64}) = sum_of(identity, 0.0, values, firstindex(values), lastindex(values))

"""
    MJEnv.sum_square(values)

Returns `numpy.sum(numpy.square(values))` with NumPy's rounding. `MJEnv.sum_square(sim.action)` is computed in the
action's type, and is an [`MJEnv.Scalar`](@ref).
"""
sum_square(values::AbstractVector{Float64}) = sum_of(abs2, 0.0, values, firstindex(values), lastindex(values))

# NumPy adds fewer than 8 numbers one after the other, and up to 128 numbers in eight accumulators; it splits longer
# arrays into halves. zero is of the terms' type.
@inline sum_of(term, zero, values, from, to) =
    to - from < 7 ? sum_in_order(term, zero, values, from, to) : sum_of_many(term, zero, values, from, to)

function sum_of_many(term::F, zero::T, values, from::Int, to::Int)::T where {F,T}
    count = to - from + 1
    if count > 128
        half = count ÷ 2
        half -= half % 8
        return sum_of_many(term, zero, values, from, from + half - 1) + sum_of_many(term, zero, values, from + half, to)
    end
    lanes = ntuple(lane -> term(values[from + lane - 1]), Val(8))
    at = from + 8
    while at + 7 <= to
        lanes = add_lanes(term, lanes, values, at)
        at += 8
    end
    total = ((lanes[1] + lanes[2]) + (lanes[3] + lanes[4])) + ((lanes[5] + lanes[6]) + (lanes[7] + lanes[8]))
    return sum_in_order(term, total, values, at, to)
end

# A function of its own, because a closure allocates if it captures variables that change.
@inline add_lanes(term, lanes, values, at) = ntuple(lane -> lanes[lane] + term(values[at + lane - 1]), Val(8))

@inline function sum_in_order(term, total, values, from, to)
    for i in from:to
        total += term(values[i])
    end
    return total
end

"""
    MJEnv.Norm

A function that returns `numpy.linalg.norm` of two or three numbers: `norm(x, y, z)`, or of a tuple of them.
[`MJEnv.norm`](@ref) returns one. OpenBLAS, which NumPy calls, rounds once or twice; the option `norm` decides.
"""
struct Norm
    fused::Bool
end

(norm::Norm)(x::Real, others::Real...) = norm((x, others...))

function (norm::Norm)(numbers::Tuple{Real,Vararg{Real}})
    total = Float64(numbers[1])^2
    for number in Base.tail(numbers)
        total = norm.fused ? fma(Float64(number), Float64(number), total) : total + Float64(number)^2
    end
    return sqrt(total)
end

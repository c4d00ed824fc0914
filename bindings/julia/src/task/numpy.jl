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

"`MJEnv.numpy_sum(values)`: returns `numpy.sum(values)` with NumPy's rounding. Julia's `sum` adds in another order."
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
    MJEnv.Norm(fused)

A function that returns `numpy.linalg.norm` of numbers, of a tuple or of a vector: `norm(x, y, z)`, `norm(sim.qvel)`.
[`MJEnv.norm`](@ref) returns the one that the option `norm` chooses. NumPy calls OpenBLAS, whose kernel for AVX-512
(`fused`) fuses each multiplication with an addition, and so rounds once instead of twice; its kernel for AVX2 does so in
whole blocks of 16 numbers. Of more than 10000 numbers, NumPy's threads add parts, and this function does not.
"""
struct Norm
    fused::Bool
end

(norm::Norm)(x::Real, others::Real...) = norm((x, others...))
(norm::Norm)(numbers::Tuple{Vararg{Real}}) = norm_of(norm.fused, map(Float64, numbers))
(norm::Norm)(numbers::AbstractVector{<:Real}) = norm_of(norm.fused, numbers)

const NORM_BLOCK = 16  # which OpenBLAS keeps in four vectors of AVX2

function norm_of(fused::Bool, numbers)
    blocks = length(numbers) - length(numbers) % NORM_BLOCK
    total = blocks == 0 ? 0.0 : fused ? fused_blocks(numbers, blocks) : plain_blocks(numbers, blocks)
    first = firstindex(numbers)
    for i in (first + blocks):lastindex(numbers)
        number = Float64(numbers[i])
        total = fused ? fma(number, number, total) : total + number * number
    end
    return sqrt(total)
end

# Two blocks at once in vectors of AVX-512, whose halves are added; then a block that is left over.
function fused_blocks(numbers, count)
    wide, at = add_turns(ntuple(_ -> 0.0, Val(2 * NORM_BLOCK)), numbers, 0, count)
    sums, _ = add_turns(add_halves(wide), numbers, at, count)
    return (add_every_fourth(sums, 1) + add_every_fourth(sums, 3)) + (add_every_fourth(sums, 2) + add_every_fourth(sums, 4))
end

function plain_blocks(numbers, count)
    sums, _ = add_turns(ntuple(_ -> 0.0, Val(NORM_BLOCK)), numbers, 0, count)
    return add_pairs(sums, 1) + add_pairs(sums, 2)
end

# Adds the squares of the numbers to the sums, which take turns.
function add_turns(sums::NTuple{N,Float64}, numbers, at, count) where {N}
    while at + N <= count
        sums = add_squares(sums, numbers, at)
        at += N
    end
    return sums, at
end

# Functions of their own, because a closure allocates if it captures variables that change.
@inline add_squares(sums::NTuple{N,Float64}, numbers, at) where {N} =
    ntuple(i -> add_square(sums[i], Float64(numbers[firstindex(numbers) + at + i - 1])), Val(N))
@inline add_square(total, number) = fma(number, number, total)
@inline add_halves(wide) = ntuple(i -> wide[(i - 1) ÷ 4 * 4 + i] + wide[(i - 1) ÷ 4 * 4 + i + 4], Val(NORM_BLOCK))
@inline add_every_fourth(sums, i) = ((sums[i] + sums[i + 4]) + sums[i + 8]) + sums[i + 12]
@inline add_pair(sums, i) = sums[i] + sums[i + 2]
@inline add_pairs(sums, i) =
    (add_pair(sums, i) + add_pair(sums, i + 4)) + (add_pair(sums, i + 8) + add_pair(sums, i + 12))

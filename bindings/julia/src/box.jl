# Sets of vectors.

using Random: Random, AbstractRNG
import Random: seed!

"""
    MJEnv.Box(low, high)

The set of all vectors between two bounds, both included, like Gymnasium's space of that name. `low, high = box` returns
the bounds. `point in box` tests a vector; `rand(box)` draws one if the bounds are finite. Boxes with equal bounds are equal.
"""
struct Box{T<:AbstractFloat}
    low::Vector{T}
    high::Vector{T}
end

Base.iterate(box::Box, place = 1) = place > 2 ? nothing : (getfield(box, place), place + 1)
Base.IteratorSize(::Type{<:Box}) = Base.SizeUnknown()
Base.eltype(::Type{Box{T}}) where {T} = Vector{T}
Base.in(point::AbstractVector{<:Real}, box::Box) =
    length(point) == length(box.low) && all(box.low .<= point .<= box.high)
Base.:(==)(a::Box, b::Box) = a.low == b.low && a.high == b.high
Base.hash(box::Box, h::UInt) = hash(box.low, hash(box.high, hash(Box, h)))

function Random.rand(rng::AbstractRNG, sampler::Random.SamplerTrivial{Box{T}}) where {T}
    box = sampler[]
    if !all(isfinite, box.low) || !all(isfinite, box.high)
        throw(ArgumentError("there are no random points in a box without bounds"))
    end
    return box.low .+ rand(rng, T, length(box.low)) .* (box.high .- box.low)
end

Base.show(io::IO, box::Box) = print(io, "MJEnv.Box(", box.low, ", ", box.high, ")")

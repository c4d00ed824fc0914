# What MJEnv offers to other packages.

using Random: Random, AbstractRNG

"""
    MJEnv.Box(low, high)

All vectors between two, both included: supports `in`, and `rand` where the bounds are finite.
"""
struct Box{T<:AbstractFloat}
    low::Vector{T}
    high::Vector{T}
end

Base.eltype(::Type{Box{T}}) where {T} = Vector{T}
Base.in(point::AbstractVector{<:Real}, box::Box) =
    length(point) == length(box.low) && all(box.low .<= point .<= box.high)

function Random.rand(rng::AbstractRNG, sampler::Random.SamplerTrivial{Box{T}}) where {T}
    box = sampler[]
    if !all(isfinite, box.low) || !all(isfinite, box.high)
        throw(ArgumentError("there are no random points in a box without bounds"))
    end
    return box.low .+ rand(rng, T, length(box.low)) .* (box.high .- box.low)
end

# Julia before 1.9 knows no extensions: they are included when the other package is there.
const COMMON_RL = Base.PkgId(Base.UUID("d842c3ba-07a1-494f-bbec-f5741b0a3e98"), "CommonRLInterface")

function include_extension(package)
    package == COMMON_RL || return
    Base.include(Module(:Extensions), joinpath(@__DIR__, "..", "ext", "MJEnvCommonRLInterfaceExt.jl"))
    return
end

function watch_packages()
    if haskey(Base.loaded_modules, COMMON_RL)
        include_extension(COMMON_RL)
    else
        push!(Base.package_callbacks, include_extension)
    end
end

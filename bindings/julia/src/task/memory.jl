# Reads and writes the library's memory without copies.

# Loads one member of C's struct.
@generated function member(raw::Ptr{S}, ::Val{name}) where {S,name}
    index = findfirst(==(name), fieldnames(S))
    return :(unsafe_load(Ptr{$(fieldtype(S, index))}(raw + $(Int(fieldoffset(S, index))))))
end

# Stores one member of C's struct.
@generated function member!(raw::Ptr{S}, ::Val{name}, value) where {S,name}
    index = findfirst(==(name), fieldnames(S))
    return :(unsafe_store!(Ptr{$(fieldtype(S, index))}(raw + $(Int(fieldoffset(S, index)))), value))
end

"""
    MJEnv.RowArray{T,N,Writable}

An array in the library's memory, which a method of a [`MJEnv.Task`](@ref) reads, or also writes. It is valid until the
method returns, so copy what you keep. The last dimension counts bodies, joints and so on: `sim.xpos[:, b]`.
"""
struct RowArray{T,N,Writable} <: DenseArray{T,N}
    pointer::Ptr{T}
    size::NTuple{N,Int}
end

const ReadOnly{T,N} = RowArray{T,N,false}
const Writable{T,N} = RowArray{T,N,true}

Base.size(array::RowArray) = array.size
Base.IndexStyle(::Type{<:RowArray}) = IndexLinear()
Base.elsize(::Type{<:RowArray{T}}) where {T} = sizeof(T)
Base.unsafe_convert(::Type{Ptr{T}}, array::RowArray{T}) where {T} = array.pointer
Base.dataids(array::RowArray) = (UInt(array.pointer),)

@inline function Base.getindex(array::RowArray, index::Int)
    @boundscheck checkbounds(array, index)
    return unsafe_load(array.pointer, index)
end

@inline function Base.setindex!(array::Writable, value, index::Int)
    @boundscheck checkbounds(array, index)
    unsafe_store!(array.pointer, value, index)
    return array
end

Base.setindex!(::ReadOnly, _, ::Int) = throw(ArgumentError("a task can only read this array"))

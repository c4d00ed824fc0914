# Which rows of an environment a call is for.

"""
    MJEnv.Rows

What functions take as `rows`: `:` is all rows, a number one row, a vector of numbers some rows, and a `Bool` vector with
an element for each row of the environment a mask.

What belongs to a row, such as actions and seeds, has a column or an element for each row. For `:` and for a mask, these
are all rows of the environment, and those of rows outside the mask are ignored. Otherwise they are the chosen rows, in
their order. In a [`Batch`](@ref), each row always has its own place.

A row that does not exist throws an `ArgumentError`, and a mask of another length a `DimensionMismatch`.
"""
const Rows = Union{Colon,Integer,AbstractVector{<:Integer}}

function row_index(env, row::Integer)
    1 <= row <= env.rows && return Int(row) - 1
    throw(ArgumentError("row $row is outside 1:$(env.rows)"))
end

# The rows as the library takes them: null for all rows, else a flag for each row.
mask_of(env, ::Colon) = C_NULL
mask_of(env, row::Integer) = mask_of(env, row:row)

function mask_of(env, rows::AbstractVector{<:Integer})
    mask = zeros(Bool, env.rows)
    foreach(row -> mask[row_index(env, row) + 1] = true, rows)
    return mask
end

function mask_of(env, mask::AbstractVector{Bool})
    length(mask) == env.rows && return convert(Vector{Bool}, mask)
    throw(DimensionMismatch("the mask has $(length(mask)) elements; this $env needs $(env.rows)"))
end

# The numbers of the rows.
numbers_of(env, ::Colon) = 1:(env.rows)
numbers_of(env, row::Integer) = numbers_of(env, row:row)
numbers_of(env, rows::AbstractVector{<:Integer}) = Int[row_index(env, row) + 1 for row in rows]
numbers_of(env, mask::AbstractVector{Bool}) = findall(mask_of(env, mask))

# The number of rows for which an array must have elements.
row_count(env, ::Union{Colon,AbstractVector{Bool}}) = env.rows
row_count(env, rows::Union{Integer,AbstractVector{<:Integer}}) = length(rows)

# The library's number of the row or of all rows, for images.
image_row(env, ::Colon) = MJENV_ALL_ROWS
image_row(env, row::Integer) = row_index(env, row)

# Helpers for robots that walk: which feet touch the ground, how long they are in the air, and the heights of a terrain.

"""
    MJEnv.touching(sim, geoms, other)

Returns for each geom of the tuple `geoms` whether it touches the geom `other`: whether they have a contact whose distance is
at most 0. The task needs the contacts: `MJEnv.need!(b, :contacts)`.
"""
touching(sim::Sim, geoms::Tuple{Vararg{Integer}}, other::Integer) = map(geom -> touches(sim, geom, other), geoms)

touches(sim::Sim, a::Integer, b::Integer) =
    any(c -> c.distance <= 0 && ((c.geom1, c.geom2) == (a, b) || (c.geom1, c.geom2) == (b, a)), sim.contacts)

"""
    MJEnv.air_time!(time, touching, dt)

Counts how long each of some geoms, such as feet, has been in the air. `time` are numbers that the row remembers, as
`view(row.carried, task.air)`: they become 0 for a geom that touches the ground, and otherwise grow by `dt` in each step.
Returns for each geom how long the flight was that ended in this step, s; 0 if none did.
"""
function air_time!(time::AbstractVector, touching::NTuple{N,Bool}, dt::Real) where {N}
    flights = ntuple(i -> touching[i] ? time[i] : 0.0, Val(N))
    for i in 1:N
        time[i] = touching[i] ? 0.0 : time[i] + dt
    end
    return flights
end

# The place of a height field in the world, and where its numbers begin in hfield_data.
struct Grid
    before::Int  # how many numbers of hfield_data come before those of this field
    rows::Int
    columns::Int
    size::NTuple{3,Float64}
    position::NTuple{3,Float64}
end

const HEIGHT_FIELD = 1  # mjGEOM_HFIELD

# The Grid of the geom with this number and name. element(name, index): an element of an array of mjModel.
function grid_of(element, at, geom)
    is_fixed = element(:geom_bodyid, at) == 0 && element(:geom_quat, 4 * at - 3) == 1
    if element(:geom_type, at) != HEIGHT_FIELD || !is_fixed
        throw(ArgumentError("geom \"$geom\" is no height field that is fixed to the world and not turned"))
    end
    field = Int(element(:geom_dataid, at))
    return Grid(
        element(:hfield_adr, field + 1),
        element(:hfield_nrow, field + 1),
        element(:hfield_ncol, field + 1),
        ntuple(i -> Float64(element(:hfield_size, 4 * field + i)), 3),
        ntuple(i -> Float64(element(:geom_pos, 3 * at - 3 + i)), 3),
    )
end

# Where a position lies among `count` numbers that are spread over twice the radius, from 0.
cell(x, radius, count) = clamp((x + radius) / (2 * radius) * (count - 1), 0.0, Float64(count - 1))

# The height at x and y. data: hfield_data.
function height_of(grid::Grid, data, x, y)
    column = cell(x - grid.position[1], grid.size[1], grid.columns)
    row = cell(y - grid.position[2], grid.size[2], grid.rows)
    # The result of unsafe_trunc for NaN is any number.
    c = clamp(unsafe_trunc(Int, column), 0, max(grid.columns - 2, 0))
    r = clamp(unsafe_trunc(Int, row), 0, max(grid.rows - 2, 0))
    u, v = column - c, row - r
    function at(j, i)
        line = min(r + j, grid.rows - 1) * grid.columns
        return Float64(data[grid.before + line + min(c + i, grid.columns - 1) + 1])
    end
    # The diagonal of a cell goes from (r, c) to (r + 1, c + 1).
    near, far = at(0, 0), at(1, 1)
    if u >= v
        corner = at(0, 1)
        along = u * (corner - near) + v * (far - corner)
    else
        corner = at(1, 0)
        along = v * (corner - near) + u * (far - corner)
    end
    return (near + along) * grid.size[3] + grid.position[3]
end

# Where a body's frame, turned by its yaw alone, has a point: a function of the point.
function yawed(x, y, ahead, left)
    norm = sqrt(ahead * ahead + left * left)
    cosine, sine = norm > 0 ? (ahead / norm, left / norm) : (1.0, 0.0)
    return point -> (x + (cosine * point[1] - sine * point[2]), y + (sine * point[1] + cosine * point[2]))
end

"""
    MJEnv.Terrain

A height field whose geom is fixed to the world and not turned; [`MJEnv.terrain`](@ref) returns it. The surface consists of
the triangles with which other geoms collide. Beyond the edge, the heights are those of the edge. If rows have their own
`hfield_data`, the heights are the row's.
"""
struct Terrain
    data::NamedArray{Float32,1}
    grid::Grid
end

"""
    MJEnv.terrain(b, geom)

Returns the [`MJEnv.Terrain`](@ref) of the geom with this name, whose heights [`MJEnv.height`](@ref) and
[`MJEnv.around`](@ref) read. Throws if it is no height field, if it is not fixed to the world, or if it is turned.
"""
terrain(b::Builder, geom::Union{AbstractString,Symbol}) = Terrain(
    array(b, :hfield_data), grid_of((name, index) -> value_of(b, name, index), object_index(b, :geom, geom), geom)
)

"""
    MJEnv.height(terrain, sim, x, y)
    MJEnv.height(terrain, start, x, y)

Returns the height of the [`MJEnv.Terrain`](@ref) at `x` and `y`, m; all in the world's frame. What `reset!` writes into own
`hfield_data` counts after `MJEnv.forward!(start)` or `MJEnv.advance!(start, count)`.
"""
height(terrain::Terrain, view::Union{Sim,Start}, x::Real, y::Real) =
    height_of(terrain.grid, view[terrain.data], x, y)

"""
    MJEnv.around(terrain, sim, body, points)

Returns a generator of the heights of the [`MJEnv.Terrain`](@ref) at `points` `(x, y)` in the frame of a body that is turned
by the body's yaw alone, m in the world's frame.
"""
function around(terrain::Terrain, sim::Sim, body::Integer, points)
    place = yawed(sim.xpos[1, body], sim.xpos[2, body], sim.xmat[1, body], sim.xmat[4, body])
    return (height(terrain, sim, place(point)...) for point in points)
end

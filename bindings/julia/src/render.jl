# Draws pictures of rows, and shows them in a window.

# The settings that choose the groups of objects that are drawn; they are named like mjvOption's arrays.
const GROUPS = (:geomgroup, :sitegroup, :jointgroup, :tendongroup, :actuatorgroup, :skingroup)

# The settings that turn something on or off, beside those of the groups.
const SWITCHES = (:shadows, :reflections, :wireframe, :additive, :skybox, :fog, :haze, :cull_face)
# MuJoCo's mjtLabel and mjtFrame, from 0.
const LABELS = (
    :none, :body, :joint, :geom, :site, :camera, :light, :tendon, :actuator, :constraint, :skin, :selection, :selpnt, :contactforce,
)
const FRAMES = (:none, :body, :geom, :site, :camera, :light, :contact, :world)

# Returns the settings changed by the keywords, and the camera's name or nothing.
function render_settings(env; kwargs...)
    settings = Ref(mjenv_render_settings())
    check(env.handle, inside(handle -> mjenv_render_defaults(handle, settings), env))
    names = (:width, :height, :max_geom, :samples, :distance, :azimuth, :elevation, SWITCHES...)
    fields = Dict{Symbol,Any}(name => getfield(settings[], name) for name in fieldnames(mjenv_render_settings))
    camera_name = nothing
    for (name, value) in pairs(kwargs)
        if name === :camera
            if value isa Union{AbstractString,Symbol} && value !== :free
                camera_name = text(value)
            else
                fields[:camera] = value === :free ? MJENV_CAMERA_FREE : value >= 1 ? value - 1 : typemin(Int32)
            end
        elseif name === :gl
            value in (:auto, :egl, :osmesa, :glfw) || throw(ArgumentError("gl is :auto, :egl, :osmesa or :glfw"))
            fields[:gl] = findfirst(==(value), (:auto, :egl, :osmesa, :glfw)) - 1
        elseif name === :label || name === :frame
            known = name === :label ? LABELS : FRAMES
            value in known || throw(ArgumentError("$name is one of $(join(known, ", "))"))
            fields[name] = findfirst(==(value), known) - 1
        elseif name === :fast
            value && (fields[:samples] = fields[:shadows] = 0)
        elseif name === :lookat
            length(value) == 3 || throw(ArgumentError("lookat has 3 coordinates"))
            fields[:lookat] = NTuple{3,Float64}(value)
        elseif name === :visual_options
            visual = collect(fields[:visual])
            for (flag, on) in value
                0 <= flag <= Int(MJENV_VISUAL_SKIN) || throw(ArgumentError("there is no visual option $flag"))
                visual[flag + 1] = on
            end
            fields[:visual] = Tuple(visual)
        elseif name in GROUPS
            groups = collect(fields[name])
            for (group, on) in value
                0 <= group < length(groups) || throw(ArgumentError("$name has no group $group"))
                groups[group + 1] = on
            end
            fields[name] = Tuple(groups)
        elseif name in names
            fields[name] = value
        else
            others = (:camera, :gl, :fast, :label, :frame, :lookat, :visual_options, GROUPS..., names...)
            throw(ArgumentError("there is no setting $name; the settings are $(join(others, ", "))"))
        end
    end
    integers = (:width, :height, :max_geom, :samples, :camera, SWITCHES...)
    for name in integers
        fields[name] = Int32(clamp(fields[name], typemin(Int32), typemax(Int32)))
    end
    return fields, camera_name
end

# Passes the settings to f as C's struct.
function with_render_settings(f, env; kwargs...)
    fields, camera_name = render_settings(env; kwargs...)
    GC.@preserve camera_name begin
        camera_name === nothing || (fields[:camera_name] = Cstring(pointer(camera_name)))
        return f(Ref(mjenv_render_settings(; fields...)))
    end
end

"""
    Renderer(env; settings...)

Draws pictures of the rows of `env`. They equal Gymnasium's pixel for pixel if both use the same OpenGL on the same
machine. If OpenGL is missing, the error names what to install.

The settings are Gymnasium's, with Gymnasium's defaults:

- `width` and `height`: pixels, 480 each
- `camera`: the number of a camera of the model, from 1; its name; or `:free`, the default
- `lookat` (m), `distance` (m), `azimuth` and `elevation` (degrees): the place of the free camera
- `visual_options`: pairs of a number of MuJoCo's mjtVisFlag and a `Bool`
- `geomgroup`, `sitegroup`, `jointgroup`, `tendongroup`, `actuatorgroup`, `skingroup`: which groups are drawn, as pairs of
  a group, 0 to 5, and a `Bool`; by default 0 to 2, so `geomgroup = (3 => true,)` adds group 3
- `max_geom`: how many geoms are drawn at most, 1000
- `samples` (per pixel), `shadows`, `reflections`; `fast = true` turns multisampling and shadows off
- `wireframe`, `additive`, `skybox`, `fog`, `haze`, `cull_face`: MuJoCo's mjtRndFlag of these names
- `label` and `frame`: the objects that get labels and whose frames are drawn, by the names of MuJoCo's mjtLabel and
  mjtFrame: `:none`, `:body`, `:geom`, `:site`, ...
- `gl`: `:auto`, `:egl`, `:osmesa` or `:glfw`

`close(renderer)` frees the renderer at once; without it the garbage collector frees it at some time. Several renderers
of one environment may draw on different threads at the same time. While a thread steps the environment, drawing throws
an `MJEnvError` of status `MJENV_E_BUSY`.
"""
mutable struct Renderer
    handle::Handle{mjenv_renderer}
    width::Int
    height::Int

    function Renderer(env::Env; settings...)
        created = Ref{Ptr{mjenv_renderer}}(C_NULL)
        with_render_settings(env; settings...) do chosen
            check(env.handle, inside(handle -> mjenv_renderer_create(handle, chosen, created), env))
            return finalizer(close, new(Handle(env.handle.engine, created[]), chosen[].width, chosen[].height))
        end
    end
end

function Base.close(renderer::Renderer)
    mjenv_renderer_destroy(renderer.handle)
    renderer.handle = Handle(renderer.handle.engine, Ptr{mjenv_renderer}(C_NULL))
    return nothing
end

Base.isopen(renderer::Renderer) = renderer.handle.pointer != C_NULL

Base.show(io::IO, r::Renderer) =
    print(io, "Renderer(", r.width, " x ", r.height, ")", isopen(r) ? "" : " (closed)")

"""
    MJEnv.gl(renderer)

Returns the OpenGL in use as text: `"egl, VENDOR, RENDERER, VERSION"`.
"""
function gl(renderer::Renderer)
    GC.@preserve renderer begin
        found = mjenv_renderer_gl(renderer.handle)
        found == C_NULL && throw(ArgumentError("this Renderer is closed"))
        return unsafe_string(found)
    end
end

"""
    render(renderer; row = 1)

Draws a row and returns its colours: a new `Array{UInt8,3}` of size (3, height, width), red, green and blue first, the
top line first. `Images.colorview(RGB, render(r) ./ 255)` takes it.
"""
function render(renderer::Renderer; row::Integer = 1)
    rgb = Vector{UInt8}(undef, 3 * renderer.width * renderer.height)
    draw(renderer, row, rgb, Float32[])
    return rgb_array(renderer, rgb)
end

"""
    render_depth(renderer; row = 1)

Draws a row and returns its depth buffer, from 0 (near) to 1 (far): a new `Matrix{Float32}` of size (height, width).
"""
function render_depth(renderer::Renderer; row::Integer = 1)
    depth = Vector{Float32}(undef, renderer.width * renderer.height)
    draw(renderer, row, UInt8[], depth)
    return depth_array(renderer, depth)
end

"""
    render_both(renderer; row = 1)

Draws a row once, and returns what [`render`](@ref) and [`render_depth`](@ref) return.
"""
function render_both(renderer::Renderer; row::Integer = 1)
    pixels = renderer.width * renderer.height
    rgb, depth = Vector{UInt8}(undef, 3 * pixels), Vector{Float32}(undef, pixels)
    draw(renderer, row, rgb, depth)
    return rgb_array(renderer, rgb), depth_array(renderer, depth)
end

"""
    render_segmentation(renderer; row = 1)

Draws which object each pixel shows: a new `Array{Int32,3}` of size (2, height, width), with the object's index in the
model, from 0, and its type, MuJoCo's mjtObj; -1 and -1 where nothing is.
"""
function render_segmentation(renderer::Renderer; row::Integer = 1)
    objects = Vector{Int32}(undef, 2 * renderer.width * renderer.height)
    GC.@preserve renderer objects begin
        handle = renderer.handle
        check(handle, mjenv_render_segmentation(handle, row - 1, pointer(objects), length(objects)))
    end
    return permutedims(reshape(objects, 2, renderer.width, renderer.height), (1, 3, 2))
end

# The library writes lines of pixels; Julia stores columns.
rgb_array(r, rgb) = permutedims(reshape(rgb, 3, r.width, r.height), (1, 3, 2))
depth_array(r, depth) = permutedims(reshape(depth, r.width, r.height))

function draw(renderer, row, rgb, depth)
    GC.@preserve renderer rgb depth begin
        place(array) = isempty(array) ? Ptr{eltype(array)}(C_NULL) : pointer(array)
        handle = renderer.handle
        check(handle, mjenv_render(handle, row - 1, place(rgb), length(rgb), place(depth), length(depth)))
    end
end

"""
    Window(env; settings...)

Opens a window that shows a row, as Gymnasium's render mode "human" does. Call `draw!(window)` after every reset and
step, on the main thread. The window lists its keys. `settings` are those of a [`Renderer`](@ref), but the camera is
always free.
"""
mutable struct Window
    handle::Handle{mjenv_window}

    function Window(env::Env; settings...)
        created = Ref{Ptr{mjenv_window}}(C_NULL)
        with_render_settings(env; settings...) do chosen
            check(env.handle, inside(handle -> mjenv_window_create(handle, chosen, created), env))
        end
        return new(Handle(env.handle.engine, created[]))
    end
end

"""
    draw!(window; row = 1)

Draws a row. While the user pauses, it keeps drawing and does not return. It draws nothing once the window is closed.
"""
draw!(window::Window; row::Integer = 1) = check(window.handle, mjenv_window_draw(window.handle, row - 1))

Base.isopen(window::Window) = mjenv_window_is_open(window.handle) != 0

Base.show(io::IO, window::Window) = print(io, "Window(", isopen(window) ? "open" : "closed", ")")

function Base.close(window::Window)
    mjenv_window_destroy(window.handle)
    window.handle = Handle(window.handle.engine, Ptr{mjenv_window}(C_NULL))
    return nothing
end

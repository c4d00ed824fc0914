# Draws pictures of rows, and shows them in a window.

# The settings that choose the groups of objects that are drawn; they are named like mjvOption's arrays.
const GROUPS = (:geomgroup, :sitegroup, :jointgroup, :tendongroup, :actuatorgroup, :skingroup)

# The settings that turn something on or off, beside those of the groups.
const SWITCHES = (:shadows, :reflections, :wireframe, :additive, :skybox, :fog, :haze, :cull_face)
# The texts that settings take, with the numbers of mjenv_gl, mjtLabel and mjtFrame, from 0.
const CHOICES = (
    gl = (:auto, :egl, :osmesa, :glfw),
    label = (:none, :body, :joint, :geom, :site, :camera, :light, :tendon, :actuator, :constraint, :skin, :selection, :selpnt, :contactforce),
    frame = (:none, :body, :geom, :site, :camera, :light, :contact, :world),
)
const NUMBERS = (:width, :height, :max_geom, :samples, :distance, :azimuth, :elevation, SWITCHES...)

# The flags, changed by pairs of an index from 0 and a Bool.
function changed(name, flags, count, pairs)
    flags = collect(flags)
    for (index, on) in pairs
        0 <= index < count || throw(ArgumentError("$name has no number $index"))
        flags[index + 1] = on
    end
    return Tuple(flags)
end

# Returns the settings changed by the keywords, and the camera's name or nothing.
function render_settings(env; kwargs...)
    settings = Ref(mjenv_render_settings())
    call(mjenv_render_defaults, env, settings)
    fields = Dict{Symbol,Any}(name => getfield(settings[], name) for name in fieldnames(mjenv_render_settings))
    camera_name = nothing
    for (name, value) in pairs(kwargs)
        if name === :camera && value isa Union{AbstractString,Symbol} && value !== :free
            camera_name = text(value)
        elseif name === :camera
            fields[:camera] = value === :free ? MJENV_CAMERA_FREE : value >= 1 ? value - 1 : typemin(Int32)
        elseif haskey(CHOICES, name)
            known = CHOICES[name]
            value in known || throw(ArgumentError("$name is one of $(join(map(repr, known), ", "))"))
            fields[name] = findfirst(==(value), known) - 1
        elseif name === :fast
            value && (fields[:samples] = fields[:shadows] = 0)
        elseif name === :lookat
            length(value) == 3 || throw(ArgumentError("lookat has 3 coordinates"))
            fields[:lookat] = NTuple{3,Float64}(value)
        elseif name === :visual_options
            fields[:visual] = changed(name, fields[:visual], Int(MJENV_VISUAL_SKIN) + 1, value)
        elseif name in GROUPS
            fields[name] = changed(name, fields[name], length(fields[name]), value)
        elseif name in NUMBERS
            fields[name] = value
        else
            others = (:camera, :fast, :lookat, :visual_options, keys(CHOICES)..., GROUPS..., NUMBERS...)
            throw(ArgumentError("there is no setting $name; the settings are $(join(others, ", "))"))
        end
    end
    for name in (:width, :height, :max_geom, :samples, :camera, SWITCHES...)
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
            call(mjenv_renderer_create, env, chosen, created)
            return finalizer(close, new(Handle(env.handle.engine, created[]), chosen[].width, chosen[].height))
        end
    end
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
render(renderer::Renderer; row::Integer = 1) = draw(renderer, row, 3, 0)[1]

"""
    render_depth(renderer; row = 1)

Draws a row and returns its depth buffer, from 0 (near) to 1 (far): a new `Matrix{Float32}` of size (height, width).
"""
render_depth(renderer::Renderer; row::Integer = 1) = draw(renderer, row, 0, 1)[2]

"`render_both(renderer; row = 1)`: draws a row once, and returns what [`render`](@ref) and [`render_depth`](@ref) return."
render_both(renderer::Renderer; row::Integer = 1) = draw(renderer, row, 3, 1)

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
    return picture_array(renderer, objects)
end

# The library writes lines of pixels; Julia stores columns.
picture_array(r, numbers) = permutedims(reshape(numbers, :, r.width, r.height), (1, 3, 2))

# Draws so many numbers of colour and depth for each pixel, 0 for none.
function draw(renderer, row, colours, depths)
    pixels = renderer.width * renderer.height
    rgb, depth = Vector{UInt8}(undef, colours * pixels), Vector{Float32}(undef, depths * pixels)
    GC.@preserve renderer rgb depth begin
        place(array) = isempty(array) ? Ptr{eltype(array)}(C_NULL) : pointer(array)
        handle = renderer.handle
        check(handle, mjenv_render(handle, row - 1, place(rgb), length(rgb), place(depth), length(depth)))
    end
    lines = isempty(depth) ? nothing : permutedims(reshape(depth, renderer.width, :))
    return picture_array(renderer, rgb), lines
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
        with_render_settings(chosen -> call(mjenv_window_create, env, chosen, created), env; settings...)
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

destroy(handle::Handle{mjenv_renderer}) = mjenv_renderer_destroy(handle)
destroy(handle::Handle{mjenv_window}) = mjenv_window_destroy(handle)

function Base.close(drawer::Union{Renderer,Window})
    destroy(drawer.handle)
    drawer.handle = typeof(drawer.handle)(drawer.handle.engine, drawer.handle.addresses, C_NULL)
    return nothing
end

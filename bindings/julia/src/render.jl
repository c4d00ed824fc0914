# Pictures of an environment's rows, and a window that shows them.

# The settings that keywords change, and what is to be kept alive for them.
function render_settings(env; kwargs...)
    settings = Ref(mjenv_render_settings())
    check(inside(handle -> mjenv_render_defaults(handle, settings), env))
    names = (:width, :height, :max_geom, :samples, :shadows, :reflections, :distance, :azimuth, :elevation)
    fields = Dict{Symbol,Any}(name => getfield(settings[], name) for name in fieldnames(mjenv_render_settings))
    camera_name = nothing
    for (name, value) in pairs(kwargs)
        if name === :camera
            if value isa Union{AbstractString,Symbol} && value !== :track && value !== :free
                camera_name = text(value)
            else
                fields[:camera] =
                    value === :track ? MJENV_CAMERA_DEFAULT :
                    value === :free ? MJENV_CAMERA_FREE : value >= 1 ? value - 1 : typemin(Int32)
            end
        elseif name === :gl
            value in (:auto, :egl, :osmesa, :glfw) || throw(ArgumentError("gl is :auto, :egl, :osmesa or :glfw"))
            fields[:gl] = findfirst(==(value), (:auto, :egl, :osmesa, :glfw)) - 1
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
        elseif name in names
            fields[name] = value
        else
            throw(ArgumentError("a renderer has no setting $name; it has camera, gl, fast, lookat, visual_options, " *
                                join(names, ", ")))
        end
    end
    integers = (:width, :height, :max_geom, :samples, :shadows, :reflections, :camera)
    for name in integers
        fields[name] = Int32(clamp(fields[name], typemin(Int32), typemax(Int32)))
    end
    return fields, camera_name
end

# Calls f(settings) with the settings as C has them.
function with_render_settings(f, env; kwargs...)
    fields, camera_name = render_settings(env; kwargs...)
    GC.@preserve camera_name begin
        camera_name === nothing || (fields[:camera_name] = Cstring(pointer(camera_name)))
        return f(Ref(mjenv_render_settings(; fields...)))
    end
end

"""
    Renderer(env; settings...)

Draws pictures of the rows of `env`, equal to Gymnasium's pixel for pixel with the same OpenGL on the same machine.

Settings: `width` and `height` (pixels, 480 each), `camera` (the index of a camera of the model, from 1; its name;
`:free`; or `:track`, the default: the one named "track" if the model has it, else the free one), `max_geom` (1000),
`visual_options` (pairs of mjtVisFlag and Bool), `samples`, `shadows`, `reflections`, `fast = true` (no multisampling,
no shadows), `gl` (`:auto`, `:egl`, `:osmesa` or `:glfw`), and for the free camera `lookat` (m), `distance` (m),
`azimuth` and `elevation` (degrees).

`close(renderer)` frees it now; else the garbage collector will some day. Distinct renderers draw at once on different
threads, also of one environment; but not while a thread steps it. Needs OpenGL: the error names what to install.
"""
mutable struct Renderer
    handle::Ptr{mjenv_renderer}
    width::Int
    height::Int

    function Renderer(env::Env; settings...)
        created = Ref{Ptr{mjenv_renderer}}(C_NULL)
        with_render_settings(env; settings...) do chosen
            check(inside(handle -> mjenv_renderer_create(handle, chosen, created), env))
            return finalizer(close, new(created[], chosen[].width, chosen[].height))
        end
    end
end

function Base.close(renderer::Renderer)
    mjenv_renderer_destroy(renderer.handle)
    renderer.handle = C_NULL
    return nothing
end

Base.isopen(renderer::Renderer) = renderer.handle != C_NULL

Base.show(io::IO, r::Renderer) =
    print(io, "Renderer(", r.width, " x ", r.height, ")", isopen(r) ? "" : " (closed)")

"""
    MJEnv.gl(renderer)

The OpenGL in use, as text.
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

The colours of a row: an `Array{UInt8,3}` of size (3, height, width), as `Images.colorview(RGB, render(r) ./ 255)`
takes it.
"""
function render(renderer::Renderer; row::Integer = 1)
    rgb = Vector{UInt8}(undef, 3 * renderer.width * renderer.height)
    draw(renderer, row, rgb, Float32[])
    return rgb_array(renderer, rgb)
end

"""
    render_depth(renderer; row = 1)

The depth buffer of a row, 0 (near) to 1 (far): a `Matrix{Float32}` of size (height, width).
"""
function render_depth(renderer::Renderer; row::Integer = 1)
    depth = Vector{Float32}(undef, renderer.width * renderer.height)
    draw(renderer, row, UInt8[], depth)
    return depth_array(renderer, depth)
end

"""
    render_both(renderer; row = 1)

Colours and depth, drawn once.
"""
function render_both(renderer::Renderer; row::Integer = 1)
    pixels = renderer.width * renderer.height
    rgb, depth = Vector{UInt8}(undef, 3 * pixels), Vector{Float32}(undef, pixels)
    draw(renderer, row, rgb, depth)
    return rgb_array(renderer, rgb), depth_array(renderer, depth)
end

# From rows of pixels to columns.
rgb_array(r, rgb) = permutedims(reshape(rgb, 3, r.width, r.height), (1, 3, 2))
depth_array(r, depth) = permutedims(reshape(depth, r.width, r.height))

function draw(renderer, row, rgb, depth)
    GC.@preserve renderer rgb depth begin
        place(array) = isempty(array) ? Ptr{eltype(array)}(C_NULL) : pointer(array)
        check(mjenv_render(renderer.handle, row - 1, place(rgb), length(rgb), place(depth), length(depth)))
    end
end

"""
    Window(env; settings...)

A window that shows rows as Gymnasium's render mode "human" does: `draw!(window)` it after every reset and step, on the
main thread. The keys stand in the window. `settings` as a [`Renderer`](@ref)'s; its camera is always free.
"""
mutable struct Window
    handle::Ptr{mjenv_window}

    function Window(env::Env; settings...)
        created = Ref{Ptr{mjenv_window}}(C_NULL)
        with_render_settings(env; settings...) do chosen
            check(inside(handle -> mjenv_window_create(handle, chosen, created), env))
        end
        return new(created[])
    end
end

"""
    draw!(window; row = 1)

Draws a row, for as long as the user pauses; nothing once the window is closed.
"""
draw!(window::Window; row::Integer = 1) = check(mjenv_window_draw(window.handle, row - 1))

Base.isopen(window::Window) = mjenv_window_is_open(window.handle) != 0

function Base.close(window::Window)
    mjenv_window_destroy(window.handle)
    window.handle = C_NULL
    return nothing
end

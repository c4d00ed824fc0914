use std::ffi::CString;
use std::fmt;
use std::ptr::{self, NonNull};

use mjenv_sys as sys;

use crate::describe::{int64, size_of};
use crate::error::{check, Result};
use crate::text::{borrowed, c_string};
use crate::Env;

/// What provides OpenGL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Gl {
    /// The one that the environment variable `MUJOCO_GL` names; unset: the first of EGL, GLFW and OSMesa that works.
    #[default]
    Auto,
    /// Without a display. Debian: libegl1 libgl1-mesa-dri.
    Egl,
    /// Without a display or a graphics driver. Debian: libosmesa6. Excludes the others in a process.
    OsMesa,
    /// An invisible window on a display. Debian: libglfw3.
    Glfw,
}

impl Gl {
    fn raw(self) -> sys::mjenv_gl {
        match self {
            Self::Auto => sys::MJENV_GL_AUTO,
            Self::Egl => sys::MJENV_GL_EGL,
            Self::OsMesa => sys::MJENV_GL_OSMESA,
            Self::Glfw => sys::MJENV_GL_GLFW,
        }
    }
}

/// From where a picture is taken.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub enum Camera {
    /// The model's camera "track" if it has one, else the free camera.
    #[default]
    Track,
    /// The free camera, placed by the settings.
    Free,
    /// A camera of the model by its index.
    Index(i32),
    /// A camera of the model by its name.
    Name(String),
}

/// How pictures are drawn: Gymnasium's arguments of the same names, at Gymnasium's defaults from
/// [`Env::render_settings`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RenderSettings {
    /// What provides OpenGL.
    pub gl: Gl,
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// From where.
    pub camera: Camera,
    /// Geoms drawn at most.
    pub max_geom: i32,
    /// Samples a pixel; 0: no multisampling.
    pub samples: i32,
    /// Whether shadows are drawn.
    pub shadows: bool,
    /// Whether reflections are drawn.
    pub reflections: bool,
    /// What the free camera looks at, in m; `None`: the median of the geoms' positions in the first state drawn.
    pub lookat: Option<[f64; 3]>,
    /// Of the free camera, in m; `None`: the model's extent.
    pub distance: Option<f64>,
    /// Of the free camera, in degrees; `None`: 90.
    pub azimuth: Option<f64>,
    /// Of the free camera, in degrees; `None`: -45.
    pub elevation: Option<f64>,
    /// What is visible beside the geoms, by the numbers of MuJoCo's mjtVisFlag: Gymnasium's visual_options.
    pub visual: [bool; RenderSettings::VISUAL_FLAGS],
}

impl RenderSettings {
    /// How many flags `visual` has.
    pub const VISUAL_FLAGS: usize = sys::MJENV_VISUAL_SKIN as usize + 1;

    /// So many pixels.
    #[must_use]
    pub fn size(mut self, width: usize, height: usize) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// From that camera.
    #[must_use]
    pub fn camera(mut self, camera: Camera) -> Self {
        self.camera = camera;
        self
    }

    /// Without multisampling and shadows: several times as fast, with other pixels than Gymnasium's.
    #[must_use]
    pub fn fast(mut self) -> Self {
        (self.samples, self.shadows) = (0, false);
        self
    }

    fn of(env: &Env) -> Self {
        let mut raw = empty();
        // SAFETY: handle and struct are valid for the call.
        check(unsafe { sys::mjenv_render_defaults(env.raw(), &mut raw) }).expect("an environment has default settings");
        let given = |value: f64| Some(value).filter(|value| !value.is_nan());
        let mut visual = [false; Self::VISUAL_FLAGS];
        visual.iter_mut().zip(raw.visual).for_each(|(flag, value)| *flag = value != 0);
        Self {
            gl: Gl::Auto,
            width: raw.width as usize,
            height: raw.height as usize,
            camera: Camera::Track,
            max_geom: raw.max_geom,
            samples: raw.samples,
            shadows: raw.shadows != 0,
            reflections: raw.reflections != 0,
            lookat: Some(raw.lookat).filter(|lookat| !lookat[0].is_nan()),
            distance: given(raw.distance),
            azimuth: given(raw.azimuth),
            elevation: given(raw.elevation),
            visual,
        }
    }

    /// Calls `body` with the settings as C has them.
    fn with_raw<T>(&self, body: impl FnOnce(*const sys::mjenv_render_settings) -> Result<T>) -> Result<T> {
        let name: CString;
        let mut raw = empty();
        raw.gl = self.gl.raw() as i32;
        raw.width = i32::try_from(self.width).unwrap_or(i32::MAX);
        raw.height = i32::try_from(self.height).unwrap_or(i32::MAX);
        raw.max_geom = self.max_geom;
        raw.samples = self.samples;
        raw.shadows = self.shadows.into();
        raw.reflections = self.reflections.into();
        raw.lookat = self.lookat.unwrap_or([f64::NAN; 3]);
        raw.distance = self.distance.unwrap_or(f64::NAN);
        raw.azimuth = self.azimuth.unwrap_or(f64::NAN);
        raw.elevation = self.elevation.unwrap_or(f64::NAN);
        raw.visual.iter_mut().zip(self.visual).for_each(|(value, flag)| *value = flag.into());
        raw.camera = match &self.camera {
            Camera::Track => sys::MJENV_CAMERA_DEFAULT,
            Camera::Free => sys::MJENV_CAMERA_FREE,
            // Below 0 are names of this crate's own.
            Camera::Index(index) if *index < 0 => i32::MIN,
            Camera::Index(index) => *index,
            Camera::Name(text) => {
                name = c_string(format_args!("camera {text:?}"), text)?;
                raw.camera_name = name.as_ptr();
                sys::MJENV_CAMERA_DEFAULT
            }
        };
        body(&raw)
    }
}

fn empty() -> sys::mjenv_render_settings {
    sys::mjenv_render_settings { struct_size: size_of::<sys::mjenv_render_settings>(), ..Default::default() }
}

/// A picture: rows of pixels from the top, each from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    width: usize,
    pixels: Vec<T>,
}

impl<T: Copy + Default> Image<T> {
    fn new(width: usize, height: usize) -> Self {
        Self { width, pixels: vec![T::default(); width * height] }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// The pixel in column `x` of row `y`.
    ///
    /// # Panics
    /// Outside the picture.
    pub fn get(&self, x: usize, y: usize) -> T {
        assert!(x < self.width, "column {x} is outside 0..{}", self.width);
        self.pixels[y * self.width + x]
    }
}

impl Image<[u8; 3]> {
    /// Red, green and blue of all pixels, row by row: what image crates take.
    pub fn into_bytes(self) -> Vec<u8> {
        self.pixels.into_iter().flatten().collect()
    }
}

/// Draws pictures of an environment's rows, equal to Gymnasium's pixel for pixel with the same OpenGL.
///
/// It reads the environment when it draws and changes nothing in it. It may be used on another thread than the
/// environment, also after the environment's end; but while another thread is inside the environment, it answers
/// [`ErrorKind::Busy`](crate::ErrorKind::Busy). Renderers of one environment draw at the same time.
pub struct Renderer {
    raw: NonNull<sys::mjenv_renderer>,
    width: usize,
    height: usize,
}

// SAFETY: the library draws on any thread and makes its OpenGL context current only during a call.
unsafe impl Send for Renderer {}

impl Renderer {
    /// Builds a renderer. Errors: [`ErrorKind::Value`](crate::ErrorKind::Value), [`ErrorKind::Name`](crate::ErrorKind::Name) (the
    /// camera), [`ErrorKind::Render`](crate::ErrorKind::Render), [`ErrorKind::Memory`](crate::ErrorKind::Memory).
    pub fn new(env: &Env, settings: &RenderSettings) -> Result<Self> {
        let mut raw = ptr::null_mut();
        settings.with_raw(|settings| {
            // SAFETY: all pointers are valid for the call, which only reads the environment.
            check(unsafe { sys::mjenv_renderer_create(env.raw(), settings, &mut raw) })
        })?;
        let raw = NonNull::new(raw).expect("libmjenv creates a renderer or fails");
        Ok(Self { raw, width: settings.width, height: settings.height })
    }

    /// The OpenGL in use: `"egl, VENDOR, RENDERER, VERSION"`.
    pub fn gl(&self) -> &str {
        // SAFETY: the text belongs to the renderer.
        unsafe { borrowed(sys::mjenv_renderer_gl(self.raw.as_ptr())) }
    }

    /// The colours of a row. Errors: [`ErrorKind::Value`](crate::ErrorKind::Value) (row),
    /// [`ErrorKind::State`](crate::ErrorKind::State), [`ErrorKind::Render`](crate::ErrorKind::Render),
    /// [`ErrorKind::Busy`](crate::ErrorKind::Busy).
    pub fn render(&mut self, row: usize) -> Result<Image<[u8; 3]>> {
        let mut colours = Image::new(self.width, self.height);
        self.draw(row, Some(&mut colours), None)?;
        Ok(colours)
    }

    /// The depth buffer of a row, 0 (near) to 1 (far). Errors: as [`Renderer::render`].
    pub fn render_depth(&mut self, row: usize) -> Result<Image<f32>> {
        let mut depth = Image::new(self.width, self.height);
        self.draw(row, None, Some(&mut depth))?;
        Ok(depth)
    }

    /// Both, drawn once. Errors: as [`Renderer::render`].
    pub fn render_both(&mut self, row: usize) -> Result<(Image<[u8; 3]>, Image<f32>)> {
        let (mut colours, mut depth) = (Image::new(self.width, self.height), Image::new(self.width, self.height));
        self.draw(row, Some(&mut colours), Some(&mut depth))?;
        Ok((colours, depth))
    }

    fn draw(&mut self, row: usize, rgb: Option<&mut Image<[u8; 3]>>, depth: Option<&mut Image<f32>>) -> Result<()> {
        let (rgb, bytes) =
            rgb.map_or((ptr::null_mut(), 0), |image| (image.pixels.as_mut_ptr(), 3 * image.pixels.len()));
        let (depth, count) =
            depth.map_or((ptr::null_mut(), 0), |image| (image.pixels.as_mut_ptr(), image.pixels.len()));
        // SAFETY: the handle is alive, the buffers have the lengths given.
        check(unsafe { sys::mjenv_render(self.raw.as_ptr(), int64(row), rgb.cast(), bytes, depth, count) })
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        // SAFETY: the handle is alive and owned.
        unsafe { sys::mjenv_renderer_destroy(self.raw.as_ptr()) }
    }
}

impl fmt::Debug for Renderer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut debug = formatter.debug_struct("Renderer");
        debug.field("width", &self.width).field("height", &self.height).field("gl", &self.gl()).finish()
    }
}

/// Shows rows on a display, as Gymnasium's render mode "human" does: to be drawn after every reset and step, on the
/// main thread. The keys stand in the window; Escape closes it.
pub struct Window {
    raw: NonNull<sys::mjenv_window>,
}

impl Window {
    /// Opens a window. Its camera is always free. Errors: [`ErrorKind::Value`](crate::ErrorKind::Value),
    /// [`ErrorKind::Render`](crate::ErrorKind::Render), [`ErrorKind::Memory`](crate::ErrorKind::Memory).
    pub fn new(env: &Env, settings: &RenderSettings) -> Result<Self> {
        let mut raw = ptr::null_mut();
        settings.with_raw(|settings| {
            // SAFETY: all pointers are valid for the call, which only reads the environment.
            check(unsafe { sys::mjenv_window_create(env.raw(), settings, &mut raw) })
        })?;
        Ok(Self { raw: NonNull::new(raw).expect("libmjenv opens a window or fails") })
    }

    /// Whether the user has not closed it.
    pub fn is_open(&self) -> bool {
        // SAFETY: the handle is alive.
        unsafe { sys::mjenv_window_is_open(self.raw.as_ptr()) != 0 }
    }

    /// Draws a row, for as long as the user pauses; nothing once the window is closed. Errors: as [`Renderer::render`].
    pub fn draw(&mut self, row: usize) -> Result<()> {
        // SAFETY: the handle is alive.
        check(unsafe { sys::mjenv_window_draw(self.raw.as_ptr(), int64(row)) })
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        // SAFETY: the handle is alive and owned.
        unsafe { sys::mjenv_window_destroy(self.raw.as_ptr()) }
    }
}

impl fmt::Debug for Window {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Window").field("open", &self.is_open()).finish()
    }
}

impl Env {
    /// Gymnasium's defaults for pictures of this environment.
    pub fn render_settings(&self) -> RenderSettings {
        RenderSettings::of(self)
    }
}

use std::ffi::CString;
use std::ptr::{self, NonNull};

use mjenv_sys as sys;

use crate::describe::{int64, size_of};
use crate::error::{call, owned, Result};
use crate::text::{borrowed, c_string};
use crate::Env;

/// Which library provides OpenGL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum Gl {
    /// The one that the environment variable `MUJOCO_GL` names. Without that variable, the first of EGL, GLFW and
    /// OSMesa that works.
    #[default]
    Auto = sys::MJENV_GL_AUTO,
    /// EGL, which needs no display. Debian's packages are libegl1 and libgl1-mesa-dri.
    Egl = sys::MJENV_GL_EGL,
    /// OSMesa, which needs neither a display nor a graphics driver. Debian's package is libosmesa6. A process that uses
    /// it cannot use the others.
    OsMesa = sys::MJENV_GL_OSMESA,
    /// GLFW, with an invisible window on a display. Debian's package is libglfw3. Create the renderer on the main
    /// thread.
    Glfw = sys::MJENV_GL_GLFW,
}

/// The camera of a picture.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Camera {
    /// The free camera, which stands where the settings place it.
    #[default]
    Free,
    /// A camera of the model by its index.
    Index(i32),
    /// A camera of the model by its name.
    Name(String),
}

/// Which objects have labels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[allow(missing_docs)] // the names are those of MuJoCo's mjtLabel
#[repr(i32)]
pub enum Label {
    #[default]
    None = sys::MJENV_LABEL_NONE,
    Body = sys::MJENV_LABEL_BODY,
    Joint = sys::MJENV_LABEL_JOINT,
    Geom = sys::MJENV_LABEL_GEOM,
    Site = sys::MJENV_LABEL_SITE,
    Camera = sys::MJENV_LABEL_CAMERA,
    Light = sys::MJENV_LABEL_LIGHT,
    Tendon = sys::MJENV_LABEL_TENDON,
    Actuator = sys::MJENV_LABEL_ACTUATOR,
    Constraint = sys::MJENV_LABEL_CONSTRAINT,
    Skin = sys::MJENV_LABEL_SKIN,
    Selection = sys::MJENV_LABEL_SELECTION,
    SelectionPoint = sys::MJENV_LABEL_SELPNT,
    ContactForce = sys::MJENV_LABEL_CONTACTFORCE,
}

/// Of which objects the frames are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[allow(missing_docs)] // the names are those of MuJoCo's mjtFrame
#[repr(i32)]
pub enum Frame {
    #[default]
    None = sys::MJENV_FRAME_NONE,
    Body = sys::MJENV_FRAME_BODY,
    Geom = sys::MJENV_FRAME_GEOM,
    Site = sys::MJENV_FRAME_SITE,
    Camera = sys::MJENV_FRAME_CAMERA,
    Light = sys::MJENV_FRAME_LIGHT,
    Contact = sys::MJENV_FRAME_CONTACT,
    World = sys::MJENV_FRAME_WORLD,
}

/// How pictures are drawn. The fields are Gymnasium's arguments of the same names; [`Env::render_settings`] returns
/// Gymnasium's defaults.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RenderSettings {
    /// Which library provides OpenGL.
    pub gl: Gl,
    /// The width in pixels.
    pub width: usize,
    /// The height in pixels.
    pub height: usize,
    /// The camera.
    pub camera: Camera,
    /// How many geoms are drawn at most.
    pub max_geom: i32,
    /// How many samples are taken for each pixel; 0 means no multisampling.
    pub samples: i32,
    /// Whether shadows are drawn.
    pub shadows: bool,
    /// Whether reflections are drawn.
    pub reflections: bool,
    /// The point that the free camera looks at, in m. `None` is the median of the geoms' positions in the first
    /// picture.
    pub lookat: Option<[f64; 3]>,
    /// The distance of the free camera from that point, in m. `None` is the model's extent.
    pub distance: Option<f64>,
    /// The azimuth of the free camera, in degrees. `None` is 90.
    pub azimuth: Option<f64>,
    /// The elevation of the free camera, in degrees. `None` is -45.
    pub elevation: Option<f64>,
    /// What is visible beside the geoms: Gymnasium's visual_options, indexed by MuJoCo's mjtVisFlag.
    pub visual: [bool; RenderSettings::VISUAL_FLAGS],
    /// Which groups of geoms are drawn: mjvOption's `geomgroup`.
    pub geomgroup: [bool; RenderSettings::GROUPS],
    /// Which groups of sites are drawn: mjvOption's `sitegroup`.
    pub sitegroup: [bool; RenderSettings::GROUPS],
    /// Which groups of joints are drawn: mjvOption's `jointgroup`.
    pub jointgroup: [bool; RenderSettings::GROUPS],
    /// Which groups of tendons are drawn: mjvOption's `tendongroup`.
    pub tendongroup: [bool; RenderSettings::GROUPS],
    /// Which groups of actuators are drawn: mjvOption's `actuatorgroup`.
    pub actuatorgroup: [bool; RenderSettings::GROUPS],
    /// Which groups of skins are drawn: mjvOption's `skingroup`.
    pub skingroup: [bool; RenderSettings::GROUPS],
    /// Which objects have labels.
    pub label: Label,
    /// Of which objects the frames are drawn.
    pub frame: Frame,
    /// Whether only the edges are drawn.
    pub wireframe: bool,
    /// Whether transparent colours are added up.
    pub additive: bool,
    /// Whether the sky is drawn.
    pub skybox: bool,
    /// Whether there is fog.
    pub fog: bool,
    /// Whether infinite planes fade into haze.
    pub haze: bool,
    /// Whether the backs of faces are left out.
    pub cull_face: bool,
}

impl RenderSettings {
    /// The length of `visual`.
    pub const VISUAL_FLAGS: usize = sys::MJENV_VISUAL_SKIN as usize + 1;
    /// How many groups MuJoCo has: models put each object in one of them, and the groups 0 to 2 are drawn by default.
    pub const GROUPS: usize = 6;

    /// Returns the settings with another size, in pixels.
    #[must_use]
    pub fn size(mut self, width: usize, height: usize) -> Self {
        (self.width, self.height) = (width, height);
        self
    }

    /// Returns the settings with another camera.
    #[must_use]
    pub fn camera(mut self, camera: Camera) -> Self {
        self.camera = camera;
        self
    }

    /// Returns the settings without multisampling and shadows. Drawing is several times as fast, and the pixels differ
    /// from Gymnasium's.
    #[must_use]
    pub fn fast(mut self) -> Self {
        (self.samples, self.shadows) = (0, false);
        self
    }

    /// Passes the settings to `body` as C's struct.
    fn with_raw<T>(&self, body: impl FnOnce(*const sys::mjenv_render_settings) -> Result<T>) -> Result<T> {
        let name: CString;
        let mut raw = empty();
        raw.gl = self.gl as i32;
        raw.width = i32::try_from(self.width).unwrap_or(i32::MAX);
        raw.height = i32::try_from(self.height).unwrap_or(i32::MAX);
        (raw.max_geom, raw.samples) = (self.max_geom, self.samples);
        raw.lookat = self.lookat.unwrap_or([f64::NAN; 3]);
        [raw.distance, raw.azimuth, raw.elevation] =
            [self.distance, self.azimuth, self.elevation].map(|value| value.unwrap_or(f64::NAN));
        (raw.label, raw.frame) = (self.label as i32, self.frame as i32);
        self.copy_flags(&mut raw);
        raw.camera = match &self.camera {
            Camera::Free => sys::MJENV_CAMERA_FREE,
            // The library gives -1 a meaning, which this enum has a name for.
            Camera::Index(index) if *index < 0 => i32::MIN,
            Camera::Index(index) => *index,
            Camera::Name(text) => {
                name = c_string(format_args!("camera {text:?}"), text)?;
                raw.camera_name = name.as_ptr();
                sys::MJENV_CAMERA_FREE
            }
        };
        body(&raw)
    }
}

/// Converts settings from and to C's struct, with these switches and groups.
macro_rules! conversions {
    ($($switch:ident)*; $($group:ident)*) => {
        impl RenderSettings {
            fn from_raw(raw: &sys::mjenv_render_settings) -> Self {
                let given = |value: f64| Some(value).filter(|value| !value.is_nan());
                let mut visual = [false; Self::VISUAL_FLAGS];
                visual.iter_mut().zip(raw.visual).for_each(|(flag, value)| *flag = value != 0);
                Self {
                    gl: Gl::Auto,
                    width: raw.width as usize,
                    height: raw.height as usize,
                    camera: Camera::Free,
                    max_geom: raw.max_geom,
                    samples: raw.samples,
                    lookat: Some(raw.lookat).filter(|lookat| !lookat[0].is_nan()),
                    distance: given(raw.distance),
                    azimuth: given(raw.azimuth),
                    elevation: given(raw.elevation),
                    visual,
                    label: Label::None,
                    frame: Frame::None,
                    $($switch: raw.$switch != 0,)*
                    $($group: raw.$group.map(|value| value != 0),)*
                }
            }

            fn copy_flags(&self, raw: &mut sys::mjenv_render_settings) {
                raw.visual.iter_mut().zip(self.visual).for_each(|(value, flag)| *value = flag.into());
                $(raw.$switch = self.$switch.into();)*
                $(raw.$group = self.$group.map(u8::from);)*
            }
        }
    };
}

conversions! {
    shadows reflections wireframe additive skybox fog haze cull_face;
    geomgroup sitegroup jointgroup tendongroup actuatorgroup skingroup
}

fn empty() -> sys::mjenv_render_settings {
    sys::mjenv_render_settings { struct_size: size_of::<sys::mjenv_render_settings>(), ..Default::default() }
}

/// A picture. Its pixels are stored line by line from the top, each line from the left.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image<T> {
    width: usize,
    pixels: Vec<T>,
}

impl<T: Copy + Default> Image<T> {
    fn new(width: usize, height: usize) -> Self {
        Self { width, pixels: vec![T::default(); width * height] }
    }

    methods! {
        self;
        /// Returns the width in pixels.
        width() -> usize { self.width }
        /// Returns the height in pixels.
        height() -> usize { self.pixels.len() / self.width }
        /// Returns all pixels, line by line: `[height][width]`.
        pixels() -> &[T] { &self.pixels }
    }

    /// Returns the pixel in column `x` of line `y`. Panics if the pixel is outside of the picture.
    pub fn get(&self, x: usize, y: usize) -> T {
        assert!(x < self.width, "column {x} is outside 0..{}", self.width);
        self.pixels[y * self.width + x]
    }
}

impl Image<[u8; 3]> {
    /// Returns red, green and blue of all pixels, line by line, as image crates take them: `[height][width][3]`.
    pub fn into_bytes(self) -> Vec<u8> {
        self.pixels.into_iter().flatten().collect()
    }
}

/// Draws pictures of an environment's rows. They equal Gymnasium's pixel for pixel if both use the same OpenGL on the
/// same machine.
///
/// Drawing reads the environment and does not change it. A renderer may be used on another thread than the environment,
/// and several renderers of one environment may draw at the same time. While a thread is using the environment, drawing
/// returns [`ErrorKind::Busy`](crate::ErrorKind::Busy). A renderer may be dropped before or after its environment.
#[derive(Debug)]
pub struct Renderer {
    raw: NonNull<sys::mjenv_renderer>,
    width: usize,
    height: usize,
}

// SAFETY: the library draws on any thread and makes its OpenGL context current only during a call.
unsafe impl Send for Renderer {}

impl Renderer {
    /// Builds a renderer. Errors: `ErrorKind::Value`, `ErrorKind::Name` (the camera), `ErrorKind::Render`,
    /// `ErrorKind::Memory`.
    pub fn new(env: &Env, settings: &RenderSettings) -> Result<Self> {
        let mut raw = ptr::null_mut();
        settings.with_raw(|settings| call!(env.mjenv_renderer_create(settings, &mut raw)))?;
        let raw = NonNull::new(raw).expect("libmjenv creates a renderer or fails");
        Ok(Self { raw, width: settings.width, height: settings.height })
    }

    /// Returns the OpenGL in use: `"egl, VENDOR, RENDERER, VERSION"`.
    pub fn gl(&self) -> &str {
        // SAFETY: the text belongs to the renderer.
        unsafe { borrowed(sys::mjenv_renderer_gl(self.raw.as_ptr())) }
    }

    /// Draws a row and returns its colours, red, green and blue. Errors: `ErrorKind::Value` (there is no such row),
    /// `ErrorKind::NotReset` (the row was never reset), `ErrorKind::Argument` (the environment was dropped),
    /// `ErrorKind::Render`, `ErrorKind::Busy`.
    pub fn render(&mut self, row: usize) -> Result<Image<[u8; 3]>> {
        let mut colours = Image::new(self.width, self.height);
        self.draw(row, Some(&mut colours), None)?;
        Ok(colours)
    }

    /// Draws a row and returns its depth buffer, from 0 (near) to 1 (far). Errors: those of [`Renderer::render`].
    pub fn render_depth(&mut self, row: usize) -> Result<Image<f32>> {
        let mut depth = Image::new(self.width, self.height);
        self.draw(row, None, Some(&mut depth))?;
        Ok(depth)
    }

    /// Draws a row once, and returns its colours and its depth buffer. Errors: those of [`Renderer::render`].
    pub fn render_both(&mut self, row: usize) -> Result<(Image<[u8; 3]>, Image<f32>)> {
        let (mut colours, mut depth) = (Image::new(self.width, self.height), Image::new(self.width, self.height));
        self.draw(row, Some(&mut colours), Some(&mut depth))?;
        Ok((colours, depth))
    }

    /// Draws which object each pixel shows: its index in the model and its type, MuJoCo's mjtObj; -1 and -1 where
    /// nothing is. Errors: those of [`Renderer::render`].
    pub fn render_segmentation(&mut self, row: usize) -> Result<Image<[i32; 2]>> {
        let mut objects = Image::<[i32; 2]>::new(self.width, self.height);
        let (pixels, count) = (objects.pixels.as_mut_ptr(), int64(2 * objects.pixels.len()));
        call!(self.mjenv_render_segmentation(int64(row), pixels.cast(), count))?;
        Ok(objects)
    }

    fn draw(&mut self, row: usize, rgb: Option<&mut Image<[u8; 3]>>, depth: Option<&mut Image<f32>>) -> Result<()> {
        fn parts<T, const N: i64>(image: Option<&mut Image<T>>) -> (*mut T, i64) {
            image.map_or((ptr::null_mut(), 0), |image| (image.pixels.as_mut_ptr(), N * int64(image.pixels.len())))
        }
        let ((rgb, bytes), (depth, count)) = (parts::<_, 3>(rgb), parts::<_, 1>(depth));
        call!(self.mjenv_render(int64(row), rgb.cast(), bytes, depth, count))
    }
}

/// A window that shows a row, as Gymnasium's render mode "human" does. Call [`Window::draw`] after every reset and
/// step, on the main thread. The window lists its keys; Escape closes it.
#[derive(Debug)]
pub struct Window {
    raw: NonNull<sys::mjenv_window>,
}

impl Window {
    /// Opens a window. It always has the free camera. Errors: `ErrorKind::Value`, `ErrorKind::Render`,
    /// `ErrorKind::Memory`.
    pub fn new(env: &Env, settings: &RenderSettings) -> Result<Self> {
        let mut raw = ptr::null_mut();
        settings.with_raw(|settings| call!(env.mjenv_window_create(settings, &mut raw)))?;
        Ok(Self { raw: NonNull::new(raw).expect("libmjenv opens a window or fails") })
    }

    /// Returns whether the window is open: false once the user has closed it.
    pub fn is_open(&self) -> bool {
        // SAFETY: the handle is alive.
        unsafe { sys::mjenv_window_is_open(self.raw.as_ptr()) != 0 }
    }

    /// Draws a row. While the user pauses, it keeps drawing and does not return. It draws nothing once the window is
    /// closed. Errors: those of [`Renderer::render`].
    pub fn draw(&mut self, row: usize) -> Result<()> {
        call!(self.mjenv_window_draw(int64(row)))
    }
}

owned! {
    Renderer: mjenv_renderer, mjenv_renderer_destroy;
    Window: mjenv_window, mjenv_window_destroy;
}

impl Env {
    /// Returns Gymnasium's settings for pictures of this environment.
    pub fn render_settings(&self) -> RenderSettings {
        let mut raw = empty();
        call!(self.mjenv_render_defaults(&mut raw)).expect("an environment has default settings");
        RenderSettings::from_raw(&raw)
    }
}

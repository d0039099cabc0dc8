//! The settings of a render, whether they fit a scene, and the rules that are in effect by them.

use std::num::NonZeroUsize;

use super::catchers;
use super::passes::Passes;
use crate::accel::SimdLevel;
use crate::describe::words;
use crate::image::{Buffer, Plane, Window};
use crate::light::Light;
use crate::scene::Scene;

words! {
    /// How the edges of what a pixel holds are smoothed.
    pub enum AaMode {
        /// All n x n camera rays say what is seen; light is taken once for each surface in a pixel where it is shown to
        /// bend little over it. Where all area lights are sampled, and there are meshes, point sets or instances, that
        /// takes longer than [`Full`](Self::Full), whose picture it is then.
        Adaptive = "adaptive",
        /// Each of the n x n camera rays is lit by itself.
        Full = "full",
        /// All n x n camera rays say what is seen; each smooth part of a surface in a pixel is looked up and lit at one
        /// of them, as by multisampling on graphics processors. Shadows that are narrower than a pixel show steps. Of
        /// more than 16 lights that is [`Adaptive`](Self::Adaptive).
        Multisample = "multisample",
    }
}

words! {
    /// How it is found out how much of a light reaches a point.
    pub enum VisibilityMode {
        /// What may stand before a light is gathered once for many points; where nothing does, nothing is traced.
        Shafts = "shafts",
        /// Every sample of every light for itself, at every camera ray: the bits of the plain renderer. Lights that are
        /// integrated are sampled, and [`AaMode`] has no effect.
        Traced = "traced",
    }
}

/// The settings of a render. Pixels depend only on `crop`, which chooses a part of the picture, and on the rules
/// `aa_mode`, `visibility` and `reference`.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Threads to render with; all processors if `None`.
    pub threads: Option<NonZeroUsize>,
    /// Side of the square tiles that threads take turns at, in pixels, [`MIN_TILE`](Self::MIN_TILE) to
    /// [`MAX_TILE`](Self::MAX_TILE).
    pub tile_size: u32,
    /// The instruction set.
    pub simd: SimdLevel,
    /// The part of the film to render; all of it if `None`.
    pub crop: Option<Window>,
    /// How edges are smoothed, where lights are not traced sample by sample.
    pub aa_mode: AaMode,
    /// Renders with the plain code that is the specification: all lights are sampled, and each camera ray is lit by
    /// itself.
    pub reference: bool,
    /// How shadows are found.
    pub visibility: VisibilityMode,
    /// The planes of the film; [`Plane::Color`] alone by default. Those that the scene's text lists are
    /// [`Scene::buffers`], and are rendered where they are given here: `buffers: scene.buffers().to_vec()`. Without
    /// planes that need light, no light is evaluated.
    pub buffers: Vec<Buffer>,
}

impl RenderSettings {
    /// The smallest tile.
    pub const MIN_TILE: u32 = 8;
    /// The largest tile.
    pub const MAX_TILE: u32 = 64;

    /// Whether these settings fit the scene and the machine.
    ///
    /// # Errors
    /// What does not fit, with the value and what is allowed.
    pub fn check(&self, scene: &Scene) -> Result<(), String> {
        let (min, max) = (Self::MIN_TILE, Self::MAX_TILE);
        if !(min..=max).contains(&self.tile_size) {
            return Err(format!("tile size {} is outside {min} to {max}", self.tile_size));
        }
        if let Some(fault) = scene.fault_of(&self.buffers) {
            return Err(format!("buffers: {fault}"));
        }
        if !self.simd.is_available() {
            let names: Vec<_> = SimdLevel::available().iter().map(|level| level.name()).collect();
            return Err(format!("this processor has no {}; it has {}", self.simd.name(), names.join(", ")));
        }
        if let Some(w) = self.crop {
            let fits = |start: u32, length: u32, all: u32| length > 0 && start as u64 + length as u64 <= all as u64;
            if !(fits(w.x, w.width, scene.width) && fits(w.y, w.height, scene.height)) {
                return Err(format!(
                    "the part {},{},{},{} (x, y, width, height) does not lie inside the picture of {} x {} pixels",
                    w.x, w.y, w.width, w.height, scene.width, scene.height
                ));
            }
        }
        let Window { width, height, .. } = self.window(scene);
        let pixels = width as u64 * height as u64;
        if pixels > MAX_PIXELS {
            return Err(format!(
                "{width} x {height} are {pixels} pixels, and at most {MAX_PIXELS} are rendered at once; render parts \
                 of the picture, each with --crop X,Y,WIDTH,HEIGHT"
            ));
        }
        Ok(())
    }

    /// Whether there is memory for the film, and for the largest file that can be made of it, an archive of arrays. For
    /// settings that [`check`](Self::check) has passed.
    ///
    /// # Errors
    /// How much it takes, and what to do.
    pub fn check_memory(&self, scene: &Scene) -> Result<(), String> {
        if self.renderer().samples_all() {
            let points = |light: &Light| if light.exact { light.samples() as u64 } else { 0 };
            let points: u64 = scene.lights.iter().map(points).sum();
            if points > MAX_POINTS {
                return Err(format!(
                    "sampled, the lights that are integrated have {points} points together, the limit is {MAX_POINTS}; \
                     give them fewer with --samples"
                ));
            }
        }
        let both = self.film_bytes(scene);
        let fault = || {
            let Window { width, height, .. } = self.window(scene);
            format!("{width} x {height} pixels take {both} bytes, more than there is; render parts with a crop")
        };
        let bytes = usize::try_from(both).map_err(|_| fault())?;
        Vec::<u8>::new().try_reserve_exact(bytes).map_err(|_| fault())
    }

    /// Bytes of the film, and of the largest file that can be made of it. For settings that [`check`](Self::check) has
    /// passed.
    pub fn film_bytes(&self, scene: &Scene) -> u64 {
        let window = self.window(scene);
        let bytes = |buffers: &[Buffer]| buffers.iter().map(|buffer| buffer.plane().bytes()).sum::<usize>();
        let Passes { mut picture, unshadowed } = Passes::of(scene, &self.buffers);
        if scene.catchers.is_some() {
            // Those in front of black catchers, and the light on catchers with and without shadows
            picture.extend(catchers::changed(&picture));
            picture.extend([Plane::Ambient, Plane::Diffuse, Plane::Diffuse].map(Buffer::from));
        }
        // The films of the passes are in memory while the buffers are computed from them
        let pixel = bytes(&self.buffers).max((bytes(&picture) + bytes(&unshadowed) + bytes(&self.buffers)).div_ceil(2));
        2 * u64::from(window.width) * u64::from(window.height) * pixel as u64
    }

    /// The rules by which these settings render a scene.
    pub(crate) fn renderer_of(&self, scene: &Scene) -> Renderer {
        let areas = || scene.lights.iter().filter(|light| light.area().is_some());
        match self.renderer() {
            // With BVHs in the scene, testing whether rays may share sampled light takes longer than shading each ray
            Renderer::Adaptive
                if scene.geometry.has_trees() && areas().next().is_some() && areas().all(|light| !light.exact) =>
            {
                Renderer::Full
            }
            renderer => renderer,
        }
    }

    /// The rules by which these settings render, independent of the scene.
    pub(crate) fn renderer(&self) -> Renderer {
        match (self.reference, self.visibility, self.aa_mode) {
            (true, ..) => Renderer::Reference,
            (false, VisibilityMode::Traced, _) => Renderer::Traced,
            (false, VisibilityMode::Shafts, AaMode::Full) => Renderer::Full,
            (false, VisibilityMode::Shafts, AaMode::Adaptive) => Renderer::Adaptive,
            (false, VisibilityMode::Shafts, AaMode::Multisample) => Renderer::Multisample,
        }
    }

    /// The part of the film to render.
    pub(crate) fn window(&self, scene: &Scene) -> Window {
        self.crop.unwrap_or(Window { x: 0, y: 0, width: scene.width, height: scene.height })
    }
}

/// The rules by which a picture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Renderer {
    /// The plain code, which is the specification.
    Reference,
    /// Sixteen samples at once, all of them traced: its bits.
    Traced,
    /// Each camera ray is lit by itself. Its bits where lights are sampled; others are integrated.
    Full,
    /// Each surface is lit as often as it needs.
    Adaptive,
    /// Each smooth part of a surface in a pixel is lit once.
    Multisample,
}

impl Renderer {
    /// Whether all lights are sampled at every camera ray, also those that are to be integrated.
    pub fn samples_all(self) -> bool {
        matches!(self, Renderer::Reference | Renderer::Traced)
    }

    /// How edges are smoothed.
    pub fn aa_mode(self) -> AaMode {
        match self {
            Renderer::Adaptive => AaMode::Adaptive,
            Renderer::Multisample => AaMode::Multisample,
            Renderer::Reference | Renderer::Traced | Renderer::Full => AaMode::Full,
        }
    }
}

impl Default for RenderSettings {
    fn default() -> Self {
        RenderSettings {
            threads: None,
            tile_size: 16,
            simd: SimdLevel::Auto,
            crop: None,
            aa_mode: AaMode::Adaptive,
            visibility: VisibilityMode::Shafts,
            reference: false,
            buffers: vec![Plane::Color.into()],
        }
    }
}

/// The most pixels that are rendered at once; the whole picture may have more.
const MAX_PIXELS: u64 = 1 << 27;

/// The most points of all lights that are integrated, where they are sampled all the same: 12 bytes each, on spheres
/// 24, and as much for shafts.
const MAX_POINTS: u64 = 1 << 26;

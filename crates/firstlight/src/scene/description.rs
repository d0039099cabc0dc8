//! A scene as it may be said, in text or in code: nothing resolved, nothing checked.

use super::motion::MotionTo;
use crate::camera::CameraDesc;
use crate::describe::{ColorDesc, FilePath, SamplesDesc, table, words};
use crate::image::{BufferDesc, Plane};
use crate::light::LightDesc;
use crate::material::{AmbientDesc, MaterialDesc};
use crate::shape::{GroupDesc, ShadowTerminator, ShapeDesc};
use crate::texture::TextureDesc;

words! {
    /// How linear light becomes the numbers of an 8- or 16-bit picture.
    pub enum DisplayEncoding {
        /// The sRGB curve (IEC 61966-2-1).
        Srgb = "srgb",
        /// The power 1 / `gamma`.
        Gamma = "gamma",
        /// As it is.
        Linear = "linear",
        /// The PBR Neutral tone mapper of Khronos, then the sRGB curve: base colours as they are, highlights above 0.8
        /// compressed.
        Neutral = "neutral",
    }
}

/// What is done with area lights in a scene that does not say it.
const DEFAULT_SAMPLES: SamplesDesc = SamplesDesc::Exact;

table! {
    /// The picture: `[render]`.
    ///
    /// ```toml
    /// [render]
    /// width = 1024
    /// height = 1024
    /// antialiasing = 4
    /// ```
    pub struct RenderDesc {
        /// Pixels across, 1 to 65536. Of a picture of more than 134217728 pixels only parts can be rendered, with
        /// `--crop`.
        pub width: u32 = 1024,
        /// Pixels down, 1 to 65536.
        pub height: u32 = 1024,
        /// n of the n x n camera rays in each pixel, 1 to 64; 4 is "4X".
        pub antialiasing: u32 = 4,
        /// What is done with each area light that does not say its own: `"exact"`, it is integrated, or the number of
        /// points that it is sampled at, 1 to 1048576.
        pub samples: SamplesDesc = DEFAULT_SAMPLES,
        /// How far a pixel may be off the converged picture, 0.25 to 16, in display steps: 1/255 of what is displayed.
        /// 99.9 % of pixels are within it, and of 99 scenes in 100 all within twice as much. More is faster, as 4 for a
        /// preview. Sampled lights under `--aa-mode full` know no tolerance.
        pub tolerance: f64 = 1.0,
        /// What is made of the border of light and dark on meshes with smooth normals.
        pub shadow_terminator: ShadowTerminator = ShadowTerminator::Smooth,
        /// The camera's name, where there are several; without it, the first.
        pub camera: Option<String> = None,
        /// What no surface covers.
        pub background: ColorDesc = ColorDesc::BLACK,
        /// Leaves what no surface covers transparent, instead of `background`.
        pub transparent: bool = false,
        /// Light from everywhere: added once, times each material's `ambient`.
        pub ambient: AmbientDesc = AmbientDesc::Uniform(ColorDesc::BLACK),
        /// How linear light becomes the numbers of an 8- or 16-bit picture.
        pub display: DisplayEncoding = DisplayEncoding::Srgb,
        /// The gamma of `display = "gamma"`, 0.1 to 10.
        pub gamma: f64 = 2.2,
        /// In stops: 8- and 16-bit pictures are multiplied by 2^exposure, from -64 to 64.
        pub exposure: f64 = 0.0,
        /// What files that hold more than a picture, .exr and .npz, are given of each pixel.
        pub buffers: Vec<BufferDesc> = vec![BufferDesc::Plane(Plane::Color)],
        /// Whereto the buffer `motion` leads: another moment, in seconds from -1e9 to 1e9; `"next"` or `"previous"`,
        /// the frame after or before this one; or another camera, by its name, at the same moment.
        pub motion_to: Option<MotionTo> = None,
        /// Frames in a second, 0.001 to 1000000: frame number n of `--frames` is the moment n / fps. Without keys it is
        /// of no account.
        pub fps: f64 = 24.0,
    }
}

/// A whole scene, as text says it or as code builds it.
///
/// Names are unique within cameras, within materials and within textures, whatever their kind.
/// Shapes and lights are given ids in scene order: kinds in the order of their enums, then the order of these lists.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneDesc {
    /// `[render]`
    pub render: RenderDesc,
    /// `[camera]` (its name is empty) or `[camera.NAME]`, in the order of the text.
    pub cameras: Vec<(String, CameraDesc)>,
    /// `[texture.KIND.NAME]`
    pub textures: Vec<(String, TextureDesc)>,
    /// `[material.KIND.NAME]`
    pub materials: Vec<(String, MaterialDesc)>,
    /// `[[sphere]]`, `[[mesh]]` and so on.
    pub shapes: Vec<ShapeDesc>,
    /// `[group.NAME]`, in the order of the text.
    pub groups: Vec<(String, GroupDesc)>,
    /// `[[light.KIND]]`
    pub lights: Vec<LightDesc>,
}

impl SceneDesc {
    /// The names of all files that it reads when it is compiled: pictures, meshes, point sets, models. Models may name
    /// further ones themselves.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut FilePath> {
        let pictures = self.textures.iter_mut().filter_map(|(_, texture)| match texture {
            TextureDesc::Image(image) => Some(&mut image.file),
            TextureDesc::Checkerboard(_) | TextureDesc::UvGrid(_) => None,
        });
        let grouped = self.groups.iter_mut().flat_map(|(_, group)| &mut group.shapes);
        let models = self.shapes.iter_mut().chain(grouped).filter_map(|shape| match shape {
            ShapeDesc::Mesh(mesh) => mesh.file.as_mut(),
            ShapeDesc::PointSet(points) => points.file.as_mut(),
            ShapeDesc::Model(model) => Some(&mut model.file),
            _ => None,
        });
        pictures.chain(models)
    }
}

//! Direct light, without noise, with the same bits on every machine.
//!
//! A ray from the camera, the first surface it meets, rays from there to every light: that, and nothing after it.
//! A scene is said as text or built in code ([`SceneDesc`]), checked and made ready ([`Scene`]), rendered ([`render`])
//! and developed into a picture ([`Image`]).
//!
//! ```
//! use firstlight::{CompileOptions, Format, NoAssets, RenderSettings, SceneDesc, render_image};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let text = r#"
//!     [render]
//!     width = 32
//!     height = 24
//!     [camera]
//!     position = [0, 0, 5]
//!     [[sphere]]
//!     center = [0, 0, 0]
//!     radius = 1
//!     [[light.directional]]
//!     direction = [-1, -1, -1]
//! "#;
//! // Every fault of the text comes at once, with its place
//! let parsed = SceneDesc::parse("ball.toml", text.as_bytes(), &NoAssets);
//! let scene = parsed.compile(&NoAssets, &CompileOptions::default())?.scene;
//! // Rendering cannot fail
//! let image = render_image(&scene);
//! // Linear Rec. 709, red, green, blue, alpha: the middle of the ball is lit, the corner is not
//! assert!(image.pixels[12 * 32 + 16][0] > 0.1);
//! assert_eq!(image.pixels[0], [0.0, 0.0, 0.0, 1.0]);
//! let receipt = scene.receipt(&RenderSettings::default());
//! let png = image.encode(Format::Png8, &scene.display(), &receipt)?;
//! assert!(png.starts_with(b"\x89PNG"));
//! # Ok(())
//! # }
//! ```
//!
//! - What a scene may say: [`SceneDesc`] and the `*Desc` types; [`reference()`] writes the manual of the text.
//! - Rendering with settings, with progress, and stopped early: [`render`].
//! - What a ray sees, without a picture: [`Scene::intersect`] and [`Scene::look`]; whether light gets through:
//!   [`Scene::shadow_rays`] and [`Scene::occluded`].
//! - The same scene from many places: [`Scene::with_camera`].
//! - Where files come from: [`Assets`].
//! - Faults, as data: [`SceneError`], [`Diagnostic`], [`ImageError`]. The library never prints and never exits.
//! - It needs unwinding: the decoders of pictures belong to others, and a panic of one on a damaged file is caught and
//!   becomes [`ImageError::Damaged`]. With `panic = "abort"` it ends the program. The library sets no panic hook; one
//!   that is to be silent about these asks [`is_decoding`].
//!
//! Whole programs are in the folder `examples`.

// What can be reached from outside can be named there
#![warn(unnameable_types)]

mod accel;
#[cfg(feature = "bench")]
#[doc(hidden)]
pub mod bench;
mod camera;
mod color;
mod context;
mod describe;
mod error;
mod film;
mod ids;
mod image;
mod import;
mod integrate;
mod light;
mod material;
mod math;
mod model;
mod parallel;
mod render;
mod scene;
mod shape;
mod texture;
mod transform;
mod visibility;

pub use accel::SimdLevel;
pub use camera::{Camera, CameraDesc, FilmPlane, Frame, Orthographic, Pinhole, Projection};
pub use color::{Display, Encoding, Rgb, ToneMapping};
pub use context::{AssetError, Assets, CompileStage, FolderAssets, MemoryAssets, NoAssets, OnCompile};
pub use describe::nearest_name;
pub use describe::{Channel, ColorDesc, ColorParam, FilePath, NameMap, NumberParam, ParamDesc, SamplesDesc, ScaleDesc};
pub use error::{Diagnostic, Place, SceneError, Severity, printable};
pub use film::{
    AaMode, Coco, Film, Heat, LightChange, Mask, ObjectMasks, ReceiptFault, ReceiptSettings, RelightError, Relit,
    RenderSettings, VisibilityMode, relight,
};
pub use ids::{LightGroupId, LightId, MaterialId, SurfaceId, TextureId};
pub use image::{
    Buffer, BufferDesc, BufferView, DifferingSample, Distance, FileSettings, Flip, Format, Image, ImageError,
    LightChoice, LightPart, NamedPlane, PendingFile, Plane, PlaneDifference, PlaneNumbers, PlaneVec, Receipt, Sampling,
    StagedFile, StoredImage, StoredPlane, StoredPlanes, Window, Written, display_bytes, display_steps, encode_planes,
    false_colors, is_decoding, relative_differences, write_open, write_whole,
};
pub use import::{
    ImportError, MeshData, MeshFormat, MeshPart, MeshPlace, MeshReport, MtlNote, gltf_animations, is_gltf,
    is_point_set, read_mesh,
};
pub use light::{
    DirectionalDesc, DiskLightDesc, EmitSides, Falloff, LightDesc, PointDesc, RectangleDesc, SampleSet,
    SphereLightDesc, SpotDesc,
};
pub use material::{
    AlphaMode, AmbientDesc, AmbientGradientDesc, BlinnPhongDesc, MaterialCommonDesc, MaterialDesc,
    MetallicRoughnessDesc, NormalFix, PhongDesc, ShadowCatcherDesc, UnlitDesc,
};
pub use math::{DVec3, ShadowRay, Vec2, Vec3, WorldRay};
pub use model::{
    ModelAnimation, ModelCounts, ModelExtension, ModelFile, ModelMaterial, ModelMesh, ModelPicture, ModelReport,
    MtlMaterials, MtlSettings, read_mtl,
};
pub use render::{LightCounts, RenderStats, render, render_image};
pub use scene::{
    Added, CameraHit, CastHit, CompileOptions, Compiled, DisplayEncoding, Framing, Hit, MotionTo, RenderDesc, Scene,
    SceneDesc, SceneSummary, Studio, StudioSettings, SurfacePoint, View,
};
pub use scene::{Builtin, Parsed, TEXTURE_MEMORY, builtin_scenes, reference, schema};
pub use shape::{
    BoxDesc, CompileCache, ConeDesc, CylinderDesc, DiskDesc, Footprint, GroupDesc, InstanceDesc, MeshDesc, ModelDesc,
    ParallelogramDesc, PlaneDesc, PointSetDesc, RayDifferential, RectangleShapeDesc, ShadowTerminator, ShapeDesc,
    SphereDesc, SphereUv, TorusDesc, UpAxis, UvEdge,
};
pub use texture::{CheckerboardDesc, Filter, ImageTextureDesc, TextureDesc, TextureSpace, UvGridDesc, Wrap};
pub use transform::{Interpolation, TransformDesc, TransformKeyDesc};

/// The code of the book and of the README is compiled, and run where that takes no files.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../../../docs/src/library.md")]
    mod library {}
    #[doc = include_str!("../../../docs/src/buffers.md")]
    mod buffers {}
    #[doc = include_str!("../../../README.md")]
    mod readme {}
}

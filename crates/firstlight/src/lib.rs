//! Direct light, without noise, with the same bits on every machine.

mod camera;
mod color;
mod context;
mod describe;
mod error;
mod ids;
mod image;
mod light;
mod material;
mod math;
mod render;
mod scene;
mod shape;
mod texture;

pub use camera::{Camera, CameraDesc, Pinhole};
pub use color::{Display, Encoding, Rgb};
pub use context::{AssetError, Assets, FolderAssets, MemoryAssets, NoAssets};
pub use describe::{ColorDesc, ColorParam, FilePath, NumberParam, ParamDesc};
pub use error::{Diagnostic, Place, SceneError, Severity};
pub use ids::{LightId, MaterialId, SurfaceId, TextureId};
pub use image::{
    Format, Image, ImageError, PendingFile, Receipt, StagedFile, StoredImage, Window, Written, write_whole,
};
pub use light::{DirectionalDesc, EmitSides, Falloff, LightDesc, PointDesc, RectangleDesc, SampleSet, SpotDesc};
pub use material::{BlinnPhongDesc, MaterialDesc, PhongDesc};
pub use math::{Ray, Vec2, Vec3};
pub use render::{Film, RenderSettings, RenderStats, SimdLevel, render};
pub use scene::{Builtin, Parsed, builtin_scenes, reference, schema};
pub use scene::{
    CameraHit, CompileOptions, Compiled, DisplayEncoding, Hit, RenderDesc, Scene, SceneDesc, SceneSummary,
};
pub use shape::{
    Footprint, ParallelogramDesc, RayDifferential, ShapeDesc, SphereDesc, SphereUv, SurfaceInteraction, UvEdge,
};
pub use texture::{CheckerboardDesc, Filter, ImageTextureDesc, TextureDesc, TextureSpace, Wrap};

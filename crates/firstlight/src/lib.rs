//! Direct light, without noise, with the same bits on every machine.

mod camera;
mod color;
#[allow(dead_code)]
mod context;
mod describe;
mod error;
mod ids;
mod image;
mod light;
mod material;
mod scene;
mod shape;
mod texture;

pub use camera::CameraDesc;
pub use color::Rgb;
pub use context::{AssetError, Assets, FolderAssets, MemoryAssets, NoAssets};
pub use describe::{ColorDesc, ColorParam, FilePath, NumberParam, ParamDesc};
pub use error::{Diagnostic, Place, SceneError, Severity};
pub use ids::{LightId, MaterialId, SurfaceId, TextureId};
pub use image::{Image, Receipt, Window};
pub use light::{DirectionalDesc, EmitSides, Falloff, LightDesc, PointDesc, RectangleDesc, SampleSet, SpotDesc};
pub use material::{BlinnPhongDesc, MaterialDesc, PhongDesc};
pub use scene::{DisplayEncoding, RenderDesc, SceneDesc};
pub use shape::{ParallelogramDesc, ShapeDesc, SphereDesc, SphereUv};
pub use texture::{CheckerboardDesc, Filter, ImageTextureDesc, TextureDesc, TextureSpace, Wrap};

mod stubs;
pub use stubs::{
    Builtin, CompileOptions, Compiled, Display, Encoding, Film, Format, ImageError, Parsed, PendingFile, RenderSettings,
    RenderStats, Scene, SceneSummary, SimdLevel, StagedFile, Written, builtin_scenes, render, schema,
};

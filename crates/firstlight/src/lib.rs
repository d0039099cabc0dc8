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
mod scene;
mod shape;
mod texture;

pub use camera::CameraDesc;
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
pub use scene::{DisplayEncoding, RenderDesc, SceneDesc};
pub use shape::{ParallelogramDesc, ShapeDesc, SphereDesc, SphereUv};
pub use texture::{CheckerboardDesc, Filter, ImageTextureDesc, TextureDesc, TextureSpace, Wrap};

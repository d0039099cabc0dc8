//! Shapes: what a ray can hit.
//!
//! Each shape is a room: what a scene may say of it, how a ray meets it, its texture coordinates, and how it stands in
//! the way of light.

mod ball;
mod bump_shadowing;
mod cache;
#[cfg(test)]
pub(crate) mod check;
mod common;
mod cone;
mod cover;
mod cuboid;
mod cylinder;
mod disk;
mod frustum;
mod group;
mod mesh;
mod model;
mod parallelogram;
mod placement;
mod plane;
mod point_set;
mod rectangle;
mod solid;
mod sphere;
mod surface;
mod torus;
mod triangles;

pub use cache::CompileCache;
pub use cone::ConeDesc;
pub use cuboid::BoxDesc;
pub use cylinder::CylinderDesc;
pub use disk::DiskDesc;
pub use group::{GroupDesc, InstanceDesc};
pub use mesh::MeshDesc;
pub use model::{ModelDesc, UpAxis};
pub use parallelogram::{Parallelogram, ParallelogramDesc};
pub use plane::PlaneDesc;
pub use point_set::PointSetDesc;
pub use rectangle::RectangleShapeDesc;
pub(crate) use rectangle::facing;
pub use sphere::{Sphere, SphereDesc, SphereUv};
pub(crate) use surface::NormalFrame;
pub use surface::{Footprint, RayDifferential, ShadowTerminator, SurfaceInteraction, UvEdge};
pub use torus::TorusDesc;

pub(crate) use bump_shadowing::BumpShadowing;
pub(crate) use cache::{MeshFiles, key_of};
pub(crate) use common::Common;
pub(crate) use cover::{Cover, LightSeen};
pub(crate) use disk::{Disk, DiskShadow};
pub(crate) use mesh::{JoinedPart, Mesh, MeshBuilder, MeshSource, NamedSets, TrianglePoint};
pub(crate) use mesh::{load_mesh_file, parse_mesh_file, read_mesh_bytes, unreadable};
pub(crate) use parallelogram::{ParallelogramShadow, PlaneSide};
pub(crate) use placement::Placement;
pub(crate) use plane::UnboundedPlane;
pub(crate) use point_set::PointSet;
pub(crate) use solid::{Canonical, LineLanes, Solid, SolidHit};
pub(crate) use sphere::SphereShadow;
pub(crate) use surface::{ShapePoint, TexturePoint, UV_SETS};
pub(crate) use triangles::{Eye, PacketHits, SeenParts, SeenTriangle, TOGETHER, TileHits, TriangleTree, bits, every};

use crate::describe::family;
use crate::transform::TransformDesc;

family! {
    /// A shape as a scene may say it.
    pub enum ShapeDesc: "shape" {
        /// `[[sphere]]`
        Sphere(SphereDesc) = "sphere",
        /// `[[parallelogram]]`
        Parallelogram(ParallelogramDesc) = "parallelogram",
        /// `[[plane]]`
        Plane(PlaneDesc) = "plane",
        /// `[[disk]]`
        Disk(DiskDesc) = "disk",
        /// `[[rectangle]]`
        Rectangle(RectangleShapeDesc) = "rectangle",
        /// `[[box]]`
        Box(BoxDesc) = "box",
        /// `[[cylinder]]`
        Cylinder(CylinderDesc) = "cylinder",
        /// `[[cone]]`
        Cone(ConeDesc) = "cone",
        /// `[[torus]]`
        Torus(TorusDesc) = "torus",
        /// `[[mesh]]`
        Mesh(MeshDesc) = "mesh",
        /// `[[point_set]]`
        PointSet(PointSetDesc) = "point_set",
        /// `[[instance]]`
        Instance(InstanceDesc) = "instance",
        /// `[[model]]`
        Model(ModelDesc) = "model",
    }
}

impl ShapeDesc {
    /// What reports call it, if it has a name.
    pub fn name(&self) -> Option<&str> {
        self.common().name
    }

    /// How it is moved, if it is.
    pub fn transform(&self) -> Option<&TransformDesc> {
        self.common().transform
    }

    /// What it says that every shape can say.
    pub(crate) fn common(&self) -> Common<'_> {
        match self {
            ShapeDesc::Sphere(desc) => desc.common(),
            ShapeDesc::Parallelogram(desc) => desc.common(),
            ShapeDesc::Plane(desc) => desc.common(),
            ShapeDesc::Disk(desc) => desc.common(),
            ShapeDesc::Rectangle(desc) => desc.common(),
            ShapeDesc::Box(desc) => desc.common(),
            ShapeDesc::Cylinder(desc) => desc.common(),
            ShapeDesc::Cone(desc) => desc.common(),
            ShapeDesc::Torus(desc) => desc.common(),
            ShapeDesc::Mesh(desc) => desc.common(),
            ShapeDesc::PointSet(desc) => desc.common(),
            ShapeDesc::Instance(desc) => desc.common(),
            ShapeDesc::Model(desc) => desc.common(),
        }
    }
}

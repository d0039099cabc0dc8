//! Groups of shapes, and their instances.

use super::ShapeDesc;
use super::common::shape_table;

/// Shapes that are described once and placed many times: `[[group.NAME.sphere]]`, `[[group.NAME.mesh]]` and so on.
///
/// A group by itself is not seen: an [`InstanceDesc`] places it. Groups may hold instances of other groups.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupDesc {
    /// What it holds, in the space of the group.
    pub shapes: Vec<ShapeDesc>,
}

shape_table! {
    /// A copy of a group: all its shapes, moved, turned and scaled together. What it places takes about 300 bytes for
    /// each mesh, point set or other shape of the group. Groups may hold instances of others, 32 deep; a scene places
    /// at most 4194304 shapes and instances.
    ///
    /// Each shape of each instance has its own id, and the names of the instances around it and its own as name, with
    /// `/` between. `material` replaces the materials of everything in the group; what is
    /// invisible or casts no shadow in the group stays so.
    ///
    /// ```toml
    /// [[group.tree.cone]]
    /// p0 = [0, 0, 0]
    /// p1 = [0, 3, 0]
    /// radius0 = 1
    /// [[instance]]
    /// of = "tree"
    /// transform = { translate = [4, 0, 0], rotate_deg = [0, 30, 0], scale = 1.2 }
    /// ```
    pub struct InstanceDesc {
        /// The name of the group.
        pub of: String,
    }
}

//! Models: files with shapes, materials and textures of their own.

use super::common::shape_table;
use crate::describe::{FilePath, NameMap, words};

words! {
    /// The axis of a model that points upwards.
    pub enum UpAxis {
        /// y, as everywhere in firstlight and in glTF.
        Y = "y",
        /// z, as in most scans, CAD programs and Blender.
        Z = "z",
    }
}

shape_table! {
    /// All that a model file shows, with its own materials and textures: glTF (`.gltf`, `.glb`), OBJ with its MTL
    /// files, PLY and STL. A PLY file of points without faces is shown as spheres.
    ///
    /// Each part of the file is a shape with its own id, and has the name of the model and its own, with `/` between:
    /// `chair/leg`. `material` replaces the materials of all parts. To place a model many times, put it in a group and
    /// place instances of that.
    ///
    /// ```toml
    /// [[model]]
    /// name = "chair"
    /// file = "chair.glb"
    /// transform = { translate = [1, 0, 0], rotate_deg = [0, 90, 0] }
    /// materials = { "Leather" = "red leather" }
    /// ```
    pub struct ModelDesc {
        /// The file, relative to the text that names it.
        pub file: FilePath,
        /// The axis of the file that points upwards; without it y, and z for STL.
        pub up: Option<UpAxis> = None,
        /// Materials of the scene in place of those of the file, by their names in the file; one of a glTF file without
        /// a name is `material 3` by its number, from 0 on.
        pub materials: NameMap = NameMap::default(),
        /// The name of a variant of a glTF file (KHR_materials_variants).
        pub variant: Option<String> = None,
        /// The number of a scene of a glTF file, from 0 on; without it, the one that the file shows.
        pub scene: Option<u32> = None,
        /// The name of an animation of a glTF file, or its number, from 0 on: it plays with the time of the scene.
        /// Without it and `time` the model is at rest.
        pub animation: Option<String> = None,
        /// The moment of the animation, in seconds from -1e9 to 1e9, at which the model stands still; without
        /// `animation` that of the first one.
        pub time: Option<f64> = None,
        /// Whether the lights of a glTF file (KHR_lights_punctual) light the scene.
        pub lights: bool = false,
        /// Whether the cameras of a glTF file are cameras of the scene, after its own.
        pub cameras: bool = false,
        /// Of a file that is no glTF: normals are made smooth across edges where faces meet at up to this angle in
        /// degrees, 0 to 180, in place of those of the file. Without it a file without normals is made smooth up to 30
        /// degrees; 0 is flat.
        pub smooth_deg: Option<f64> = None,
        /// Whether the materials of the file show their colours, whatever light there is.
        pub unlit: bool = false,
    }
}

//! What somebody may have meant who wrote a word that scene text does not have: a word of other programs, or a known
//! one misspelt.

use super::read::nearest;

/// Words of other programs, the word of scene text for the same, and what to know of it. A word may stand for several:
/// the first that is known where it was written is meant.
pub(crate) const SYNONYMS: &[(&[&str], &str, &str)] = &[
    // Shapes
    (&["cube", "cuboid", "brick"], "box", "a cube is a box, with a center and a size"),
    (
        &["triangle", "polygon", "face", "faces", "trimesh", "model", "object", "obj", "ply", "stl"],
        "mesh",
        "triangles are a mesh: a file, or positions = [[x, y, z], ...] and triangles = [[0, 1, 2], ...]",
    ),
    (&["quad", "square"], "rectangle", "a skewed one is a parallelogram"),
    (&["ball", "globe"], "sphere", ""),
    (&["ground", "floor", "ground_plane", "infinite_plane"], "plane", ""),
    (&["points", "point_cloud", "pointcloud", "particles"], "point_set", ""),
    (&["tube", "pipe"], "cylinder", ""),
    (&["circle", "disc"], "disk", ""),
    // Tables
    (&["settings", "film", "output", "image", "picture", "renderer", "integrator", "world"], "render", ""),
    (&["bsdf", "brdf", "shader"], "material", ""),
    (&["emitter", "lamp", "area_light", "point_light", "sun"], "light", "lights are written [[light.KIND]]"),
    // Kinds of lights
    (
        &["area", "quad", "panel", "softbox", "portal"],
        "rectangle",
        "a light with an area is a rectangle, disk or sphere",
    ),
    (&["sun", "distant", "parallel", "infinite"], "directional", ""),
    (&["omni", "bulb"], "point", "one with a size is a sphere"),
    (&["spotlight"], "spot", ""),
    // Kinds of materials
    (
        &["lambert", "lambertian", "diffuse", "matte", "plastic"],
        "phong",
        "with diffuse alone, and specular left at 0, it is Lambert's",
    ),
    (&["blinn", "glossy"], "blinn-phong", ""),
    // Kinds of textures
    (&["checker", "checkers", "chess", "chessboard"], "checkerboard", ""),
    (&["bitmap", "file", "picture", "map", "imagemap", "image_map"], "image", ""),
    (&["uv", "uvgrid", "uv_grid", "uv_checker", "color_grid"], "uv-grid", ""),
    // Fields
    (
        &["fov", "fovy", "fov_y", "fov_deg", "vfov", "field_of_view", "angle", "angle_of_view", "yfov"],
        "fov_y_deg",
        "the vertical field of view, in degrees",
    ),
    (&["fov", "angle", "beam_angle", "cutoff", "cone_angle"], "cone_deg", "the full angle of the cone, in degrees"),
    (&["focal_length", "lens"], "focal_length_mm", ""),
    (&["eye", "from", "origin", "location", "pos", "center", "translation"], "position", ""),
    (&["eye", "origin", "location", "pos", "position"], "center", ""),
    (&["pos", "position", "origin", "center"], "point", ""),
    (&["target", "at", "to", "lookat", "interest", "focus"], "look_at", ""),
    (&["dir", "to"], "direction", ""),
    (&["r", "rad"], "radius", ""),
    (&["diameter"], "radius", "half of the diameter"),
    (&["scale", "extent", "extents", "dimensions", "width", "side"], "size", ""),
    (
        &["intensity", "power", "energy", "brightness", "radiance", "irradiance", "watts", "lux", "candela"],
        "strength",
        "",
    ),
    (&["emission", "rgb"], "color", ""),
    (&["colour"], "color", ""),
    (
        &["color", "colour", "albedo", "base_color", "base_colour", "kd", "reflectance", "rgb"],
        "diffuse",
        "the colour of a surface is its diffuse reflectance",
    ),
    (&["ks", "specular_color", "reflectivity"], "specular", ""),
    (&["ka"], "ambient", ""),
    (
        &["exponent", "ns", "roughness", "glossiness", "phong_size", "specular_exponent"],
        "shininess",
        "the exponent of the highlight: larger is smoother",
    ),
    (&["space", "colorspace", "colour_space", "encoding"], "color_space", "what the picture's numbers mean"),
    (&["filename", "path", "src", "url", "image"], "file", ""),
    (&["vertices", "points", "verts", "vertex"], "positions", ""),
    (&["indices", "faces", "tris"], "triangles", ""),
    (&["texcoords", "uv", "texture_coordinates"], "uvs", ""),
    (&["texcoord", "tex_coord", "texcoord_set", "uv_map", "uv_index"], "uv_set", "sets are counted from 0"),
    (
        &["uvs1", "uvs2", "uv1", "uv2", "texcoord_1", "further_uvs"],
        "more_uvs",
        "a list of sets, after `uvs`, which is 0",
    ),
    (&["shape", "group", "object", "reference"], "of", "the name of the group"),
    (&["resolution", "size", "xres", "image_width"], "width", "width and height are two numbers, in pixels"),
    (&["yres", "image_height"], "height", ""),
    (
        &["spp", "samples_per_pixel", "aa", "msaa", "pixel_samples"],
        "antialiasing",
        "n sends n x n camera rays for each pixel",
    ),
    (&["translation", "position", "location", "move"], "translate", ""),
    (&["rotation", "rotate", "euler"], "rotate_deg", "around x, y and z, in degrees"),
];

/// The known word that was probably meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Meant<'k> {
    pub word: &'k str,
    /// What to know of it; may be empty.
    note: &'static str,
}

impl Meant<'_> {
    /// `did you mean "box"? a cube is a box; `: the beginning of a hint.
    pub fn question(&self) -> String {
        let Self { word, note } = self;
        if note.is_empty() {
            format!("did you mean \"{word}\"? ")
        } else {
            format!("did you mean \"{word}\"? {note}; ")
        }
    }
}

/// What `word` was probably meant to be, of words that are `known` where it was written.
pub(crate) fn meant<'k>(word: &str, known: &[&'k str]) -> Option<Meant<'k>> {
    let lower = word.to_ascii_lowercase().replace('-', "_");
    let find = |target: &str| known.iter().find(|known| **known == target);
    let of_others = SYNONYMS.iter().filter(|(words, ..)| words.contains(&&*lower));
    let mut known_ones = of_others.filter_map(|(_, target, note)| Some(Meant { word: find(target)?, note }));
    known_ones.next().or_else(|| nearest(word, known).map(|word| Meant { word, note: "" }))
}

/// What to ask about `word`, the beginning of a hint; empty where nothing known is near.
pub(crate) fn did_you_mean(word: &str, known: &[&str]) -> String {
    meant(word, known).map(|meant| meant.question()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_that_is_known_is_meant() {
        for (word, known, question) in [
            ("fov", "fov_y_deg", "did you mean \"fov_y_deg\"? the vertical field of view, in degrees; "),
            ("Fov", "cone_deg", "did you mean \"cone_deg\"? the full angle of the cone, in degrees; "),
            ("sun", "directional", "did you mean \"directional\"? "),
            ("texCoord", "uv_set", "did you mean \"uv_set\"? sets are counted from 0; "),
            ("point-cloud", "point_set", "did you mean \"point_set\"? "),
            ("sphre", "sphere", "did you mean \"sphere\"? "),
            ("glass", "phong", ""),
        ] {
            assert_eq!(did_you_mean(word, &["look_at", known, "up"]), question, "{word}");
        }
    }
}

//! Textures that name a set of texture coordinates: the same picture, to the bit, as of meshes that have that set
//! alone.

use firstlight::*;

use crate::buffers::{film, floats};
use crate::normals::files;
use crate::scenes::{bits, every_ray, one_thread, picture};

/// How the sets of meshes are laid out, and which of them textures name.
#[derive(Clone, Copy)]
struct Layout {
    /// The set of the meshes themselves.
    own: usize,
    /// The sets of a mesh, as the letters of [`uvs`].
    sets: &'static str,
    /// The set that textures name.
    named: Option<usize>,
}

/// What a scene of set B alone looks like.
const PLAIN: Layout = Layout { own: 0, sets: "b", named: None };
/// Layouts in which all textures are laid by set B.
const SAME: [Layout; 5] = [
    Layout { own: 0, sets: "ab", named: Some(1) },
    Layout { own: 1, sets: "ab", named: None },
    // It is the mesh's own as well
    Layout { own: 1, sets: "ab", named: Some(1) },
    Layout { own: 2, sets: "bca", named: Some(0) },
    // Texture coordinates without a direction, and numbers that no picture has
    Layout { own: 0, sets: "0cxb", named: Some(3) },
];

/// The texture coordinates of such corners, in x and y.
fn uvs(letter: char, corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let of = |[x, y]: [f64; 2]| match letter {
        'a' => [x, y],
        'b' => [1.7 * y + 0.1, 0.9 * x - 0.2 * y],
        'c' => [x + y, x - y],
        'x' => [1e30 * x, -1e30],
        _ => [0.0, 0.0],
    };
    corners.iter().map(|corner| of(*corner)).collect()
}

impl Layout {
    /// The lists of a mesh with such corners.
    fn lists(&self, corners: &[[f64; 2]]) -> String {
        let mut sets = self.sets.chars().map(|letter| uvs(letter, corners));
        let (first, rest) = (sets.next().unwrap(), sets.collect::<Vec<_>>());
        format!("uvs = {first:?}\nmore_uvs = {rest:?}\nuv_set = {}", self.own)
    }

    /// A square of x and y from -1 to 1, with normals that lean apart.
    fn square(&self, more: &str, table: &str) -> String {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let positions = corners.map(|[x, y]| [x, y, 0.0]);
        let normals = corners.map(|[x, y]| [0.2 * x, 0.3 * y, 1.0]);
        format!(
            "[[{table}mesh]]\npositions = {positions:?}\nnormals = {normals:?}\ntriangles = [[0, 1, 2], [0, 2, 3]]\n\
             {}\n{more}\n",
            self.lists(&corners)
        )
    }

    fn scene(&self) -> String {
        let named = self.named.map_or(String::new(), |set| format!("uv_set = {set}"));
        let pictures: String = ["wave", "height", "gloss", "rough"]
            .iter()
            .map(|name| format!("[texture.image.{name}]\nfile = \"{name}.png\"\n{named}\n"))
            .collect();
        let square = |more: &str| self.square(more, "");
        let at = |place: &str| format!("transform = {{ translate = {place}, rotate_deg = [-30, 20, 10] }}");
        let faces = "materials = [\"rough\", \"leaf\"]\nface_materials = [0, 1]";
        format!(
            r#"
            [render]
            width = 72
            height = 60
            antialiasing = 2
            ambient = 0.2
            [camera]
            position = [0, 2.2, 9]
            look_at = [0, 0.2, 0]
            [[light.rectangle]]
            center = [1, 6, 4]
            e0 = [2, 0, 0]
            e1 = [0, 0, 2]
            strength = 14
            samples = 16
            [[light.point]]
            position = [-4, 5, 5]
            strength = 50
            [[plane]]
            point = [0, -1.3, 0]
            {pictures}
            [texture.checkerboard.board]
            counts = [5, 3]
            colors = [[0.9, 0.3, 0.1], [0.1, 0.2, 0.8]]
            {named}
            [texture.checkerboard.holes]
            counts = [3, 4]
            colors = [1, 0.1]
            {named}
            [texture.uv-grid.grid]
            counts = [2, 2]
            {named}
            [material.phong.board]
            diffuse = {{ texture = "board" }}
            specular = 0.3
            [material.metallic-roughness.rough]
            base_color = {{ texture = "grid" }}
            roughness = {{ texture = "gloss" }}
            occlusion = {{ texture = "height" }}
            emissive = {{ texture = "wave", factor = 0.2 }}
            [material.metallic-roughness.mapped]
            normal_map = "wave"
            bump_map = {{ texture = "height" }}
            bump_scale = 0.05
            clearcoat = {{ texture = "gloss" }}
            clearcoat_normal_map = "rough"
            [material.blinn-phong.bumps]
            bump_map = {{ texture = "height" }}
            bump_scale = 0.1
            [material.blinn-phong.leaf]
            diffuse = {{ texture = "board" }}
            alpha = {{ texture = "holes" }}
            alpha_mode = "mask"
            [material.phong.veil]
            diffuse = {{ texture = "grid" }}
            alpha = {{ texture = "height" }}
            alpha_mode = "blend"
            {}{}{}{}{}{}{}{}
            [[instance]]
            of = "pair"
            transform = {{ translate = [2.2, -0.3, 3], scale = 0.5, rotate_deg = [0, 40, 0] }}
            [[instance]]
            of = "pair"
            material = "mapped"
            transform = {{ translate = [-2.3, -0.6, 3.4], scale = [0.5, 0.4, -0.3], rotate_deg = [0, 10, 70] }}
            [[group.outer.instance]]
            of = "pair"
            material = "leaf"
            [[instance]]
            of = "outer"
            transform = {{ translate = [0.5, 0.2, 3.6], scale = 0.4 }}
            "#,
            square(&format!("material = \"board\"\n{}", at("[-2.6, 1.6, 0]"))),
            square(&format!("material = \"mapped\"\n{}", at("[0, 1.6, 0]"))),
            square(&format!("material = \"bumps\"\n{}", at("[2.6, 1.6, 0]"))),
            square(&format!("material = \"veil\"\n{}", at("[-2.6, -0.4, 1]"))),
            square(&format!("alphas = [1, 0.6, 1, 0.8]\nmaterial = \"leaf\"\n{}", at("[0, -0.4, 1.5]"))),
            square(&format!("{faces}\n{}", at("[2.6, -0.4, 0]"))),
            self.square("material = \"rough\"", "group.pair."),
            self.square(&format!("{faces}\n{}", at("[1, 1, 1]")), "group.pair."),
        )
    }
}

fn compile(text: &str) -> Result<Scene, SceneError> {
    let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
    parsed.compile(&files(), &CompileOptions::default()).map(|compiled| compiled.scene)
}

fn scene(text: &str) -> Scene {
    compile(text).unwrap_or_else(|fault| panic!("{fault}"))
}

/// The bits of the film by all renderers, and those of some buffers.
fn pictures(scene: &Scene) -> Vec<Vec<u32>> {
    let planes = [Plane::Albedo, Plane::Emission, Plane::Normal, Plane::Roughness, Plane::Opacity];
    let with_planes = RenderSettings { buffers: planes.iter().map(|plane| (*plane).into()).collect(), ..one_thread() };
    let reference = RenderSettings { reference: true, ..one_thread() };
    let mut all: Vec<Vec<u32>> = [reference, every_ray(), one_thread()]
        .iter()
        .map(|settings| bits(&picture(scene, settings)).into_flattened())
        .collect();
    let film = film(scene, &with_planes);
    all.extend(planes.iter().map(|plane| floats(&film, *plane).iter().map(|c| c.to_bits()).collect()));
    all
}

#[test]
fn a_set_that_textures_name_is_as_good_as_that_of_the_mesh() {
    let plain = pictures(&scene(&PLAIN.scene()));
    for layout in SAME {
        let same = pictures(&scene(&layout.scene()));
        let differing: Vec<usize> = (0..plain.len()).filter(|i| plain[*i] != same[*i]).collect();
        assert!(differing.is_empty(), "{differing:?}\n{}", layout.scene());
    }
    // With another set all of them are others
    let other = pictures(&scene(&Layout { own: 1, sets: "ab", named: Some(0) }.scene()));
    let same: Vec<usize> = (0..plain.len()).filter(|i| plain[*i] == other[*i]).collect();
    assert!(same.is_empty(), "{same:?}");
}

#[test]
fn two_textures_of_a_material_may_have_two_sets() {
    // The base colour by A, what is emitted by B
    let planes = |sets: &str, color: Option<usize>, glow: Option<usize>| {
        let set = |set: Option<usize>| set.map_or(String::new(), |set| format!("uv_set = {set}"));
        let layout = Layout { own: 0, sets: Box::leak(sets.to_owned().into_boxed_str()), named: None };
        let text = format!(
            "[render]\nwidth = 40\nheight = 40\n[camera]\nposition = [1, 2, 3]\nlook_at = [0, 0, 0]\n\
             [texture.checkerboard.color]\ncounts = [5, 3]\n{}\n[texture.uv-grid.glow]\ncounts = [3, 3]\n{}\n\
             [material.metallic-roughness.both]\nbase_color = {{ texture = \"color\" }}\n\
             emissive = {{ texture = \"glow\" }}\n{}",
            set(color),
            set(glow),
            layout.square("material = \"both\"", "")
        );
        let planes = [Plane::Albedo, Plane::Emission];
        let buffers = planes.iter().map(|plane| (*plane).into()).collect();
        let film = film(&scene(&text), &RenderSettings { buffers, ..one_thread() });
        planes.map(|plane| floats(&film, plane).to_vec())
    };
    let ([color, _], [_, glow]) = (planes("a", None, None), planes("b", None, None));
    assert_eq!(planes("ab", None, Some(1)), [color.clone(), glow.clone()]);
    assert_eq!(planes("ab", Some(0), Some(1)), [color.clone(), glow.clone()]);
    assert_eq!(planes("xbca", Some(3), Some(1)), [color.clone(), glow.clone()]);
    let swapped = planes("ab", Some(1), Some(0));
    assert!(swapped[0] != color && swapped[1] != glow);
}

#[test]
fn shapes_of_other_kinds_have_set_0() {
    let of = |set: &str| {
        let text = format!(
            "[render]\nwidth = 20\nheight = 16\n[camera]\nposition = [0, 2, 7]\nlook_at = [0, 0.5, 0]\n\
             [[light.rectangle]]\ncenter = [1, 5, 3]\ne0 = [1, 0, 0]\ne1 = [0, 0, 1]\nstrength = 40\n\
             [texture.checkerboard.color]\ncounts = [5, 3]\n{set}\n[texture.image.wave]\nfile = \"wave.png\"\n{set}\n\
             [texture.image.height]\nfile = \"height.png\"\n{set}\n\
             [material.metallic-roughness.m]\nbase_color = {{ texture = \"color\" }}\nnormal_map = \"wave\"\n\
             bump_map = {{ texture = \"height\" }}\nbump_scale = 0.02\n\
             [material.phong.board]\ndiffuse = {{ texture = \"color\" }}\n\
             [material.phong.veil]\nalpha = {{ texture = \"height\" }}\nalpha_mode = \"blend\"\n\
             [[plane]]\npoint = [0, -1, 0]\nmaterial = \"board\"\n[[sphere]]\ncenter = [-2, 0, 0]\nradius = 1\n\
             material = \"board\"\n[[parallelogram]]\np = [-1, -1, -1]\ne0 = [2, 0, 0]\ne1 = [0, 3, 0]\n\
             material = \"m\"\n[[torus]]\ncenter = [2, 0, 0]\nmajor_radius = 0.7\nminor_radius = 0.3\n\
             material = \"m\"\n[[box]]\ncenter = [0, 0, 1]\nmaterial = \"veil\"\n\
             [[mesh]]\npositions = [[-1, 2, 0], [1, 2, 0], [0, 3, 0]]\ntriangles = [[0, 1, 2]]\nmaterial = \"board\"\n"
        );
        pictures(&scene(&text))
    };
    assert!(of("") == of("uv_set = 0"));
}

#[test]
fn texture_coordinates_of_files_may_be_anything() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               property float u\nproperty float v\nelement face 2\nproperty list uchar int vertex_indices\n\
               end_header\n-1 -1 0 nan 0\n1 -1 0 inf 0\n1 1 0 1e38 -1e38\n-1 1 0 0 -inf\n3 0 1 2\n3 0 2 3\n";
    for set in ["", "uv_set = 0"] {
        let text = format!(
            "[render]\nwidth = 16\nheight = 16\n[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n\
             [[light.point]]\nposition = [1, 2, 3]\n[texture.checkerboard.c]\n{set}\n[texture.image.wave]\n\
             file = \"wave.png\"\n{set}\n[texture.image.height]\nfile = \"height.png\"\n{set}\n\
             [material.metallic-roughness.m]\nbase_color = {{ texture = \"c\" }}\nnormal_map = \"wave\"\n\
             bump_map = {{ texture = \"height\" }}\nroughness = {{ texture = \"height\" }}\n\
             alpha = {{ texture = \"c\" }}\nalpha_mode = \"mask\"\n\
             [[mesh]]\nfile = \"m.ply\"\nmaterial = \"m\"\n"
        );
        let mut assets = files();
        assets.files.insert("m.ply".into(), ply.into());
        let parsed = SceneDesc::parse("s.toml", text.as_bytes(), &NoAssets);
        let scene = parsed.compile(&assets, &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
        let _ = pictures(&scene);
    }
}

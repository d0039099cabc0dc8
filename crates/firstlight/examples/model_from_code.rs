//! A scene that is built in Rust, with a mesh that is computed, to a PNG file.
//!
//! ```sh
//! cargo run --release -p firstlight --example model_from_code -- knot.png
//! ```

use std::error::Error;
use std::f32::consts::TAU;
use std::path::Path;

use firstlight::{
    BlinnPhongDesc, CameraDesc, CheckerboardDesc, ColorDesc, ColorParam, CompileOptions, Format, LightDesc,
    MaterialDesc, MeshDesc, NoAssets, NumberParam, PhongDesc, PlaneDesc, RectangleDesc, RenderSettings, SceneDesc,
    ShapeDesc, TextureDesc, Vec2, Vec3, render_image, write_whole,
};

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).unwrap_or("knot.png".into());
    render_to(Path::new(&file), &scene(480, 320))
}

/// Compiles a description, renders it and writes the picture.
fn render_to(file: &Path, desc: &SceneDesc) -> Result<(), Box<dyn Error>> {
    // Every fault at once, with the path of its value: `mesh[0].triangles[3]: ...`
    let compiled = desc.compile(&NoAssets, &CompileOptions::default())?;
    for warning in &compiled.warnings {
        eprintln!("{warning}");
    }
    let scene = compiled.scene;
    println!("{} triangles", scene.summary().triangles);
    // Rendering cannot fail; writing can. The file is there whole, or not at all
    let image = render_image(&scene);
    let bytes = image.encode(Format::Png8, &scene.display(), &scene.receipt(&RenderSettings::default()))?;
    write_whole(file, &bytes)?;
    Ok(())
}

/// A knot of clay on a floor of tiles, under a square light. Lengths are in metres, y is up.
fn scene(width: u32, height: u32) -> SceneDesc {
    let mut desc = SceneDesc::default();
    desc.render.width = width;
    desc.render.height = height;
    desc.render.ambient = ColorDesc::gray(0.05).into();
    // The name of the only camera may be empty
    let camera = CameraDesc { look_at: [0.0, 0.9, 0.0], fov_y_deg: Some(32.0), ..CameraDesc::new([2.5, 3.4, 6.0]) };
    desc.cameras.push((String::new(), camera));
    // A square light of 2 m x 2 m that faces down: the front is where e0 x e1 points
    let lamp = RectangleDesc::with_edges([-2.0, 5.0, 2.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
    desc.lights.push(LightDesc::Rectangle(RectangleDesc { strength: 28.0, ..lamp }));
    // Textures and materials have names, and others refer to them
    let colors = [ColorDesc::gray(0.75), ColorDesc::linear(0.2, 0.3, 0.4)];
    let tiles = CheckerboardDesc { counts: [2, 2], colors, ..CheckerboardDesc::default() };
    desc.textures.push(("tiles".into(), TextureDesc::Checkerboard(tiles)));
    let floor = PhongDesc { diffuse: ColorParam::texture("tiles"), ..PhongDesc::default() };
    desc.materials.push(("floor".into(), MaterialDesc::Phong(floor)));
    let clay = BlinnPhongDesc {
        diffuse: ColorParam::constant(ColorDesc::linear(0.75, 0.25, 0.12)),
        specular: ColorParam::gray(0.25),
        shininess: NumberParam::constant(60.0),
        ..BlinnPhongDesc::default()
    };
    desc.materials.push(("clay".into(), MaterialDesc::BlinnPhong(clay)));
    desc.shapes.push(ShapeDesc::Plane(PlaneDesc { material: Some("floor".into()), ..PlaneDesc::default() }));
    desc.shapes.push(ShapeDesc::Mesh(MeshDesc { material: Some("clay".into()), ..knot(240, 24) }));
    desc
}

/// A tube around a trefoil knot: `along` rings of `around` vertices each.
fn knot(along: u32, around: u32) -> MeshDesc {
    let turn = |part: u32, of: u32, times: f32| Vec2::from_angle(TAU * times * part as f32 / of as f32);
    let middle = |i: u32| {
        let (twice, thrice) = (turn(i % along, along, 2.0), turn(i % along, along, 3.0));
        let across = twice * (0.8 + 0.3 * thrice.x);
        Vec3::new(across.x, 0.75 + 0.35 * thrice.y, across.y)
    };
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for i in 0..along {
        // Two directions across the tube, from the direction along it
        let ahead = (middle(i + 1) - middle(i + along - 1)).normalize();
        let side = ahead.cross(Vec3::Y).normalize();
        let up = side.cross(ahead);
        for k in 0..around {
            let Vec2 { x, y } = turn(k, around, 1.0);
            let out = side * x + up * y;
            positions.push((middle(i) + out * 0.2).as_dvec3().to_array());
            normals.push(out.as_dvec3().to_array());
        }
    }
    // Corners run counterclockwise around the front
    let vertex = |i: u32, k: u32| (i % along) * around + k % around;
    let squares = (0..along).flat_map(|i| (0..around).map(move |k| (i, k)));
    let triangles = squares.flat_map(|(i, k)| {
        let [a, b, c, d] = [vertex(i, k), vertex(i + 1, k), vertex(i + 1, k + 1), vertex(i, k + 1)];
        [[a, b, c], [a, c, d]]
    });
    MeshDesc { triangles: triangles.collect(), positions, normals, ..MeshDesc::default() }
}

#[test]
fn it_renders_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("knot.png");
    let mut desc = scene(12, 8);
    desc.render.antialiasing = 1;
    desc.render.samples = 16.into();
    render_to(&file, &desc).unwrap();
    let picture = firstlight::StoredImage::read(&std::fs::read(&file).unwrap()).unwrap();
    assert_eq!(picture.film, [12, 8]);
    // The description as text is the same scene
    let parsed = SceneDesc::parse("knot.toml", desc.to_toml().as_bytes(), &NoAssets);
    assert_eq!(parsed.faults(), []);
    assert_eq!(parsed.desc, desc);
}

#[test]
fn the_mesh_is_closed_and_its_front_is_outside() {
    let mesh = knot(60, 12);
    let outwards = |[a, b, c]: [u32; 3]| {
        let p = |i: u32| firstlight::DVec3::from(mesh.positions[i as usize]);
        (p(b) - p(a)).cross(p(c) - p(a)).dot(mesh.normals[a as usize].into())
    };
    assert!(mesh.triangles.iter().all(|triangle| outwards(*triangle) > 0.0));
}

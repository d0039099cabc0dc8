//! What is kept from one compilation of a scene to the next.

use std::sync::Arc;

use super::{CompileOptions, Scene, SceneDesc};
use crate::context::NoAssets;
use crate::import::MeshData;
use crate::light::LightDesc;
use crate::shape::{CompileCache, MeshDesc, ShapeDesc};
use crate::transform::TransformDesc;

const SCENE: &str = "[camera]\nposition = [0, 0, 9]\n[[light.point]]\nposition = [0, 5, 9]\n\
    [[group.g.mesh]]\npositions = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\ntriangles = [[0, 1, 2]]\nsmooth_deg = 30\n\
    [[instance]]\nof = \"g\"\n[[mesh]]\npositions = [[0, 0, 0], [1, 0, 0], [0, 1, 1]]\ntriangles = [[0, 1, 2]]\n";

fn compile(desc: &SceneDesc, cache: Option<&CompileCache>) -> Scene {
    let options = CompileOptions { cache: cache.cloned(), ..CompileOptions::default() };
    desc.compile(&NoAssets, &options).expect("is a scene").scene
}

/// Whether the trees of the world and of the group are those of the other scene.
fn shared(a: &Scene, b: &Scene) -> [bool; 2] {
    let world = |scene: &Scene| scene.geometry.world.as_ref().map(|world| world.mesh.clone());
    let (Some(one), Some(other)) = (world(a), world(b)) else { panic!("both have a mesh") };
    [Arc::ptr_eq(&one, &other), Arc::ptr_eq(&a.geometry.meshes[0], &b.geometry.meshes[0])]
}

#[test]
fn trees_are_built_anew_only_where_their_content_changes() {
    let mut desc = SceneDesc::parse("s.toml", SCENE.as_bytes(), &NoAssets).desc;
    let cache = CompileCache::default();
    let first = compile(&desc, Some(&cache));
    assert_eq!(first.hash(), compile(&desc, None).hash());
    // Another light, another place of what lies in a group
    let LightDesc::Point(light) = &mut desc.lights[0] else { panic!("is the light") };
    light.position = [1.0, 2.0, 3.0];
    let ShapeDesc::Instance(instance) = &mut desc.shapes[1] else { panic!("is the instance") };
    instance.transform = Some(Box::new(TransformDesc { translate: [0.0, 1.0, 0.0], ..Default::default() }));
    let second = compile(&desc, Some(&cache));
    assert_eq!(shared(&first, &second), [true, true]);
    // Another place of a mesh of the world: its triangles are others
    let ShapeDesc::Mesh(mesh) = &mut desc.shapes[0] else { panic!("is the mesh") };
    mesh.positions[0] = [0.0, 0.5, 0.0];
    assert_eq!(shared(&second, &compile(&desc, Some(&cache))), [false, true]);
    assert_eq!(shared(&compile(&desc, None), &compile(&desc, None)), [false, false]);
}

#[test]
fn a_given_mesh_is_that_of_lists() {
    let mut desc = SceneDesc::parse("s.toml", SCENE.as_bytes(), &NoAssets).desc;
    let listed = compile(&desc, None);
    let cache = CompileCache::default();
    let ShapeDesc::Mesh(mesh) = &mut desc.shapes[0] else { panic!("is the mesh") };
    let mut data = MeshData { triangles: mesh.triangles.clone(), ..MeshData::default() };
    data.set_positions(mesh.positions.len(), |i| mesh.positions[i]);
    assert_eq!(data.faults(), []);
    let name = cache.give_mesh(data);
    *mesh = MeshDesc { file: Some(name.clone().into()), ..MeshDesc::default() };
    let given = compile(&desc, Some(&cache));
    let of = |scene: &Scene| scene.geometry.world.as_ref().map(|world| world.mesh.positions.clone());
    assert_eq!(of(&given), of(&listed));
    assert!(cache.given_mesh(&name).is_some());
    // Who has not got it says so
    let error = desc.compile(&NoAssets, &CompileOptions::default()).expect_err("has no such file");
    assert!(error.to_string().contains("no such file"), "{error}");
    cache.retain_given(&|_| false);
    assert!(cache.given_mesh(&name).is_none());
}

#[test]
fn memory_that_is_not_allowed_is_refused() {
    let desc = SceneDesc::parse("s.toml", SCENE.as_bytes(), &NoAssets).desc;
    let faults = |memory| {
        let options = CompileOptions { memory: Some(memory), ..CompileOptions::default() };
        desc.compile(&NoAssets, &options).map(|_| ()).map_err(|error| error.faults)
    };
    // Two meshes of three vertices and a triangle: said of the first that is too much, and once
    for memory in [0, 1, 300] {
        let faults = faults(memory).expect_err("it is too little");
        assert_eq!(faults.len(), 1, "{faults:?}");
        assert!(faults[0].to_string().contains("--max-memory 1"), "{}", faults[0]);
    }
    assert!(faults(1000).is_ok());
}

//! Mesh files from anywhere: what reading them promises.

use std::ops::ControlFlow;

use firstlight::MeshFormat;

/// Reads a mesh, makes it smooth and counts its facts. Panics where a promise is broken.
pub fn check(format: MeshFormat, bytes: &[u8]) {
    match format.read("mesh", bytes, &|_, _| ControlFlow::Continue(())) {
        Err(error) => assert!(error.to_string().starts_with("mesh"), "{error}"),
        Ok(mut mesh) => {
            // Memory follows the file: no claim of a few bytes becomes a large mesh
            let report = mesh.report();
            assert!(report.bytes <= 256 * bytes.len() as u64 + 256, "{} bytes of {}", report.bytes, bytes.len());
            let indices = mesh.triangles.iter().flatten();
            assert!(indices.clone().all(|&v| (v as usize) < mesh.positions.len()));
            let triangles = mesh.triangles.len();
            mesh.smooth(30.0);
            assert_eq!((mesh.triangles.len(), mesh.normals.len()), (triangles, mesh.positions.len()));
            for normal in &mesh.normals {
                let square: f32 = normal.iter().map(|x| x * x).sum();
                assert!(square == 0.0 || (square - 1.0).abs() < 1e-5, "{normal:?}");
            }
            assert!(mesh.report().triangles == report.triangles);
        }
    }
}

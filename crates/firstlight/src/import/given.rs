//! Meshes that somebody makes in memory: from numbers of 64 bits, checked, and known by their content.

use super::MeshData;
use super::tidy::used_vertices;
use crate::error::{Diagnostic, Severity};
use crate::math::{DVec3, origin_for};

/// Coordinates beyond this, in metres, are refused, as everywhere in a scene.
const MAX_COORDINATE: f64 = 2.5e8;
/// The most that a colour multiplies.
const MAX_COLOR: f32 = 1e6;
/// Faults that are told.
const TOLD: usize = 64;

/// Positions in 32 bits, and what was taken off them: 0 but where all that are `used` are far from 0.
pub(crate) fn from_own_origin(
    count: usize,
    used: impl Fn(usize) -> bool,
    at: impl Fn(usize) -> [f64; 3],
) -> (Vec<[f32; 3]>, [f64; 3]) {
    let corners = (0..count).filter(|i| used(*i)).map(|i| [DVec3::from(at(i)); 2]);
    let bounds = corners.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)]);
    let origin = bounds.map_or(DVec3::ZERO, origin_for);
    ((0..count).map(|i| (DVec3::from(at(i)) - origin).as_vec3().to_array()).collect(), origin.to_array())
}

impl MeshData {
    /// Sets `positions` and `origin` from `count` places in 64 bits, each of them asked for twice. Where `triangles`
    /// are set, the places that they have decide the origin.
    pub fn set_positions(&mut self, count: usize, at: impl Fn(usize) -> [f64; 3]) {
        let used = used_vertices(count, &self.triangles);
        let is_used = |i: usize| used[i] || self.triangles.is_empty();
        (self.positions, self.origin) = from_own_origin(count, is_used, at);
    }

    /// What keeps it from being a mesh of a scene: lists of other lengths, indices out of range, and numbers out of
    /// range of vertices that triangles have. At most 64 faults are told.
    pub fn faults(&self) -> Vec<Diagnostic> {
        let mut faults = Vec::new();
        let mut tell = |path: String, message: String, hint: &str| {
            let hint = (!hint.is_empty()).then(|| hint.to_owned());
            if faults.len() < TOLD {
                faults.push(Diagnostic { severity: Severity::Error, place: None, path, message, hint });
            }
        };
        let (vertices, triangles) = (self.positions.len(), self.triangles.len());
        for (field, length) in [("positions", vertices), ("triangles", triangles)] {
            if length == 0 {
                tell(field.into(), "there are none".into(), "a mesh has positions and triangles");
            }
        }
        let of_set = |set: usize| if self.uvs.len() == 1 { "uvs".to_owned() } else { format!("uvs[{set}]") };
        let mut tell_length = |field: String, length: usize, hint: &str| {
            if length != vertices {
                tell(field, format!("{length} of them for {vertices} positions"), hint);
            }
        };
        for (field, length) in
            [("normals", self.normals.len()), ("tangents", self.tangents.len()), ("colors", self.colors.len())]
        {
            if length != 0 {
                tell_length(field.into(), length, "give one for each vertex, or none");
            }
        }
        for (set, uvs) in self.uvs.iter().enumerate() {
            tell_length(of_set(set), uvs.len(), "give one for each vertex");
        }
        let (origin, used) = (DVec3::from(self.origin), self.used_vertices());
        let is_used = |i: usize| used.get(i).is_none_or(|used| *used);
        for (i, position) in self.positions.iter().enumerate().filter(|(i, _)| is_used(*i)) {
            let place = DVec3::from(position.map(f64::from)) + origin;
            if !(place.abs().max_element() <= MAX_COORDINATE && place.is_finite()) {
                let message = format!("{} is outside [-2.5e8, 2.5e8]", crate::context::show(&place.to_array()));
                tell(format!("positions[{i}]"), message, "coordinates are in metres");
            }
        }
        for (i, triangle) in self.triangles.iter().enumerate() {
            if let Some(wrong) = triangle.iter().find(|v| **v as usize >= vertices) {
                let message = format!("there is no vertex {wrong}: there are {vertices}, counted from 0");
                tell(format!("triangles[{i}]"), message, "");
            }
        }
        for (i, [r, g, b, _]) in self.colors.iter().enumerate().filter(|(i, _)| is_used(*i)) {
            if ![r, g, b].into_iter().all(|c| (0.0..=MAX_COLOR).contains(c)) {
                let message = format!("[{r}, {g}, {b}] is outside [0, 1e6]");
                tell(format!("colors[{i}]"), message, "a colour is linear red, green, blue");
            }
        }
        for (i, normal) in self.normals.iter().enumerate().filter(|(i, _)| is_used(*i)) {
            if !normal.iter().all(|c| c.abs() <= 1e30) {
                tell(format!("normals[{i}]"), format!("{normal:?} is outside [-1e30, 1e30]"), "");
            }
        }
        for (set, uvs) in self.uvs.iter().enumerate() {
            for (i, uv) in uvs.iter().enumerate().filter(|(i, _)| is_used(*i)) {
                if !uv.iter().all(|c| c.abs() <= 1e30) {
                    tell(format!("{}[{i}]", of_set(set)), format!("{uv:?} is outside [-1e30, 1e30]"), "");
                }
            }
        }
        if let (true, Some(fault)) = (faults.is_empty(), self.fault()) {
            faults.push(Diagnostic {
                severity: Severity::Error,
                place: None,
                path: String::new(),
                message: fault,
                hint: None,
            });
        }
        faults
    }

    /// BLAKE3 of all that a scene sees of it.
    pub(crate) fn content(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        let mut list = |numbers: &mut dyn Iterator<Item = [u8; 4]>| {
            // In pieces, each large enough for the hash to be fast
            let mut piece = Vec::with_capacity(1 << 16);
            let mut count = 0u64;
            for number in numbers {
                piece.extend(number);
                count += 1;
                if piece.len() >= 1 << 16 {
                    hasher.update(&piece);
                    piece.clear();
                }
            }
            hasher.update(&piece).update(&count.to_le_bytes());
        };
        list(&mut self.positions.iter().flatten().map(|c| c.to_le_bytes()));
        list(&mut self.normals.iter().flatten().map(|c| c.to_le_bytes()));
        for set in &self.uvs {
            list(&mut set.iter().flatten().map(|c| c.to_le_bytes()));
        }
        list(&mut self.colors.iter().flatten().map(|c| c.to_le_bytes()));
        list(&mut self.radii.iter().map(|c| c.to_le_bytes()));
        list(&mut self.triangles.iter().flatten().map(|c| c.to_le_bytes()));
        list(&mut self.face_materials.iter().map(|c| c.to_le_bytes()));
        list(&mut self.smoothing.iter().map(|c| c.to_le_bytes()));
        if !self.tangents.is_empty() {
            list(&mut self.tangents.iter().flatten().map(|c| c.to_le_bytes()));
        }
        for name in &self.materials {
            hasher.update(&(name.len() as u64).to_le_bytes()).update(name.as_bytes());
        }
        hasher.update(&(self.uvs.len() as u64).to_le_bytes());
        for c in self.origin {
            hasher.update(&c.to_le_bytes());
        }
        *hasher.finalize().as_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> MeshData {
        let mut mesh = MeshData { triangles: vec![[0, 1, 2]], ..MeshData::default() };
        mesh.set_positions(3, |i| [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]][i]);
        mesh
    }

    #[test]
    fn faults_have_their_places() {
        assert_eq!(triangle().faults(), []);
        let mut mesh = triangle();
        mesh.triangles.push([0, 1, 3]);
        mesh.positions[1][2] = f32::NAN;
        mesh.normals = vec![[0.0, 0.0, 1.0]; 2];
        mesh.uvs = vec![vec![[f32::INFINITY, 0.0]; 3]];
        mesh.colors = vec![[-1.0, 0.0, 0.0, 1.0]; 3];
        let paths: Vec<String> = mesh.faults().into_iter().map(|fault| fault.path).collect();
        let expected = ["normals", "positions[1]", "triangles[1]", "colors[0]", "colors[1]", "colors[2]"];
        assert_eq!(paths[..6], expected);
        assert_eq!(paths[6..], ["uvs[0]", "uvs[1]", "uvs[2]"]);
        assert_eq!(MeshData::default().faults().len(), 2);
        // Each of several sets has a place of its own
        let mut sets = triangle();
        sets.uvs = vec![vec![[0.0; 2]; 3], vec![[0.0; 2]; 2], vec![[0.0, f32::NAN]; 3]];
        let paths: Vec<String> = sets.faults().into_iter().map(|fault| fault.path).collect();
        assert_eq!(paths, ["uvs[1]", "uvs[2][0]", "uvs[2][1]", "uvs[2][2]"]);
        // What no triangle has may hold anything
        let mut unused = triangle();
        unused.positions.extend([[f32::NAN; 3], [1e30; 3]]);
        unused.colors = vec![[0.5; 4]; 3];
        unused.colors.extend([[-1.0; 4], [f32::INFINITY; 4]]);
        assert_eq!(unused.faults(), []);
        mesh.triangles = vec![[9; 3]; 1000];
        assert_eq!(mesh.faults().len(), TOLD);
    }

    #[test]
    fn far_positions_keep_what_is_small() {
        let mut mesh = triangle();
        mesh.set_positions(2, |i| [4e6 + 0.001 * i as f64, 1.0, 2.0]);
        let places: Vec<f64> = mesh.positions.iter().map(|p| f64::from(p[0]) + mesh.origin[0]).collect();
        assert!((places[1] - places[0] - 0.001).abs() < 1e-6, "{places:?}");
    }

    #[test]
    fn what_no_triangle_has_does_not_move_the_origin() {
        let at = |i: usize| [[4e6, 0.0, 0.0], [4e6 + 1.0, 0.0, 0.0], [4e6, 1.0, 0.0], [0.0; 3], [f64::NAN; 3]][i];
        let mut mesh = MeshData { triangles: vec![[0, 1, 2]], ..MeshData::default() };
        mesh.set_positions(5, at);
        assert!((mesh.origin[0] - 4e6).abs() <= 1.0, "{:?}", mesh.origin);
        assert_eq!(mesh.faults(), []);
    }

    #[test]
    fn content_tells_meshes_apart() {
        let (one, mut other) = (triangle(), triangle());
        assert_eq!(one.content(), other.content());
        other.origin[0] = 1.0;
        assert_ne!(one.content(), other.content());
        let mut other = triangle();
        other.normals = other.positions.clone();
        other.positions.clear();
        assert_ne!(one.content(), other.content());
    }
}

//! The tree against asking every triangle, and closed meshes against rays through their seams.

use super::*;
use crate::accel::SimdLevel;

/// One type of filter for all tests: each has its own code for each processor level.
type Filter = fn(u32) -> bool;

const ALL: &Filter = &((|_| true) as Filter);

fn some(triangle: u32) -> bool {
    triangle % 3 != 1
}

/// Numbers that look random.
struct Random(firstlight_testkit::Random);

impl Random {
    fn new(seed: u64) -> Self {
        Random(firstlight_testkit::Random::new(seed))
    }

    fn next(&mut self) -> u32 {
        (self.0.bits() >> 32) as u32
    }

    /// From -1 to 1.
    fn signed(&mut self) -> f32 {
        (self.next() & 0xff_ffff) as f32 / 8_388_608.0 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}

#[derive(Clone)]
struct Mesh {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn tree(&self) -> TriangleTree {
        TriangleTree::build(&self.positions, &self.triangles)
    }

    fn map(mut self, f: impl Fn(Vec3) -> Vec3) -> Self {
        for p in &mut self.positions {
            *p = f(Vec3::from_array(*p)).to_array();
        }
        self
    }

    /// Triangles of about this size, and of these proportions, anywhere in a cube.
    fn soup(count: u32, size: Vec3, random: &mut Random) -> Self {
        let mut mesh = Mesh { positions: Vec::new(), triangles: Vec::new() };
        for i in 0..count {
            let center = random.vector();
            for _ in 0..3 {
                mesh.positions.push((center + random.vector() * size).to_array());
            }
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        mesh
    }

    /// A closed sphere of radius 1 around the origin: `n` rings of `n`, without sines.
    fn sphere(n: u32) -> Self {
        let around = |i: u32, n: u32| {
            // On a square, then on the circle
            let s = 4.0 * i as f32 / n as f32;
            let (x, y) = match s as u32 {
                0 => (1.0 - s, s),
                1 => (1.0 - s, 2.0 - s),
                2 => (s - 3.0, 2.0 - s),
                _ => (s - 3.0, s - 4.0),
            };
            let length = (x * x + y * y).sqrt();
            (x / length, y / length)
        };
        let mut mesh = Mesh { positions: vec![[0.0, 1.0, 0.0]], triangles: Vec::new() };
        for ring in 1..n {
            let (cos, sin) = around(ring, 2 * n);
            for i in 0..n {
                let (x, z) = around(i, n);
                mesh.positions.push([x * sin, cos, z * sin]);
            }
        }
        let last = mesh.positions.len() as u32;
        mesh.positions.push([0.0, -1.0, 0.0]);
        let at = |ring: u32, i: u32| match ring {
            0 => 0,
            ring if ring == n => last,
            ring => 1 + (ring - 1) * n + i % n,
        };
        for ring in 0..n {
            for i in 0..n {
                let (a, b, c, d) = (at(ring, i), at(ring, i + 1), at(ring + 1, i), at(ring + 1, i + 1));
                mesh.triangles.extend(
                    [[a, b, c], [b, d, c]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]),
                );
            }
        }
        mesh
    }

    /// Squares in a plane, cut in two, which axis-parallel rays meet on their seams.
    fn grid(n: u32) -> Self {
        let mut mesh = Mesh { positions: Vec::new(), triangles: Vec::new() };
        for j in 0..=n {
            for i in 0..=n {
                mesh.positions.push([i as f32 - n as f32 / 2.0, 0.0, j as f32 - n as f32 / 2.0]);
            }
        }
        for j in 0..n {
            for i in 0..n {
                let a = j * (n + 1) + i;
                mesh.triangles.extend([[a, a + n + 1, a + 1], [a + 1, a + n + 1, a + n + 2]]);
            }
        }
        mesh
    }
}

/// All ways of asking, on every processor level, against every triangle in turn. Rays come in tiles of 64.
fn check(mesh: &Mesh, tiles: &[RayTile], t_max: f32) -> usize {
    let tree = mesh.tree();
    let mut hits = 0;
    let filters: [&Filter; 2] = [ALL, &(some as Filter)];
    for (rays, filter) in tiles.iter().flat_map(|tile| filters.map(|filter| (tile, filter))) {
        let expected: Vec<_> = (0..64).map(|i| tree.brute_force(&rays.ray(i), t_max, filter)).collect();
        hits += expected.iter().flatten().count();
        for level in SimdLevel::available() {
            let level = level.token();
            let mut found = TileHits::new(t_max);
            let mask = tree.tile_at(level, rays, u64::MAX, 7, &mut found, filter);
            for (i, expected) in expected.iter().enumerate() {
                let ray = rays.ray(i);
                assert_eq!(tree.closest_at(level, &ray, t_max, filter), *expected, "closest, {ray:?}");
                assert_eq!(tree.any_at(level, &ray, t_max, filter), expected.is_some(), "any, {ray:?}");
                assert_eq!(found.get(i), *expected, "tile, {ray:?}");
                assert_eq!(mask >> i & 1 == 1, expected.is_some());
            }
            for block in 0..4 {
                let mut packet = RayPacket16::ZERO;
                let mut want = 0;
                for i in 0..16 {
                    packet.set(i, rays.o(16 * block + i), rays.d(16 * block + i));
                    want |= u16::from(expected[16 * block + i].is_some()) << i;
                }
                assert_eq!(tree.any16_at(level, &packet, &[t_max; 16], 0xffff, filter), want, "any16, {block}");
                assert_eq!(tree.any16_at(level, &packet, &[t_max; 16], 0x0ff0, filter), want & 0x0ff0);
            }
        }
    }
    hits
}

/// Rays of all kinds around a place: from one point, to one point, parallel, along axes, anyhow.
fn tiles(count: usize, center: Vec3, size: f32, random: &mut Random) -> Vec<RayTile> {
    let mut tiles = Vec::new();
    for kind in 0..count {
        let mut tile = RayTile::ZERO;
        let (a, b) = (random.vector() * 3.0, random.vector() * 0.5);
        let spread = [0.01, 0.1, 1.0][kind % 3];
        for i in 0..64 {
            let c = random.vector() * spread;
            let (o, d) = match kind % 7 {
                0 | 1 => (a, b + c - a),
                2 => (a + c, b - a - c),
                3 => (a + c, b - a),
                4 => (Vec3::new((a.x * 4.0).round() * 0.25, a.y, i as f32 * 0.25 - 8.0), Vec3::NEG_Y * a.y.signum()),
                5 => (a + c, Vec3::new(c.x, 1e-20, 0.0)),
                _ => (random.vector() * 2.0, random.vector()),
            };
            tile.set(i, center + o * size, d * size);
        }
        tiles.push(tile);
    }
    // And some that meet nothing
    if let Some(tile) = tiles.last_mut() {
        tile.set(3, Vec3::ZERO, Vec3::ZERO);
        tile.set(4, Vec3::NAN, Vec3::X);
        tile.set(5, Vec3::ZERO, Vec3::new(f32::INFINITY, 1.0, 1.0));
        tile.set(6, Vec3::ZERO, Vec3::new(f32::NAN, 1.0, 1.0));
    }
    tiles
}

/// Rays to points of triangles, corners and edges among them, from one point or from many.
fn aimed(mesh: &Mesh, from_one: bool, random: &mut Random) -> RayTile {
    let mut tile = RayTile::ZERO;
    let from = random.vector() * 3.0;
    for i in 0..64 {
        let triangle = mesh.triangles[random.next() as usize % mesh.triangles.len()];
        let [a, b, c] = triangle.map(|v| Vec3::from_array(mesh.positions[v as usize]));
        let (u, v) = [(random.signed() * 0.2 + 0.3, 0.3), (0.5, 0.5), (0.0, 1.0), (0.25, 0.0)][i % 4];
        let o = if from_one { from } else { random.vector() * 2.0 };
        tile.set(i, o, a + (b - a) * u + (c - a) * v - o);
    }
    tile
}

/// The number of rays for which a mesh's tree is compared with brute force: `FIRSTLIGHT_RAYS`, or 2000.
fn rays_a_mesh() -> usize {
    std::env::var("FIRSTLIGHT_RAYS").ok().and_then(|rays| rays.parse().ok()).unwrap_or(2_000)
}

impl Mesh {
    fn new(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Mesh { positions, triangles }
    }

    /// The files that come with the tests.
    fn models() -> Vec<(String, Self)> {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/models");
        let mut folders: Vec<_> = ["ply", "stl", "obj"].iter().map(|folder| root.join(folder)).collect();
        let mut files = Vec::new();
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(&folder).expect("the folder comes with the tests") {
                let path = entry.expect("it can be listed").path();
                match path.extension().and_then(|ending| ending.to_str()) {
                    _ if path.is_dir() => folders.push(path),
                    Some("ply" | "stl" | "obj") => files.push(path),
                    _ => {}
                }
            }
        }
        files.sort();
        let read = |path: &std::path::PathBuf| {
            let (name, bytes) = (path.display().to_string(), std::fs::read(path).expect("it can be read"));
            let data = crate::import::read_mesh(&name, &bytes, &|_, _| std::ops::ControlFlow::Continue(()));
            let data = data.unwrap_or_else(|error| panic!("{name}: {error}"));
            (name, Mesh::new(data.positions, data.triangles))
        };
        files.iter().map(read).filter(|(_, mesh)| !mesh.triangles.is_empty()).collect()
    }

    /// Both, the triangles of `other` after its own.
    fn with(mut self, other: Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|v| v + first)));
        self
    }

    /// A closed sphere that is not round.
    fn bumpy(n: u32, height: f32, random: &mut Random) -> Self {
        let mut ball = Mesh::sphere(n);
        for p in &mut ball.positions {
            *p = (Vec3::from_array(*p) * (1.0 + height * random.signed())).to_array();
        }
        ball
    }

    fn cuboid(size: Vec3) -> Self {
        let corner = |i: u32| {
            let bit = |k: u32| (i >> k & 1) as f32 - 0.5;
            (Vec3::new(bit(0), bit(1), bit(2)) * size).to_array()
        };
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        Mesh::new((0..8).map(corner).collect(), triangles)
    }

    /// Triangles around one vertex, a cone of this height.
    fn fan(n: u32, height: f32) -> Self {
        let ring = Mesh::sphere(n).positions[1 + (n / 2 - 1) as usize * n as usize..][..n as usize].to_vec();
        let mut fan = Mesh::new(vec![[0.0, height, 0.0]], Vec::new());
        fan.positions.extend(ring);
        fan.triangles.extend((0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]));
        fan
    }

    /// Meshes within meshes, the smallest last.
    fn shells(count: u32, n: u32) -> Self {
        let shell = |i: u32| Mesh::sphere(n).map(|p| p * (1.0 - i as f32 / count as f32));
        (1..count).fold(shell(0), |shells, i| shells.with(shell(i)))
    }

    /// Whole, broken and worse.
    fn zoo() -> Vec<(String, Self)> {
        let mut random = Random::new(17);
        let random = &mut random;
        let mut zoo = Mesh::models();
        let mut add = |name: &str, mesh: Mesh| zoo.push((name.to_owned(), mesh));
        // What people build
        for n in [3, 4, 8, 16, 38] {
            add(&format!("sphere {n}"), Mesh::sphere(n));
        }
        for n in [1, 7, 32] {
            add(&format!("grid {n}"), Mesh::grid(n));
        }
        for (n, height) in [(6, 0.5), (12, 0.3), (24, 0.1), (30, 0.9), (60, 0.02)] {
            add(&format!("bumpy ball {n} {height}"), Mesh::bumpy(n, height, random));
        }
        for (count, size) in [(1, 1.0), (3, 1.0), (30, 3.0), (300, 0.3), (2500, 0.05), (2500, 1.0)] {
            add(&format!("soup {count} {size}"), Mesh::soup(count, Vec3::splat(size), random));
        }
        add("cube", Mesh::cuboid(Vec3::ONE));
        add("pane", Mesh::cuboid(Vec3::new(2.0, 1e-6, 2.0)));
        add("rod", Mesh::cuboid(Vec3::new(1e-5, 2.0, 1e-5)));
        add("fan", Mesh::fan(64, 1.0));
        add("flat fan", Mesh::fan(100, 0.0));
        add("needle fan", Mesh::fan(40, 1e4));
        add("shells", Mesh::shells(8, 12));
        add("close shells", Mesh::sphere(16).with(Mesh::sphere(16).map(|p| p * (1.0 + f32::EPSILON))));
        // What should not be
        for (name, size) in
            [("needles", [1.0, 1e-5, 1e-5]), ("slivers", [1.0, 1e-7, 0.0]), ("hairs", [1.0, 1e-30, 1e-38])]
        {
            add(name, Mesh::soup(300, Vec3::from(size), random));
        }
        let twice = Mesh::bumpy(12, 0.2, random);
        add("everything twice", twice.clone().with(twice.clone()));
        let mut turned = twice.clone();
        turned.triangles.iter_mut().for_each(|triangle| triangle.reverse());
        add("and its back", twice.clone().with(turned));
        add("one triangle often", Mesh::new(vec![[-1.0; 3], [1.0, 0.0, 0.5], [0.0, 1.0, -0.5]], vec![[0, 1, 2]; 500]));
        let mut pointless = twice.clone();
        pointless.triangles.extend((0..40).flat_map(|i| [[i, i, i + 1], [i, i + 1, i]]));
        add("zero area", pointless);
        add("lines only", Mesh::new(vec![[0.0; 3], [1.0; 3], [2.0; 3]], vec![[0, 1, 2], [2, 1, 0], [1, 1, 1]]));
        let mut nowhere = twice.clone();
        for (i, bad) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::NAN].into_iter().enumerate() {
            nowhere.positions[7 * i + 2][i % 3] = bad;
        }
        add("vertices nowhere", nowhere);
        add("in one plane", Mesh::soup(400, Vec3::splat(0.2), random).map(|p| Vec3::new(p.x, 0.25, p.z)));
        let aslant = |p: Vec3| Vec3::new(p.x, p.y, 0.3 * p.x - 0.7 * p.y);
        add("in a plane aslant", Mesh::soup(400, Vec3::splat(0.2), random).map(aslant));
        add("steps", Mesh::soup(400, Vec3::splat(0.5), random).map(|p| (p * 4.0).round() * 0.25));
        let mut far = twice.clone();
        far.positions.push([1e30, 1e30, -1e30]);
        far.triangles.push([0, 5, 145 % far.positions.len() as u32]);
        add("a corner far out", far);
        add("thin and huge", Mesh::soup(50, Vec3::new(1e6, 1e-6, 1.0), random));
        // Anywhere, of any size
        let places =
            [("far", FAR, 1.0), ("tiny", Vec3::ZERO, 1e-6), ("huge", Vec3::ZERO, 1e6), ("far and small", FAR, 0.5)];
        for (name, center, size) in places {
            let soup = Mesh::soup(200, Vec3::splat(0.3), random);
            for (kind, mesh) in [("ball", twice.clone()), ("cube", Mesh::cuboid(Vec3::ONE)), ("soup", soup)] {
                add(&format!("{name} {kind}"), mesh.map(|p| center + p * size));
            }
        }
        zoo
    }

    /// The box around its finite corners: middle and half its greatest side.
    fn extent(&self) -> (Vec3, f32) {
        let finite = self.positions.iter().map(|p| Vec3::from_array(*p)).filter(|p| p.is_finite());
        let (low, high) = finite.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        ((low + high) * 0.5, ((high - low).max_element() * 0.5).max(1e-30))
    }

    /// A ray of some kind, as hard as it can be: through corners, along edges, in planes.
    fn ray(&self, kind: usize, random: &mut Random) -> TraceRay {
        let (center, size) = self.extent();
        let triangle = self.triangles[random.next() as usize % self.triangles.len()];
        let [a, b, c] = triangle.map(|v| Vec3::from_array(self.positions[v as usize]));
        let outside = center + random.vector().normalize_or(Vec3::X) * (2.5 * size);
        let inside = center + random.vector() * (0.4 * size);
        let (s, r) = (random.signed(), random.signed());
        let on = a + (b - a) * (0.5 + 0.6 * s) + (c - a) * (0.5 + 0.6 * r);
        let axis = Vec3::AXES[random.next() as usize % 3] * if random.next() & 1 == 0 { 1.0 } else { -1.0 };
        let (o, d) = match kind % 12 {
            0 => (outside, center + random.vector() * size - outside),
            1 => (inside, random.vector()),
            // At corners and the middles of edges
            2 => (outside, a - outside),
            3 => (inside, b - inside),
            4 => (outside, (a + b) * 0.5 - outside),
            5 => (inside, on - inside),
            // Along an edge, and starting on it
            6 => (a - (b - a) * (1.0 + s), b - a),
            7 => (a + (b - a) * (0.5 + 0.5 * s), random.vector()),
            // Along an axis, through a corner or anywhere
            8 => (a - axis * (3.0 * size), axis),
            9 => (on - axis * (3.0 * size), axis * size),
            // In the plane of a triangle, or nearly
            10 => (on - (c - b) * 4.0, c - b),
            _ => (outside, on + (c - a) * (1e-3 * s) - outside),
        };
        TraceRay::new(o, d)
    }
}

/// The bits of a hit.
fn exact(hit: Option<TriangleHit>) -> Option<[u32; 4]> {
    hit.map(|hit| [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.triangle])
}

#[test]
fn a_zoo_of_meshes_equals_brute_force() {
    use rayon::prelude::*;
    let zoo = Mesh::zoo();
    assert!(zoo.len() >= 50, "{}", zoo.len());
    let hits: Vec<(&str, usize)> = zoo
        .par_iter()
        .enumerate()
        .map(|(number, (name, mesh))| {
            let tree = mesh.tree();
            let mut random = Random::new(1000 + number as u64);
            // Large ones are asked less often
            let rays = (rays_a_mesh() * 3000 / mesh.triangles.len().max(3000)).max(128);
            let mut hits = 0;
            for block in 0..rays.div_ceil(64) {
                let rays = [0; 64].map(|_| mesh.ray(random.next() as usize, &mut random));
                let mut tile = RayTile::ZERO;
                for (i, ray) in rays.iter().enumerate() {
                    tile.set(i, ray.o, ray.d);
                }
                let mut found = TileHits::new(f32::INFINITY);
                tree.tile_at(Level::new(), &tile, u64::MAX, 0, &mut found, ALL);
                for (i, ray) in rays.iter().enumerate() {
                    let expected = tree.brute_force(ray, f32::INFINITY, ALL);
                    hits += usize::from(expected.is_some());
                    let closest = tree.closest_at(Level::new(), ray, f32::INFINITY, ALL);
                    assert_eq!(exact(closest), exact(expected), "{name}, ray {i} of {block}: {ray:?}");
                    assert_eq!(exact(found.get(i)), exact(expected), "tile of {name}, ray {i} of {block}: {ray:?}");
                    // As far as the hit, it is there; to just before it, there is nothing
                    let t = expected.map_or(f32::INFINITY, |hit| hit.t);
                    assert_eq!(tree.any_at(Level::new(), ray, t, ALL), expected.is_some(), "any, {name}: {ray:?}");
                    assert!(!tree.any_at(Level::new(), ray, t.next_down(), ALL), "any before it, {name}: {ray:?}");
                }
            }
            (name.as_str(), hits)
        })
        .collect();
    let met = hits.iter().filter(|(_, hits)| *hits > 20).count();
    assert!(met > 50, "only {met} meshes are met at all: {hits:?}");
}

const FAR: Vec3 = Vec3::new(148_376.0, 1234.0, -223_423.0);

#[test]
fn every_way_of_asking_equals_brute_force() {
    let mut random = Random::new(1);
    let random = &mut random;
    let meshes = [
        Mesh::soup(1000, Vec3::splat(0.1), random),
        Mesh::soup(60, Vec3::splat(2.0), random),
        Mesh::soup(700, Vec3::new(1.0, 1e-4, 1e-4), random),
        Mesh::soup(500, Vec3::new(1.0, 1e-7, 0.0), random),
        Mesh::sphere(20),
        Mesh::grid(24),
    ];
    for (i, mesh) in meshes.into_iter().enumerate() {
        let mut tiles = tiles(14, Vec3::ZERO, 1.0, random);
        tiles.extend((0..8).map(|i| aimed(&mesh, i % 2 == 0, random)));
        let hits = check(&mesh, &tiles, f32::INFINITY);
        assert!(hits > 100, "mesh {i}: {hits}");
        check(&mesh, &tiles[..7], 0.75);
    }
}

#[test]
fn scale_and_place_do_not_matter() {
    let mut random = Random::new(2);
    for (center, size) in [(FAR, 1.0), (Vec3::ZERO, 1e-6), (Vec3::ZERO, 1e6), (FAR, 1000.0)] {
        for mesh in [Mesh::soup(600, Vec3::splat(0.2), &mut random), Mesh::sphere(16)] {
            let mesh = mesh.map(|p| center + p * size);
            let hits = check(&mesh, &tiles(14, center, size, &mut random), f32::INFINITY);
            assert!(hits > 50, "{hits}");
        }
    }
}

#[test]
fn what_has_no_area_or_no_place_is_left_out() {
    let mut random = Random::new(3);
    let mut mesh = Mesh::soup(50, Vec3::splat(0.5), &mut random);
    mesh.positions[0] = [f32::NAN, 0.0, 0.0];
    mesh.positions[4] = [0.0, f32::INFINITY, 0.0];
    mesh.positions[8] = mesh.positions[7];
    (mesh.positions[9], mesh.positions[10], mesh.positions[11]) = ([0.0; 3], [1.0; 3], [3.0; 3]);
    mesh.triangles[4] = [12, 13, 10_000];
    let tree = mesh.tree();
    assert_eq!(tree.len(), 45);
    check(&mesh, &tiles(14, Vec3::ZERO, 1.0, &mut random), f32::INFINITY);
    let empty = TriangleTree::build(&[], &[]);
    assert_eq!((empty.len(), empty.bounds()), (0, Aabb::EMPTY));
    assert_eq!(empty.closest_at(Level::new(), &TraceRay::new(Vec3::ZERO, Vec3::X), 1.0, ALL), None);
    let one = Mesh { positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], triangles: vec![[0, 1, 2]] };
    let hit = one.tree().closest_at(Level::new(), &TraceRay::new(Vec3::new(0.25, 0.5, 2.0), -Vec3::Z), 2.0, ALL);
    assert_eq!(hit, Some(TriangleHit { t: 2.0, u: 0.25, v: 0.5, triangle: 0 }));
}

#[test]
fn a_closed_mesh_has_no_holes() {
    let sphere = Mesh::sphere(100);
    let middle = |a: Vec3, b: Vec3| (a + b) * 0.5;
    let places = [(Vec3::ZERO, 1.0), (FAR, 1.0), (Vec3::ZERO, 1e-6), (Vec3::ZERO, 1e6)];
    for (round, (center, size)) in places.into_iter().enumerate() {
        let mesh = Mesh { positions: sphere.positions.clone(), triangles: sphere.triangles.clone() };
        let mesh = mesh.map(|p| center + p * size);
        let tree = mesh.tree();
        let corner = |v: u32| Vec3::from_array(mesh.positions[v as usize]);
        // Each vertex, and the middle of each edge, from inside and from outside
        let mut targets: Vec<Vec3> = mesh.positions.iter().map(|p| Vec3::from_array(*p)).collect();
        targets.extend(mesh.triangles.iter().map(|t| middle(corner(t[0]), corner(t[1]))));
        targets.extend(mesh.triangles.iter().map(|t| middle(corner(t[1]), corner(t[2]))));
        let mut random = Random::new(round as u64);
        // And anywhere, so that there are 200,000 rays from each place, or ten million
        let wanted = (rays_a_mesh() / 20).clamp(100, 5_000) * 1000;
        let more = wanted.saturating_sub(targets.len());
        let mut spot = Vec3::ZERO;
        targets.extend((0..more).map(|i| {
            // A tile's worth around each spot
            if i % 64 == 0 {
                spot = random.vector() * (0.5 * size);
            }
            center + spot + random.vector() * (0.05 * size)
        }));
        let inside = center + Vec3::new(0.11, -0.07, 0.05) * size;
        let outside = center + Vec3::new(1.3, 2.1, -1.7) * size;
        for (targets, o) in targets.chunks(64).flat_map(|targets| [(targets, inside), (targets, outside)]) {
            let mut tile = RayTile::ZERO;
            for i in 0..64 {
                tile.set(i, o, targets[i % targets.len()] - o);
            }
            let mut found = TileHits::new(f32::INFINITY);
            let missed = !tree.tile_at(Level::new(), &tile, u64::MAX, 0, &mut found, ALL);
            for i in bits(missed) {
                // From outside, rays to the outline may pass by
                let (from, d) = (o - center, tile.d(i));
                let across = from.cross(d).length() / d.length();
                assert!(o == outside && across > 0.97 * size, "{:?} from {o}: {across}", tile.ray(i));
                assert_eq!(tree.closest_at(Level::new(), &tile.ray(i), f32::INFINITY, ALL), None);
            }
        }
    }
}

#[test]
fn the_tree_does_not_depend_on_the_number_of_threads() {
    let mut random = Random::new(5);
    let mesh = Mesh::soup(100_000, Vec3::splat(0.02), &mut random);
    let fingerprint = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be had");
        let tree = pool.install(|| mesh.tree());
        let mut hasher = blake3::Hasher::new();
        for node in &tree.tree.nodes {
            for plane in node.planes.iter().flatten().flatten() {
                hasher.update(&plane.to_ne_bytes());
            }
            for child in node.children {
                hasher.update(&child.to_ne_bytes());
            }
        }
        for id in tree.packs.iter().flat_map(|pack| pack.ids) {
            hasher.update(&id.to_ne_bytes());
        }
        hasher.finalize()
    };
    assert!(fingerprint(1) == fingerprint(2) && fingerprint(1) == fingerprint(8));
}

#[test]
fn a_million_triangles_in_one_place() {
    let mesh =
        Mesh { positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], triangles: vec![[0, 1, 2]; 1_000_000] };
    let tree = mesh.tree();
    let ray = TraceRay::new(Vec3::new(0.25, 0.25, 1.0), -Vec3::Z);
    let hit = tree.closest_at(Level::new(), &ray, f32::INFINITY, ALL);
    assert_eq!(hit, Some(TriangleHit { t: 1.0, u: 0.25, v: 0.25, triangle: 0 }));
    assert!(tree.any_at(Level::new(), &ray, f32::INFINITY, ALL));
    // One leaf is enough
    assert!(tree.len() <= PACK && tree.bytes() < 10_000, "{} in {} bytes", tree.len(), tree.bytes());
    // What rays treat differently is kept: the first of each class
    let by_class = |id: u32| if id < 1000 { 0 } else { 1 + id % 3 };
    let tree = TriangleTree::build_distinct(&mesh.positions, &mesh.triangles, by_class);
    for (filter, first) in [(&(|_| true) as &dyn Fn(u32) -> bool, 0), (&|id| id >= 1000 && id % 3 == 2, 1001)] {
        let hit = tree.closest_at(Level::new(), &ray, f32::INFINITY, &|id| filter(id));
        assert_eq!(hit.map(|hit| hit.triangle), Some(first));
    }
    // Copies of several triangles, some of them turned, are as many as there are different ones
    let corners = [[0, 1, 2], [1, 2, 0], [2, 1, 0]];
    let mixed = Mesh { triangles: (0..30_000).map(|i| corners[i % 3]).collect(), ..mesh };
    assert_eq!(mixed.tree().len(), 3);
}

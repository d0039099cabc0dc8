//! Point sets: millions of spheres with radii and colours.

use std::sync::Arc;

use fearless_simd::Simd;

use super::ball::ball_tangents;
use super::cache::{MeshFiles, key_of};
use super::common::shape_table;
use super::mesh::{parse_mesh_file, read_mesh_bytes};
use super::placement::Placement;
use super::solid::LineLanes;
use super::sphere::{SphereUv, equirectangular};
use super::surface::{Footprint, RayDifferential, ShapePoint, UvEdge};
use crate::accel::{Aabb, Bvh, TraceRay};
use crate::color::Rgb;
use crate::context::{Assets, CompileContext, show};
use crate::describe::FilePath;
use crate::import::{MeshData, from_own_origin};
use crate::math::{DRay, DVec3, ErrorBound, Ray, Vec3};
use crate::parallel;

shape_table! {
    /// Spheres by the million: the vertices of a PLY file, or written out.
    ///
    /// The radius of each is the file's property `radius`, or the list `radii`, or `radius` for all; where nothing says
    /// it, it is 0.7 times the distance to the fourth nearest point, by the median of some. Colours multiply the
    /// material's diffuse, ambient and base colours. All spheres of a set have one id; which of them was hit is the
    /// number of the primitive. Spheres without a finite centre and a radius above 0 are left out.
    ///
    /// ```toml
    /// [[point_set]]
    /// file = "scan.ply"
    /// radius = 0.002
    /// ```
    pub struct PointSetDesc {
        /// A PLY file, relative to the text that names it; its faces, if it has any, are not looked at.
        pub file: Option<FilePath> = None,
        /// Instead of a file: the centres, in metres.
        pub positions: Vec<[f64; 3]> = Vec::new(),
        /// The radius of each position.
        pub radii: Vec<f64> = Vec::new(),
        /// The colour of each position, linear Rec. 709.
        pub colors: Vec<[f64; 3]> = Vec::new(),
        /// In metres, greater than 0: the radius of those that have none of their own. Without it, one is chosen by the
        /// spacing of the points, so that neighbours on a surface touch.
        pub radius: Option<f64> = None,
    }
}

/// Spheres in a space of their own.
pub(crate) struct PointSet {
    /// Centre and radius of each.
    spheres: Vec<[f32; 4]>,
    /// Empty, or one for each sphere.
    colors: Vec<[f32; 4]>,
    /// What was taken off every centre.
    origin: DVec3,
    tree: Bvh,
}

impl PointSetDesc {
    /// `None` after an error.
    pub(crate) fn compile(
        &self,
        cx: &mut CompileContext,
        assets: &dyn Assets,
        files: &mut MeshFiles<'_>,
    ) -> Option<Arc<PointSet>> {
        let before = cx.error_count();
        let radius = self.radius.map(|radius| cx.positive("radius", radius, "the radius is in metres"));
        // Where it was kept, with its tree
        let mut place = None;
        let data = match &self.file {
            Some(file) => {
                let lists =
                    [("positions", self.positions.len()), ("radii", self.radii.len()), ("colors", self.colors.len())];
                for (field, _) in lists.iter().filter(|(_, length)| *length > 0) {
                    cx.error(field, "it is said beside a file", Some("give the file, or the lists"));
                }
                let (bytes, hash) = read_mesh_bytes(cx, assets, file, files)?;
                let own = self.radius.map_or([0; 8], |radius| radius.to_bits().to_le_bytes());
                place = files.cache.map(|cache| (cache, key_of("points", [file.0.as_bytes(), &hash, &own])));
                let kept = place.and_then(|(cache, key)| cache.find(&key));
                if cx.error_count() == before && kept.is_some() {
                    return kept;
                }
                let mut data = parse_mesh_file(cx, file, &bytes)?;
                data.make_numbers_finite();
                data
            }
            None => self.written(cx),
        };
        if cx.error_count() > before {
            return None;
        }
        let radius = match radius {
            _ if !data.radii.is_empty() => ALONE,
            None => spacing(&data.positions, SAMPLED).map_or(ALONE, chosen_radius),
            Some(radius) => {
                if let Some(spacing) = spacing(&data.positions, SAMPLED / 4) {
                    advise_radius(cx, radius, spacing);
                }
                radius
            }
        };
        cx.advise_vertex_colors(&data.colors);
        // A sphere, a colour and a part of the tree
        const POINT_BYTES: u64 = 80;
        if !cx.take("file", "these points and their tree", POINT_BYTES * data.positions.len() as u64) {
            return None;
        }
        let points = Arc::new(PointSet::new(data, radius as f32));
        if let Some((cache, key)) = place {
            cache.keep(key, &points);
        }
        if points.bounds().is_none() && points.len() > 0 {
            let message = format!("none of its {} points has a finite place and a radius above 0", points.len());
            cx.advise("", message, Some("nothing of it can be seen"));
        }
        Some(points)
    }

    fn written(&self, cx: &mut CompileContext) -> MeshData {
        let points = self.positions.len();
        if points == 0 {
            cx.error(
                "file",
                "there is neither a file nor positions",
                Some("write `file = \"NAME.ply\"`, or positions"),
            );
        }
        for (i, position) in self.positions.iter().enumerate() {
            cx.point(&format!("positions[{i}]"), *position);
        }
        for (field, length) in [("radii", self.radii.len()), ("colors", self.colors.len())] {
            if length != 0 && length != points {
                let message = format!("{length} of them for {points} positions");
                cx.error(field, message, Some("give one for each position, or none"));
            }
        }
        for (i, radius) in self.radii.iter().enumerate() {
            cx.positive(&format!("radii[{i}]"), *radius, "radii are in metres");
        }
        for (i, color) in self.colors.iter().enumerate() {
            if !color.iter().all(|c| (0.0..=1e6).contains(c)) {
                let message = format!("{} is outside [0, 1e6]", show(color));
                cx.error(&format!("colors[{i}]"), message, Some("a colour is linear red, green, blue"));
            }
        }
        let (positions, origin) = from_own_origin(self.positions.len(), |_| true, |i| self.positions[i]);
        MeshData {
            positions,
            origin,
            radii: self.radii.iter().map(|r| *r as f32).collect(),
            colors: self.colors.iter().map(|c| [c[0] as f32, c[1] as f32, c[2] as f32, 1.0]).collect(),
            ..MeshData::default()
        }
    }
}

/// The radius of a point that has no neighbours, in metres.
const ALONE: f64 = 0.01;
/// Points whose neighbours are looked at.
const SAMPLED: usize = 64;
/// The neighbour that says how far apart points are. In a square grid the first four are as near, and points that lie
/// on a surface by chance have their fourth, in the mean, at 1.09 times the spacing of such a grid of as many.
const NEIGHBOUR: usize = 4;
/// A radius that is as many times the spacing of the points, or as small a part of it, is hardly meant.
const FAR_OFF: f64 = 20.0;

/// The radius for points so far apart: on a square grid spheres close all gaps from 0.71 on.
fn chosen_radius(spacing: f64) -> f64 {
    (0.7 * spacing).clamp(1e-9, 2.5e8)
}

/// How far apart points are: the median, over at most `sampled` of them, of the distance to the [`NEIGHBOUR`]th other
/// place, or the farthest where there are fewer. `None` if all are at one place.
fn spacing(positions: &[[f32; 3]], sampled: usize) -> Option<f64> {
    let sampled = sampled.min(positions.len());
    let samples: Vec<[f32; 3]> = (0..sampled).map(|i| positions[i * positions.len() / sampled]).collect();
    // Few samples at a time, so that a piece of the points is at hand for all of them
    let chunks: Vec<&[[f32; 3]]> = samples.chunks(16).collect();
    let nearest = parallel::collect(chunks.len(), |i| nearest(positions, chunks[i])).concat();
    let farthest = |squares: &[f32; NEIGHBOUR]| squares.iter().copied().filter(|s| s.is_finite()).reduce(f32::max);
    let mut squares: Vec<f32> = nearest.iter().filter_map(farthest).collect();
    squares.sort_by(f32::total_cmp);
    squares.get(squares.len() / 2).map(|square| f64::from(*square).sqrt())
}

/// The squares of the distances from each sample to the nearest other places, in rising order.
fn nearest(positions: &[[f32; 3]], samples: &[[f32; 3]]) -> Vec<[f32; NEIGHBOUR]> {
    let mut nearest = vec![[f32::INFINITY; NEIGHBOUR]; samples.len()];
    for piece in positions.chunks(1 << 12) {
        for ([x, y, z], nearest) in samples.iter().zip(&mut nearest) {
            for p in piece {
                let (dx, dy, dz) = (p[0] - x, p[1] - y, p[2] - z);
                let square = dx * dx + dy * dy + dz * dz;
                if square > 0.0 && square < nearest[NEIGHBOUR - 1] {
                    nearest[NEIGHBOUR - 1] = square;
                    nearest.sort_by(f32::total_cmp);
                }
            }
        }
    }
    nearest
}

/// Advises if a radius is far off the spacing of the points.
fn advise_radius(cx: &mut CompileContext, radius: f64, spacing: f64) {
    let message = match radius / spacing {
        times if times > FAR_OFF => format!("{radius} is {times:.0} times the distance of neighbouring points"),
        times if times < 1.0 / FAR_OFF => {
            format!("{radius} is a {:.0}th of the distance of neighbouring points", 1.0 / times)
        }
        _ => return,
    };
    let chosen = format!("without it, {:.2e} would be chosen, so that neighbours touch", chosen_radius(spacing));
    cx.advise("radius", message, Some(&chosen));
}

/// One sphere, in f64.
struct PointBall {
    c: DVec3,
    r: f64,
}

impl PointBall {
    /// Where the line of a ray enters and leaves, if it meets the ball; the ray's direction is of any length. See
    /// `Sphere::intersect` for the form.
    #[inline(always)]
    fn roots(&self, ray: &DRay) -> Option<[f64; 2]> {
        let (is_met, roots) = self.ends(ray);
        is_met.then_some(roots)
    }

    /// Whether either lies between 0 and `limit`. In lanes where many lines are asked.
    #[inline(always)]
    fn blocks(&self, ray: &DRay, limit: f64) -> bool {
        let (is_met, [enter, leave]) = self.ends(ray);
        let between = |t: f64| (t > 0.0) & (t < limit);
        is_met & (between(enter) | between(leave))
    }

    /// Whether there are [`roots`](Self::roots).
    #[inline(always)]
    fn is_met(&self, ray: &DRay) -> bool {
        let f = ray.o - self.c;
        self.discriminant(ray, f, -f.dot(ray.d), ray.d.length_squared()) >= 0.0
    }

    #[inline(always)]
    fn discriminant(&self, ray: &DRay, f: DVec3, b: f64, dd: f64) -> f64 {
        let nearest = f + ray.d * (b / dd);
        self.r * self.r - nearest.length_squared()
    }

    /// Whether there are [`roots`](Self::roots), and those.
    #[inline(always)]
    fn ends(&self, ray: &DRay) -> (bool, [f64; 2]) {
        let f = ray.o - self.c;
        let dd = ray.d.length_squared();
        let b = -f.dot(ray.d);
        let discriminant = self.discriminant(ray, f, b, dd);
        let root = (discriminant.max(0.0) * dd).sqrt();
        let product = f.length_squared() - self.r * self.r;
        let q = if b > 0.0 { b + root } else { b - root };
        let (one, other) = (product / q, q / dd);
        (discriminant >= 0.0, if b > 0.0 { [one, other] } else { [other, one] })
    }
}

impl PointSet {
    fn new(data: MeshData, radius: f32) -> Self {
        let sphere = |(i, p): (usize, &[f32; 3])| [p[0], p[1], p[2], data.radii.get(i).copied().unwrap_or(radius)];
        let spheres: Vec<[f32; 4]> = data.positions.iter().enumerate().map(sphere).collect();
        let nothing = Aabb { min: Vec3::splat(f32::NAN), max: Vec3::splat(f32::NAN) };
        let bounds = |[x, y, z, r]: &[f32; 4]| {
            let fine = x.abs().max(y.abs()).max(z.abs()) <= 2.5e8 && *r > 0.0 && *r <= 2.5e8;
            if !(fine && !x.is_nan() && !y.is_nan() && !z.is_nan()) {
                return nothing;
            }
            let (c, r) = (Vec3::new(*x, *y, *z), Vec3::splat(*r * (1.0 + 1e-6)));
            Aabb { min: c - r, max: c + r }
        };
        let boxes: Vec<Aabb> = spheres.iter().map(bounds).collect();
        // Of equal spheres the first is the one that is seen
        let tree = Bvh::build_distinct(&boxes, |id| spheres[id as usize].map(|x| (x + 0.0).to_bits()));
        let colors = data.colors.iter().map(|[r, g, b, a]| {
            let [r, g, b] = [*r, *g, *b].map(|c| if c >= 0.0 { c.min(1e6) } else { 0.0 });
            [r, g, b, if *a >= 0.0 { a.min(1.0) } else { 0.0 }]
        });
        PointSet { spheres, colors: colors.collect(), origin: data.origin.into(), tree }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.spheres.len()
    }

    /// Bytes in memory, without the tree.
    pub fn bytes(&self) -> usize {
        size_of_val(self.spheres.as_slice()) + size_of_val(self.colors.as_slice())
    }

    /// Bytes of the tree.
    pub fn tree_bytes(&self) -> usize {
        self.tree.bytes()
    }

    /// What was taken off every centre: from here on the set is placed there.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The box around all, counted from [`origin`](Self::origin); `None` if there is nothing to be hit.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let bounds = self.tree.bounds();
        bounds.is_sound().then(|| [bounds.min.as_dvec3(), bounds.max.as_dvec3()])
    }

    /// The most that `d` . x is over it, to within rounding.
    pub fn support(&self, d: DVec3) -> f64 {
        let length = d.length();
        let reach = |[x, y, z, r]: [f64; 4]| DVec3::new(x, y, z).dot(d) + r * length;
        // Those that are left out are nowhere
        let there = self.spheres.iter().filter(|sphere| sphere.iter().all(|x| x.is_finite()) && sphere[3] > 0.0);
        there.map(|sphere| reach(sphere.map(f64::from))).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The colour and the alpha of a sphere.
    fn color(&self, index: u32) -> [f32; 4] {
        self.colors.get(index as usize).copied().unwrap_or([1.0; 4])
    }

    fn ball(&self, index: u32) -> PointBall {
        let [x, y, z, r] = self.spheres[index as usize].map(f64::from);
        PointBall { c: DVec3::new(x, y, z), r }
    }

    /// The first sphere on a ray of the set's own space: its distance, at most `limit`, and its number. Of several at
    /// the same distance the lowest. `single_sided`: rays pass through from inside.
    #[inline(never)]
    pub fn intersect<S: Simd>(&self, simd: S, ray: &DRay, limit: f32, single_sided: bool) -> Option<(f64, u32)> {
        simd.vectorize(
            #[inline(always)]
            || self.intersect_here(simd, ray, limit, single_sided),
        )
    }

    #[inline(always)]
    fn intersect_here<S: Simd>(&self, simd: S, ray: &DRay, limit: f32, single_sided: bool) -> Option<(f64, u32)> {
        let mut nearest: Option<(f64, u32)> = None;
        let mut limit = limit;
        let trace = TraceRay::new(ray.o.as_vec3(), ray.d.as_vec3());
        self.tree.closest(simd, &trace, &mut limit, |index, limit| {
            let Some([enter, leave]) = self.ball(index).roots(ray) else { return };
            let t = if enter > 0.0 {
                enter
            } else if leave > 0.0 && !single_sided {
                leave
            } else {
                return;
            };
            if nearest.is_none_or(|(best, number)| t < best || t == best && index < number) {
                nearest = Some((t, index));
                *limit = limit.min((t as f32).next_up());
            }
        });
        nearest
    }

    /// Visits every crossing of a sphere, 0 < t < `limit`, with its t and the number of the sphere, until `hit` says
    /// so: whether it did. `single_sided`: only where the ray enters.
    #[inline(never)]
    pub fn each<S: Simd>(
        &self,
        simd: S,
        ray: &DRay,
        limit: f32,
        single_sided: bool,
        mut hit: impl FnMut(f64, u32) -> bool,
    ) -> bool {
        let trace = TraceRay::new(ray.o.as_vec3(), ray.d.as_vec3());
        self.tree.any(simd, &trace, limit, |index| {
            let Some([enter, leave]) = self.ball(index).roots(ray) else { return false };
            let within = |t: f64| t > 0.0 && t < f64::from(limit);
            within(enter) && hit(enter, index) || !single_sided && within(leave) && hit(leave, index)
        })
    }

    /// Whether any sphere is met between 0 and `limit`.
    #[inline(never)]
    pub fn blocks<S: Simd>(&self, simd: S, ray: &DRay, limit: f32) -> bool {
        simd.vectorize(
            #[inline(always)]
            || self.blocks_here(simd, ray, limit),
        )
    }

    #[inline(always)]
    fn blocks_here<S: Simd>(&self, simd: S, ray: &DRay, limit: f32) -> bool {
        let trace = TraceRay::new(ray.o.as_vec3(), ray.d.as_vec3());
        self.tree.any(simd, &trace, limit, |index| self.ball(index).blocks(ray, limit.into()))
    }

    /// Which of sixteen lines of the set's own space meet any sphere before they end.
    #[inline(always)]
    pub fn blocks_lanes<S: Simd>(&self, simd: S, lines: &LineLanes, t_end: &[f32; 16], active: u16) -> u16 {
        self.tree.any16(
            simd,
            &lines.rays(active),
            t_end,
            active,
            #[inline(always)]
            |index, _| {
                let ball = self.ball(index);
                // Most are missed by all, which takes one division in place of three and a root
                let [met, _] = lines.each(
                    #[inline(always)]
                    |line, _| [ball.is_met(line), false],
                );
                if met == 0 {
                    return 0;
                }
                lines.each(
                    #[inline(always)]
                    |line, end| [ball.blocks(line, end), false],
                )[0]
            },
        )
    }

    /// What `ray`, which met sphere `index` at `t`, sees there.
    pub fn point(
        &self,
        placement: &Placement,
        index: u32,
        ray: &Ray,
        t: f64,
        differential: &RayDifferential,
    ) -> ShapePoint {
        let PointBall { c, r } = self.ball(index);
        let own = placement.ray(ray);
        // From the centre outwards: the point lies on the sphere however far away the camera is
        let outwards = (own.o - c + own.d * t).normalize_or(DVec3::Y);
        let on = c + outwards * r;
        let p = placement.world_from_object.transform_point3(on).as_vec3();
        let error = ErrorBound::of_rounded(p, placement.terms(c.abs() + DVec3::splat(r)));
        let normal = placement.normal(outwards).normalize_or(DVec3::Y).as_vec3();
        // Steps on the surface, in the set's own space
        let [dpx, dpy] = differential.on_plane(ray.d, t as f32, normal, f32::MAX.sqrt() * 0.5).map(|dp| {
            let dp = placement.object_from_world.transform_vector3(dp.as_dvec3()) / r;
            if dp.length_squared() <= 1.0 { dp.as_vec3() } else { dp.normalize_or_zero().as_vec3() }
        });
        let n = outwards.as_vec3();
        let (uv, dx, dy) = equirectangular(n, dpx, dpy);
        let [r, g, b, alpha] = self.color(index);
        let color = Rgb::new(r, g, b);
        ShapePoint {
            p,
            error,
            normal,
            shading: normal,
            lifted: None,
            uv,
            footprint: Footprint { dx, dy, edges: [UvEdge::Periodic, UvEdge::Folded] },
            color,
            alpha,
        }
    }

    /// How the unit normal changes from the point of sphere `index` that `ray` met at `t` with each step.
    pub fn normal_steps(
        &self,
        placement: &Placement,
        index: u32,
        ray: &Ray,
        t: f64,
        differential: &RayDifferential,
    ) -> [Vec3; 2] {
        let PointBall { c, r } = self.ball(index);
        let own = placement.ray(ray);
        let outwards = (own.o - c + own.d * t).normalize_or(DVec3::Y);
        let unit = |n: DVec3| placement.normal(n).normalize_or(DVec3::Y);
        let normal = unit(outwards);
        differential.on_plane(ray.d, t as f32, normal.as_vec3(), f32::MAX.sqrt() * 0.5).map(|dp| {
            let moved = outwards + placement.object_from_world.transform_vector3(dp.as_dvec3()) / r;
            (unit(moved.normalize_or(outwards)) - normal).as_vec3()
        })
    }

    /// How the point of sphere `index` that `ray` met at `t` moves with u and with v.
    pub fn tangents(&self, placement: &Placement, index: u32, ray: &Ray, t: f64) -> [DVec3; 2] {
        let PointBall { c, r } = self.ball(index);
        let own = placement.ray(ray);
        let outwards = (own.o - c + own.d * t).normalize_or(DVec3::Y);
        let tangents = ball_tangents(SphereUv::Equirectangular, outwards);
        tangents.map(|d| placement.world_from_object.transform_vector3(d * r))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::NoAssets;

    /// The advice and the radius of the first point.
    fn compiled(positions: Vec<[f64; 3]>, radius: Option<f64>) -> (Vec<String>, f32) {
        let desc = PointSetDesc { positions, radius, ..PointSetDesc::default() };
        let cx = &mut CompileContext::default();
        let points = desc.compile(cx, &NoAssets, &mut MeshFiles::default()).expect("has no faults");
        (cx.take_advice().iter().map(ToString::to_string).collect(), points.spheres[0][3])
    }

    /// A square grid of 30 x 30 points, `step` apart.
    fn grid(step: f64) -> Vec<[f64; 3]> {
        (0..900).map(|i| [f64::from(i % 30) * step, 2.0, f64::from(i / 30) * step]).collect()
    }

    #[test]
    fn a_radius_that_nobody_says_follows_the_spacing() {
        for step in [1e-3, 0.25, 1000.0] {
            let (advice, radius) = compiled(grid(step), None);
            assert!(advice.is_empty() && (f64::from(radius) / step - 0.7).abs() < 1e-4, "{step}: {radius}");
        }
        // Twice the same point is no distance
        let twice: Vec<_> = grid(1.0).into_iter().flat_map(|p| [p, p]).collect();
        assert!((compiled(twice, None).1 - 0.7).abs() < 0.3);
        assert_eq!(compiled(vec![[1.0, 2.0, 3.0]; 5], None).1, 0.01);
        assert_eq!(compiled(vec![[0.0; 3], [2.0, 0.0, 0.0]], None).1, 1.4);
    }

    #[test]
    fn a_radius_far_off_the_spacing_is_spoken_of() {
        let hint = "without it, 7.00e-1 would be chosen, so that neighbours touch";
        assert_eq!(
            compiled(grid(1.0), Some(30.0)),
            (vec![format!("radius: 30 is 30 times the distance of neighbouring points; {hint}")], 30.0)
        );
        assert_eq!(
            compiled(grid(1.0), Some(0.01)),
            (vec![format!("radius: 0.01 is a 100th of the distance of neighbouring points; {hint}")], 0.01)
        );
        for radius in [0.1, 1.0, 10.0] {
            assert_eq!(compiled(grid(1.0), Some(radius)).0, [""; 0]);
        }
    }
}

//! One surface in one pixel, and what of it wants light: its middle, the middles of its quadrants, its camera rays.

use std::ops::Range;

use arrayvec::ArrayVec;

use super::solo::{Candidate, SquareBsdf};
use super::square::Square;
use crate::color::Rgb;
use crate::film::hits::camera_ray;
use crate::ids::SurfaceId;
use crate::integrate::TOLERANCE;
use crate::material::{Bsdf, Colors, Lobe, Material, ShadingPoint};
use crate::math::{DVec3, ErrorBound, Ray, Vec3};
use crate::scene::Scene;
use crate::shape::RayDifferential;

/// How far colours of some rays differ, channel by channel.
pub(crate) type Contrast = Colors;

/// Fragments of so few rays are lit at each.
const FEW_RAYS: usize = 4;

/// A camera ray and what it meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayHit {
    pub ray: Ray,
    pub t: f64,
    /// Column and row in its pixel.
    pub at: [u16; 2],
}

/// What a camera ray sees of what lies in trees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    pub point: ShadingPoint,
    /// Column and row in its pixel.
    at: [u16; 2],
}

/// A surface in a pixel.
#[derive(Clone, Debug)]
pub(crate) struct Fragment {
    pub pixel: u32,
    /// Its shape; `None` for what lies in trees.
    pub of: Option<Candidate>,
    pub surface: SurfaceId,
    /// Its material; the colours are the means over its rays.
    pub bsdf: Bsdf,
    /// How many of the pixel's rays see it.
    pub count: u32,
    /// They among all of the cell, or what they see among all that is in trees, none while nobody needs them.
    pub rays: Range<usize>,
    /// The materials of rays that meet a shape, if they are not all the same.
    bsdfs: Option<Range<usize>>,
    /// Whether the materials of rays differ, whether they differ in more than colours, and how far those differ.
    pub is_textured: bool,
    pub uneven: bool,
    pub contrast: Contrast,
    /// The share of a pixel by which its errors are judged.
    pub share: f32,
    /// Its middle among all places of the cell, if that may stand for all of it.
    pub middle: Option<u32>,
    /// Its quadrants among all of the cell, once somebody asks: none where it is lit at each ray.
    quadrants: Option<Range<usize>>,
}

/// The part of a fragment in a quarter of its pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quadrant {
    pub place: u32,
    pub rays: u32,
    pub contrast: Contrast,
}

/// The materials that have no textures, in numbers.
pub(crate) struct PlainMaterials(Vec<Option<Bsdf>>);

impl PlainMaterials {
    pub fn new(scene: &Scene) -> Self {
        PlainMaterials(scene.materials.iter().map(Material::plain_bsdf).collect())
    }

    /// That of a shape, if it has no textures.
    pub fn get(&self, scene: &Scene, of: Candidate) -> Option<Bsdf> {
        if let Candidate::Facet(facet) = of
            && scene.geometry.has_colors(facet)
        {
            return None;
        }
        let surface = scene.geometry.surfaces.get(of.surface(scene).index())?;
        self.0[surface.material?.index()]
    }
}

/// The fragments of a cell.
pub(crate) struct Fragments {
    pub plain: PlainMaterials,
    /// Whether the middle stands for rays of different colours, by their mean.
    by_means: bool,
    pub all: Vec<Fragment>,
    rays: Vec<RayHit>,
    members: Vec<Member>,
    bsdfs: Vec<Bsdf>,
    quadrants: Vec<Quadrant>,
    /// The middles of fragments and of quadrants.
    pub places: Vec<ShadingPoint>,
}

impl Fragment {
    /// How many of the pixel's rays see it.
    pub fn count(&self) -> usize {
        self.count as usize
    }
}

impl Fragments {
    pub fn new(scene: &Scene, by_means: bool) -> Self {
        Fragments {
            plain: PlainMaterials::new(scene),
            by_means,
            all: Vec::new(),
            rays: Vec::new(),
            members: Vec::new(),
            bsdfs: Vec::new(),
            quadrants: Vec::new(),
            places: Vec::new(),
        }
    }

    pub fn clear(&mut self) {
        self.all.clear();
        self.rays.clear();
        self.members.clear();
        self.bsdfs.clear();
        self.quadrants.clear();
        self.places.clear();
    }

    /// Adds what some rays of pixel (`i`, `j`), number `pixel` of its cell, see, which all meet one shape. `share` is
    /// that of the pixel by which errors are judged.
    pub fn add(
        &mut self,
        scene: &Scene,
        pixel: u32,
        [i, j]: [u32; 2],
        of: Candidate,
        rays: impl Iterator<Item = RayHit>,
        share: impl Fn(usize) -> f32,
    ) {
        let n = scene.antialiasing;
        let first = self.rays.len();
        self.rays.extend(rays);
        let all = std::mem::take(&mut self.rays);
        let rays = &all[first..];
        let share = share(rays.len());
        let (bsdf, even) = self.material(scene, [i, j], of, rays);
        let bsdfs = (!even).then(|| {
            let first = self.bsdfs.len();
            let of_ray = |ray: &RayHit| {
                let [x, y] = ray.on_film(n, [i, j]);
                of.bsdf(scene, ray, &camera_ray(scene, x, y).1)
            };
            self.bsdfs.extend(rays.iter().map(of_ray));
            first..self.bsdfs.len()
        });
        let mean = match &bsdfs {
            None => MeanBsdf { bsdf, contrast: Contrast::default(), uneven: false },
            Some(range) => MeanBsdf::of(self.bsdfs[range.clone()].iter()),
        };
        let middle = match rays {
            [ray] => Some(of.point(scene, &ray.ray, ray.t, &mean.bsdf)),
            _ if self.has_no_middle(&mean) => None,
            _ => Some(middle(scene, of, &mean.bsdf, rays.iter())),
        };
        let middle = middle.map(|point| self.add_middle(point, share));
        self.all.push(Fragment {
            pixel,
            of: Some(of),
            surface: of.surface(scene),
            bsdf: mean.bsdf,
            count: (all.len() - first) as u32,
            rays: first..all.len(),
            is_textured: bsdfs.is_some(),
            bsdfs,
            uneven: mean.uneven,
            contrast: mean.contrast,
            share,
            middle,
            quadrants: None,
        });
        self.rays = all;
    }

    /// Whether no place stands for all rays of such materials.
    fn has_no_middle(&self, mean: &MeanBsdf) -> bool {
        mean.uneven || mean.contrast != Contrast::default() && !self.by_means
    }

    /// Adds the middle of a fragment that fills a share of its pixel: which of all places it is.
    fn add_middle(&mut self, point: ShadingPoint, share: f32) -> u32 {
        // It tells nothing beside what is proved
        self.places.push(ShadingPoint { share, most_motion: -1.0, ..point });
        self.places.len() as u32 - 1
    }

    /// Adds what some rays of pixel (`i`, `j`), number `pixel` of its cell, see of what lies in trees: those of one
    /// surface together, or each by itself. `share` as in [`add`](Self::add).
    pub fn add_seen(
        &mut self,
        scene: &Scene,
        pixel: u32,
        at: [u32; 2],
        seen: &mut Vec<Member>,
        once: bool,
        share: impl Fn(usize) -> f32,
    ) {
        while let Some(Member { point, .. }) = seen.first().copied() {
            let first = self.members.len();
            let mut is_first = true;
            let is_alike =
                |member: &mut Member| std::mem::take(&mut is_first) || once && is_one_surface(&point, &member.point);
            self.members.extend(seen.extract_if(.., is_alike));
            let members = &self.members[first..];
            let count = members.len();
            let bsdfs = members.iter().map(|member| &member.point.bsdf);
            let is_textured = bsdfs.clone().any(|other| *other != point.bsdf);
            let mean = match is_textured {
                false => MeanBsdf { bsdf: point.bsdf, contrast: Contrast::default(), uneven: false },
                true => MeanBsdf::of(bsdfs),
            };
            let share = share(count);
            let middle = match self.has_no_middle(&mean) {
                true => None,
                false => seen_middle(scene, at, &mean.bsdf, members.iter()),
            };
            let middle = middle.map(|point| self.add_middle(point, share));
            self.all.push(Fragment {
                pixel,
                of: None,
                surface: point.surface,
                bsdf: mean.bsdf,
                count: count as u32,
                rays: first..self.members.len(),
                is_textured,
                bsdfs: None,
                uneven: mean.uneven,
                contrast: mean.contrast,
                share,
                middle,
                quadrants: None,
            });
        }
    }

    /// Adds a pixel that is proved to see one shape of one material, from the middles of its quadrants alone; `false`
    /// if it is to be asked for its rays.
    pub fn add_whole(&mut self, scene: &Scene, pixel: u32, [i, j]: [u32; 2], of: Candidate, bsdf: Bsdf) -> bool {
        let n = scene.antialiasing;
        if n % 2 == 1 || (n * n) as usize <= FEW_RAYS {
            return false;
        }
        let mut points = ArrayVec::<ShadingPoint, 4>::new();
        for [x, y] in [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]] {
            let (ray, _) = scene.camera.local_ray(i as f32 + x, j as f32 + y, 1.0);
            match of.intersect(scene, &ray) {
                Some(t) => points.push(of.point(scene, &ray, t, &bsdf)),
                None => return false,
            }
        }
        // From the middle of a quadrant to the farthest of its rays, as a part of the way to that of the opposite one
        let part = 0.5 - 1.0 / n as f32;
        let apart = |one: usize, other: usize| (points[one].p - points[other].p).length();
        let reach = part * apart(0, 3).max(apart(1, 2));
        let turn = reach * of.curvature(scene);
        let first = self.quadrants.len();
        for point in points {
            let (place, rays) = (self.places.len() as u32, n * n / 4);
            self.quadrants.push(Quadrant { place, rays, contrast: Contrast::default() });
            let most_motion = TOLERANCE.motion;
            self.places.push(ShadingPoint { reach, turn, most_motion, part_of_points: 0.25, ..point });
        }
        let quadrants = Some(first..self.quadrants.len());
        let (count, rays) = (n * n, 0..0);
        self.all.push(Fragment {
            pixel,
            of: Some(of),
            surface: of.surface(scene),
            bsdf,
            count,
            rays,
            is_textured: false,
            bsdfs: None,
            uneven: false,
            contrast: Contrast::default(),
            share: 1.0,
            middle: None,
            quadrants,
        });
        true
    }

    /// Finds where the rays of its pixel meet a fragment that was added whole. Where a rounding lets one miss, the last
    /// that does not stands for it.
    pub fn trace(&mut self, scene: &Scene, fragment: usize, rays: &[Ray]) {
        let n = scene.antialiasing;
        let first = self.rays.len();
        let of = self.all[fragment].of.expect("what lies in trees is traced at once");
        for (k, ray) in rays.iter().enumerate() {
            let at = [k as u32 % n, k as u32 / n].map(|at| at as u16);
            self.rays.extend(of.intersect(scene, ray).map(|t| RayHit { ray: *ray, t, at }));
        }
        if let Some(last) = self.rays[first..].last().copied() {
            self.rays.resize(first + rays.len(), last);
        }
        let fragment = &mut self.all[fragment];
        (fragment.rays, fragment.count) = (first..self.rays.len(), (self.rays.len() - first) as u32);
    }

    /// The material in the middle of a pixel, and whether it is that of all its rays.
    fn material(&self, scene: &Scene, [i, j]: [u32; 2], of: Candidate, rays: &[RayHit]) -> (Bsdf, bool) {
        if let Some(plain) = self.plain.get(scene, of) {
            return (plain, true);
        }
        if let [ray] = rays {
            let n = scene.antialiasing;
            let [x, y] = ray.on_film(n, [i, j]);
            return (of.bsdf(scene, ray, &camera_ray(scene, x, y).1), true);
        }
        let (ray, whole) = scene.camera.local_ray(i as f32 + 0.5, j as f32 + 0.5, 1.0);
        let is_seen = of.intersect(scene, &ray);
        let middle = is_seen.map_or(rays[0], |t| RayHit { ray, t, at: [0; 2] });
        let si = scene.local_surface(&middle.ray, &of.hit_at(scene, &middle.ray, middle.t), &whole);
        let material = &scene.materials[si.material.index()];
        let ends = rays.iter().map(|ray| ray.end().as_vec3());
        let even = is_seen.is_some() && of.is_even_over(scene, &si, &middle.ray, middle.t, &whole, ends);
        (material.bsdf(&si, &scene.textures), even)
    }

    /// Finds the parts of a fragment in the quarters of its pixel, `pixel` of the film.
    pub fn find_quadrants(&mut self, scene: &Scene, fragment: usize, pixel: [u32; 2]) {
        if self.all[fragment].quadrants.is_none() {
            let first = self.quadrants.len();
            if !self.add_quadrants(scene, fragment, pixel) {
                self.quadrants.truncate(first);
            }
            self.all[fragment].quadrants = Some(first..self.quadrants.len());
        }
    }

    /// Those that were found; none where it has to be lit at each ray.
    pub fn quadrants(&self, fragment: &Fragment) -> &[Quadrant] {
        fragment.quadrants.clone().map_or(&[], |range| &self.quadrants[range])
    }

    fn add_quadrants(&mut self, scene: &Scene, fragment: usize, pixel: [u32; 2]) -> bool {
        let Fragment { of, bsdf, is_textured, rays, uneven, share, count, .. } = self.all[fragment].clone();
        if uneven || count as usize <= FEW_RAYS {
            return false;
        }
        let half = scene.antialiasing.div_ceil(2) as u16;
        for number in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            let is_in = |at: [u16; 2]| at.map(|at| at / half) == number;
            let those = (0..rays.len()).filter(|k| is_in(self.ray_at(of, rays.start + k)));
            let count = those.clone().count();
            if count == 0 {
                continue;
            }
            let mean = match is_textured {
                false => MeanBsdf { bsdf, contrast: Contrast::default(), uneven: false },
                true => MeanBsdf::of(those.map(|k| self.bsdf(&self.all[fragment], k))),
            };
            let point = match of {
                Some(of) => {
                    let rays = self.rays[rays.clone()].iter().filter(|ray| is_in(ray.at));
                    Some(middle(scene, of, &mean.bsdf, rays))
                }
                None => {
                    let members = self.members[rays.clone()].iter().filter(|member| is_in(member.at));
                    seen_middle(scene, pixel, &mean.bsdf, members)
                }
            };
            let Some(point) = point else { return false };
            let (place, contrast) = (self.places.len() as u32, mean.contrast);
            self.quadrants.push(Quadrant { place, rays: count as u32, contrast });
            let part_of_points = count as f32 / rays.len() as f32;
            self.places.push(ShadingPoint { share, most_motion: TOLERANCE.motion, part_of_points, ..point });
        }
        true
    }

    /// Where in its pixel a ray is, by its number among all of the cell.
    fn ray_at(&self, of: Option<Candidate>, ray: usize) -> [u16; 2] {
        match of {
            Some(_) => self.rays[ray].at,
            None => self.members[ray].at,
        }
    }

    /// Where a ray of a fragment, its `k`-th, wants light.
    pub fn place(&self, scene: &Scene, fragment: &Fragment, k: usize) -> ShadingPoint {
        let ray = fragment.rays.start + k;
        let point = match fragment.of {
            Some(of) => of.point(scene, &self.rays[ray].ray, self.rays[ray].t, self.bsdf(fragment, k)),
            None => self.members[ray].point,
        };
        ShadingPoint { share: fragment.share, part_of_points: 1.0 / fragment.count() as f32, ..point }
    }

    /// The material that a ray of a fragment sees.
    fn bsdf<'b>(&'b self, fragment: &'b Fragment, ray: usize) -> &'b Bsdf {
        match (&fragment.bsdfs, fragment.of) {
            (Some(range), _) => &self.bsdfs[range.start + ray],
            (None, Some(_)) => &fragment.bsdf,
            (None, None) => &self.members[fragment.rays.start + ray].point.bsdf,
        }
    }
}

/// The middle of what some rays see of a shape, with its reach to their ends.
fn middle<'a>(
    scene: &Scene,
    of: Candidate,
    bsdf: &Bsdf,
    rays: impl Iterator<Item = &'a RayHit> + Clone,
) -> ShadingPoint {
    let (mut count, mut q, mut d) = (0.0, DVec3::ZERO, Vec3::ZERO);
    for ray in rays.clone() {
        (count, q, d) = (count + 1.0, q + ray.end(), d + ray.ray.d);
    }
    // In the middle of what they see, not of the rays: on a rim the surface runs away
    let mut point = of.point_near(scene, q / count, -d.normalize(), bsdf);
    let mut reach2 = 0.0f32;
    for ray in rays {
        reach2 = reach2.max((ray.end().as_vec3() - point.p).length_squared());
    }
    point.reach = reach2.sqrt();
    point.turn = point.reach * of.curvature(scene);
    point
}

/// Whether two places that camera rays see are of one surface, which may be lit as one.
pub(crate) fn is_one_surface(one: &ShadingPoint, other: &ShadingPoint) -> bool {
    if one.surface != other.surface || !(one.ns.dot(other.ns) > 0.0) {
        return false;
    }
    let apart = other.p - one.p;
    // Neither is far off the other's tangent plane
    let off = apart.dot(one.ng).abs().max(apart.dot(other.ng).abs());
    off <= 0.5 * apart.length()
}

/// The middle of what some rays of pixel (`i`, `j`) see of a surface in trees, with its reach to their ends; `None` if
/// something else is there, or if the mean of normals is farther than `TOLERANCE.even` from that in the middle.
fn seen_middle<'a>(
    scene: &Scene,
    [i, j]: [u32; 2],
    bsdf: &Bsdf,
    members: impl Iterator<Item = &'a Member> + Clone,
) -> Option<ShadingPoint> {
    let n = scene.antialiasing;
    let (mut count, mut x, mut y) = (0.0f32, 0.0, 0.0);
    for member in members.clone() {
        (count, x, y) = (count + 1.0, x + f32::from(member.at[0]), y + f32::from(member.at[1]));
    }
    let first = members.clone().next()?.point;
    if count == 1.0 {
        return Some(first);
    }
    let at = |from: u32, sum: f32| from as f32 + (sum / count + 0.5) / n as f32;
    let (ray, differential) = scene.camera.local_ray(at(i, x), at(j, y), 1.0 / n as f32);
    let hit = scene.intersect_local(&ray).filter(|hit| hit.surface == first.surface)?;
    let si = scene.local_surface(&ray, &hit, &differential);
    let mut point = ShadingPoint::of(&si, bsdf, scene.ambient);
    if !is_one_surface(&point, &first) {
        return None;
    }
    let mut normals = Vec3::ZERO;
    for Member { point: other, .. } in members {
        point.reach = point.reach.max((other.p - point.p).length());
        let turn = (other.ns - point.ns).length().max((other.horizon - point.horizon).length());
        // Steps are not flat, though no normal turns
        let off = (other.p - point.p).dot(point.horizon).abs();
        let steps = off > point.horizon.abs().dot(other.error.0 + point.error.0);
        point.turn = point.turn.max(turn).max(if steps { f32::MIN_POSITIVE } else { 0.0 });
        normals += other.ns - point.ns;
    }
    (normals.length() <= TOLERANCE.even * count).then_some(point)
}

impl Member {
    /// What the ray at `at` of its pixel sees.
    pub fn new(point: ShadingPoint, at: [u16; 2]) -> Member {
        Member { point, at }
    }
}

impl RayHit {
    /// Where it ends.
    fn end(&self) -> DVec3 {
        self.ray.o.as_dvec3() + self.ray.d.as_dvec3() * self.t
    }

    /// Which ray of the film it is, in a pixel with n x n.
    fn on_film(&self, n: u32, [i, j]: [u32; 2]) -> [u32; 2] {
        [i * n + u32::from(self.at[0]), j * n + u32::from(self.at[1])]
    }
}

impl Candidate {
    /// Where a ray that meets it at `t` wants light.
    #[inline(always)]
    pub fn point(self, scene: &Scene, ray: &Ray, t: f64, bsdf: &Bsdf) -> ShadingPoint {
        self.turned(
            scene,
            match self {
                Candidate::Sphere(i) => scene.geometry.spheres[i as usize].shape.place(ray, t),
                Candidate::Parallelogram(i) => scene.geometry.parallelograms[i as usize].shape.place(ray, t),
                Candidate::Plane(_) | Candidate::Facet(_) => return self.surface_point(scene, ray, t, bsdf),
                Candidate::Light(_) | Candidate::Trees => unreachable!("it has no material of its own"),
            },
            -ray.d,
            bsdf,
        )
    }

    /// The same for the point of it that is nearest to `q`, seen along `wo`; `q` is next to it on what is flat.
    fn point_near(self, scene: &Scene, q: DVec3, wo: Vec3, bsdf: &Bsdf) -> ShadingPoint {
        self.turned(
            scene,
            match self {
                Candidate::Sphere(i) => scene.geometry.spheres[i as usize].shape.nearest_place(q),
                Candidate::Parallelogram(i) => scene.geometry.parallelograms[i as usize].shape.nearest_place(q),
                Candidate::Plane(_) | Candidate::Facet(_) => {
                    return self.surface_point(scene, &Ray { o: q.as_vec3(), d: -wo }, 0.0, bsdf);
                }
                Candidate::Light(_) | Candidate::Trees => unreachable!("it has no material of its own"),
            },
            wo,
            bsdf,
        )
    }

    /// A place with its normal on the viewer's side.
    #[inline(always)]
    fn turned(
        self,
        scene: &Scene,
        (p, error, normal): (Vec3, ErrorBound, Vec3),
        wo: Vec3,
        bsdf: &Bsdf,
    ) -> ShadingPoint {
        let error = error.widened(scene.geometry.rounding);
        let (n, surface) = (if normal.dot(wo) < 0.0 { -normal } else { normal }, self.surface(scene));
        let receives_shadow = scene.geometry.surfaces[surface.index()].receives_shadow;
        let base = bsdf.base(scene.ambient);
        ShadingPoint { surface, receives_shadow, base, ..ShadingPoint::new(p, error, n, wo, bsdf) }
    }

    /// The same of what is placed.
    fn surface_point(self, scene: &Scene, ray: &Ray, t: f64, bsdf: &Bsdf) -> ShadingPoint {
        let si = scene.local_surface(ray, &self.hit_at(scene, ray, t), &RayDifferential::default());
        ShadingPoint::of(&si, bsdf, scene.ambient)
    }

    /// The material that a ray sees which meets it.
    fn bsdf(self, scene: &Scene, ray: &RayHit, differential: &RayDifferential) -> Bsdf {
        let si = scene.local_surface(&ray.ray, &self.hit_at(scene, &ray.ray, ray.t), differential);
        scene.materials[si.material.index()].bsdf(&si, &scene.textures)
    }

    /// The mean material over the rays of a pixel that sees only this; `None` where more than colours change.
    pub fn mean(self, scene: &Scene, at: [u32; 2]) -> Option<(Bsdf, Contrast)> {
        if let Some(whole) = self.of_square(scene, Square { x: at[0], y: at[1], side: 1 }) {
            if whole.is_even {
                return Some((whole.bsdf, Contrast::default()));
            }
            if let Some(mean) = self.mean_of_area(scene, at, &whole) {
                return Some(mean);
            }
        }
        let mean = self.mean_of_parts(scene, at, scene.antialiasing)?;
        (!mean.uneven).then_some((mean.bsdf, mean.contrast))
    }

    /// The same where textures tell the mean over any area: from the `whole` pixel, if it is a parallelogram on the
    /// surface, or nearly so, else from its quarters, if it says the same.
    fn mean_of_area(self, scene: &Scene, at: [u32; 2], whole: &SquareBsdf) -> Option<(Bsdf, Contrast)> {
        let surface = &scene.geometry.surfaces[self.surface(scene).index()];
        let (contrast, ambient) = scene.materials[surface.material?.index()].contrast(&scene.textures)?;
        // At a rim neither the whole nor quarters are what they seem
        if scene.antialiasing <= 2 || whole.growth == f32::INFINITY {
            return None;
        }
        let is_within = |off: Rgb, mean: Rgb| {
            let allowed = mean * TOLERANCE.same_mean;
            off.r <= allowed.r && off.g <= allowed.g && off.b <= allowed.b
        };
        let SquareBsdf { bsdf, growth, .. } = *whole;
        // An edge between two colours is off by an eighth of what the pixel grows, at most
        let off = 0.125 * growth;
        let is_within_by = |part: f32| {
            let mut colors = contrast.0.into_iter().zip(bsdf.colors.0);
            is_within(ambient * (off * part), bsdf.ambient)
                && colors.all(|(contrast, mean)| is_within(contrast * (off * part), mean))
        };
        if is_within_by(1.0) {
            return Some((bsdf, contrast));
        }
        let quarters = self.mean_of_parts(scene, at, 2)?;
        // All of one colour, but beside an edge, which quarters can miss by a quarter of that
        if quarters.contrast == Contrast::default() && !is_within_by(0.25) {
            return None;
        }
        let is_same = |one: Rgb, other: Rgb| is_within((one + other * -1.0).map(f32::abs), other);
        let is_same = is_same(bsdf.ambient, quarters.bsdf.ambient)
            && bsdf.colors.0.into_iter().zip(quarters.bsdf.colors.0).all(|(one, other)| is_same(one, other));
        // Rays differ by more than quarters, the means of some of them: by twice as much at most, along each axis
        (is_same && !quarters.uneven).then_some((quarters.bsdf, quarters.contrast * 2.0))
    }

    /// The mean material over the n x n parts of a pixel that sees only this.
    fn mean_of_parts(self, scene: &Scene, [i, j]: [u32; 2], n: u32) -> Option<MeanBsdf> {
        let mut bsdfs = ArrayVec::<Bsdf, MAX_MEAN>::new();
        for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
            let middle = |from: u32, part: u32| from as f32 + (part as f32 + 0.5) / n as f32;
            let (ray, differential) = scene.camera.local_ray(middle(i, column), middle(j, row), 1.0 / n as f32);
            // It is proved that it meets it; a rounding may say otherwise
            let Some(t) = self.intersect(scene, &ray) else { continue };
            bsdfs.try_push(self.bsdf(scene, &RayHit { ray, t, at: [0; 2] }, &differential)).ok()?;
        }
        (!bsdfs.is_empty()).then(|| MeanBsdf::of(bsdfs.iter()))
    }
}

/// The most rays whose mean is taken at once.
const MAX_MEAN: usize = 64;

/// The mean of some materials in numbers.
struct MeanBsdf {
    bsdf: Bsdf,
    contrast: Contrast,
    /// Whether highlights differ in more than colour.
    uneven: bool,
}

impl MeanBsdf {
    fn of<'a>(bsdfs: impl Iterator<Item = &'a Bsdf>) -> MeanBsdf {
        let mut sum = Bsdf { colors: Colors::BLACK, ambient: Rgb::BLACK, lobe: Lobe::None };
        let (mut count, mut uneven) = (0.0f32, false);
        let infinite = Rgb::gray(f32::INFINITY);
        let (mut least, mut most) = (Colors::BLACK.map(|_| infinite), Colors::BLACK);
        for bsdf in bsdfs {
            sum.colors += bsdf.colors;
            sum.ambient += bsdf.ambient;
            count += 1.0;
            (least, most) = (least.min(bsdf.colors), most.max(bsdf.colors));
            // Any ray that sees a highlight says what it is like
            match sum.lobe.with(bsdf.lobe) {
                Some(lobe) => sum.lobe = lobe,
                None => uneven = true,
            }
        }
        let inverse = 1.0 / count;
        MeanBsdf {
            bsdf: Bsdf { colors: sum.colors * inverse, ambient: sum.ambient * inverse, lobe: sum.lobe },
            contrast: most + least * -1.0,
            uneven,
        }
    }
}

//! Fragments: the part of one surface in one pixel, and the shading points that represent it, at three rates: one for
//! the fragment, one for each quadrant of the pixel, one for each camera ray.

use std::ops::Range;

use super::visible_shape::{MeanBsdf, VisibleShape};
use crate::film::hits::camera_ray;
use crate::ids::SurfaceId;
use crate::integrate::TOLERANCE;
use crate::material::{Bsdf, Colors, ShadingPoint};
use crate::math::{DVec3, Ray, Vec3};
use crate::render::AaMode;
use crate::scene::Scene;

/// Fragments of at most so many rays have no quadrants.
const FEW_RAYS: usize = 4;

/// The hit of a camera ray and a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayPoint {
    /// The shape; `None` if it is in the trees.
    pub shape: Option<VisibleShape>,
    pub point: ShadingPoint,
    /// Column and row in the pixel of the ray.
    pub at: [u16; 2],
    /// The number of rays that it stands for.
    pub count: u32,
    /// Whether the ray has several shading points: those of layers and of the surface behind them, or those of a clear
    /// coat and of its base.
    pub is_layered: bool,
}

/// The number of shading points of a fragment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ShadingRate {
    Fragment,
    Quadrant,
    Ray,
}

/// A surface in a pixel.
#[derive(Clone, Debug)]
pub(crate) struct Fragment {
    /// The number of its pixel among those with fragments.
    pub pixel: u32,
    /// Its shape; `None` if it is in the trees.
    shape: Option<VisibleShape>,
    pub surface: SurfaceId,
    /// The mean of the materials of its rays.
    pub mean: MeanBsdf,
    /// The number of rays of the pixel that hit it; under multisampling one of them stands for all.
    pub count: u32,
    /// The share of the pixel by which its errors are judged.
    pub share: f32,
    /// Whether its rays have several points: other fragments may fill the pixel too.
    pub is_layered: bool,
    /// Its center among [`Fragments::points`]; none if that cannot represent it.
    pub center: Range<usize>,
    /// Its quadrants among them, once they are computed: none if it is to be lit at each ray.
    quadrants: Option<Range<usize>>,
    /// Its rays among [`Fragments::rays`], once they are traced.
    pub rays: Range<usize>,
}

/// The centers of the quadrants of a pixel.
fn quadrant_centers() -> [[f32; 2]; 4] {
    [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]]
}

/// The fragments of a cell.
pub(crate) struct Fragments {
    /// The materials without textures.
    plain: Vec<Option<Bsdf>>,
    /// Whether a center may represent rays of different colours by their mean.
    by_means: bool,
    pub all: Vec<Fragment>,
    /// The shading points of camera rays, and their columns and rows in their pixels.
    pub rays: Vec<ShadingPoint>,
    at: Vec<[u16; 2]>,
    /// The centers of fragments and of quadrants; the number of rays and the contrast of colours of each.
    pub points: Vec<ShadingPoint>,
    parts: Vec<(u32, Colors)>,
}

impl Fragment {
    /// Its shading points of a rate, as the numbers of [`Fragments::points_of`].
    pub fn range(&self, rate: ShadingRate) -> Range<usize> {
        match rate {
            ShadingRate::Fragment => self.center.clone(),
            ShadingRate::Quadrant => self.quadrants.clone().unwrap_or_default(),
            ShadingRate::Ray => self.rays.clone(),
        }
    }
}

impl Fragments {
    pub fn new(scene: &Scene, by_means: bool) -> Self {
        Fragments {
            plain: scene.materials.iter().map(|material| material.plain_bsdf(&scene.ambient)).collect(),
            by_means,
            all: Vec::new(),
            rays: Vec::new(),
            at: Vec::new(),
            points: Vec::new(),
            parts: Vec::new(),
        }
    }

    pub fn clear(&mut self) {
        self.all.clear();
        self.rays.clear();
        self.at.clear();
        self.points.clear();
        self.parts.clear();
    }

    /// The material of a shape, if that has no textures, and no highlight that its curvature changes.
    pub fn plain_bsdf(&self, scene: &Scene, shape: VisibleShape) -> Option<Bsdf> {
        if let VisibleShape::Facet(facet) = shape
            && scene.geometry.has_colors(facet)
        {
            return None;
        }
        let material = scene.geometry.surfaces.get(shape.surface(scene).index())?.material?;
        let is_filtered = matches!(shape, VisibleShape::Sphere(_)) && scene.geometry.rules.refines(material);
        self.plain[material.index()].filter(|_| !is_filtered)
    }

    /// The shading points of a rate.
    pub fn points_of(&self, rate: ShadingRate) -> &[ShadingPoint] {
        if rate == ShadingRate::Ray { &self.rays } else { &self.points }
    }

    /// The number of rays that a shading point of a rate represents, and the contrast of their colours.
    pub fn part(&self, rate: ShadingRate, point: usize) -> (u32, Colors) {
        if rate == ShadingRate::Ray { (1, Colors::BLACK) } else { self.parts[point] }
    }

    /// Adds fragments for some rays of a pixel, number `number` of those with fragments: one for each surface, or one
    /// for each ray under full antialiasing. Under multisampling what is opaque was grouped before, and of the rays of
    /// a layer one stands for all.
    pub fn add(&mut self, scene: &Scene, number: u32, at: [u32; 2], rays: &mut Vec<RayPoint>, mode: AaMode) {
        let all = (scene.antialiasing * scene.antialiasing) as f32;
        while let Some(RayPoint { shape, point, is_layered, .. }) = rays.first().copied() {
            let first = self.rays.len();
            let (mut is_first, mut last, mut count) = (true, None, 0);
            let grouped = mode == AaMode::Adaptive || mode == AaMode::Multisample && is_layered;
            rays.retain(|ray| {
                let is_same = || ray.shape == shape && (shape.is_some() || is_one_surface(&point, &ray.point));
                // Of several layers of one surface on a ray, each is in a fragment of its own
                let is_alike = std::mem::take(&mut is_first)
                    || grouped && ray.is_layered == is_layered && last != Some(ray.at) && is_same();
                if is_alike {
                    last = Some(ray.at);
                    count += ray.count;
                    self.rays.push(ray.point);
                    self.at.push(ray.at);
                }
                !is_alike
            });
            let share = if mode == AaMode::Full { 1.0 } else { count as f32 / all };
            if mode == AaMode::Multisample {
                self.keep_one(first);
            }
            self.push(scene, number, at, shape, first, count, share, is_layered);
        }
    }

    /// Leaves the middle one of the rays from number `first` on, with the mean of their materials.
    fn keep_one(&mut self, first: usize) {
        let middle = first + (self.rays.len() - first) / 2;
        if let Some(mean) = MeanBsdf::of(self.rays[first..].iter().map(|ray| ray.bsdf)) {
            self.rays[middle].bsdf = mean.bsdf;
        }
        (self.rays[first], self.at[first]) = (self.rays[middle], self.at[middle]);
        self.rays.truncate(first + 1);
        self.at.truncate(first + 1);
    }

    /// Adds a fragment of the rays from number `first` on, which stand for `count`.
    #[allow(clippy::too_many_arguments, reason = "a pixel, and what all rays of the fragment have")]
    fn push(
        &mut self,
        scene: &Scene,
        pixel: u32,
        at: [u32; 2],
        shape: Option<VisibleShape>,
        first: usize,
        count: u32,
        share: f32,
        is_layered: bool,
    ) {
        let rays = first..self.rays.len();
        let closed_form_budget = 1.0 / rays.len() as f32;
        for point in &mut self.rays[rays.clone()] {
            (point.share, point.closed_form_budget) = (share, closed_form_budget);
        }
        let bsdfs = self.rays[rays.clone()].iter().map(|ray| ray.bsdf);
        let mean = MeanBsdf::of(bsdfs).expect("a fragment has a ray");
        let has_center = !mean.lobes_differ && (mean.contrast == Colors::BLACK || self.by_means);
        let center = if has_center { self.center(scene, at, shape, &mean.bsdf, rays.clone()) } else { None };
        let points = self.points.len();
        if let Some(center) = center {
            // It is used only where the light is proved to vary little
            let closed_form_budget = f32::INFINITY;
            self.points.push(ShadingPoint { share, most_motion: -1.0, closed_form_budget, ..center });
            self.parts.push((count, Colors::BLACK));
        }
        self.all.push(Fragment {
            pixel,
            shape,
            surface: self.rays[first].surface,
            mean,
            count,
            share,
            is_layered,
            center: points..self.points.len(),
            quadrants: None,
            rays,
        });
    }

    /// Adds a pixel that provably sees one shape of one material, by the centers of its quadrants alone; `false` if the
    /// pixel has to be traced.
    pub fn add_whole(&mut self, scene: &Scene, pixel: u32, [i, j]: [u32; 2], shape: VisibleShape, bsdf: Bsdf) -> bool {
        let n = scene.antialiasing;
        let first = self.points.len();
        if !self.push_quadrants(scene, [i, j], shape, &bsdf) {
            return false;
        }
        self.all.push(Fragment {
            pixel,
            shape: Some(shape),
            surface: shape.surface(scene),
            mean: MeanBsdf::constant(bsdf),
            count: n * n,
            share: 1.0,
            is_layered: false,
            center: first..first,
            quadrants: Some(first..self.points.len()),
            rays: 0..0,
        });
        true
    }

    /// Adds the centers of the quadrants of a pixel that provably sees one shape, with one material; `false` if there
    /// are none.
    fn push_quadrants(&mut self, scene: &Scene, [i, j]: [u32; 2], shape: VisibleShape, bsdf: &Bsdf) -> bool {
        let n = scene.antialiasing;
        if n % 2 == 1 || (n * n) as usize <= FEW_RAYS {
            return false;
        }
        let first = self.points.len();
        for [x, y] in quadrant_centers() {
            let (ray, _) = scene.camera.local_ray(i as f32 + x, j as f32 + y, 1.0);
            let Some(t) = shape.intersect(scene, &ray) else {
                self.points.truncate(first);
                return false;
            };
            self.points.push(shape.point(scene, &ray, t, bsdf));
        }
        let points = &mut self.points[first..];
        // The distance from the center of a quadrant to its farthest ray, as a part of that to the opposite center
        let part = 0.5 - 1.0 / n as f32;
        let apart = |one: usize, other: usize| (points[one].p - points[other].p).length();
        let reach = part * apart(0, 3).max(apart(1, 2));
        let turn = reach * shape.curvature(scene);
        for point in points {
            *point = ShadingPoint { reach, turn, most_motion: TOLERANCE.motion, closed_form_budget: 0.25, ..*point };
            self.parts.push((n * n / 4, Colors::BLACK));
        }
        true
    }

    /// Adds a pixel that provably sees one shape, by its center, with the mean material; `corners` are the points of
    /// the shape at the corners of the pixel. `false` if the pixel has to be traced.
    pub fn add_whole_center(
        &mut self,
        scene: &Scene,
        pixel: u32,
        [i, j]: [u32; 2],
        shape: VisibleShape,
        mean: MeanBsdf,
        corners: [Vec3; 4],
    ) -> bool {
        let n = scene.antialiasing;
        let (ray, _) = scene.camera.local_ray(i as f32 + 0.5, j as f32 + 0.5, 1.0);
        let Some(t) = shape.intersect(scene, &ray) else { return false };
        if (n * n) as usize <= FEW_RAYS {
            return false;
        }
        let center = shape.point(scene, &ray, t, &mean.bsdf);
        let reach = corners.into_iter().fold(0.0f32, |reach, corner| reach.max((corner - center.p).length()));
        let turn = reach * shape.curvature(scene);
        let first = self.points.len();
        // It is used only where the light is proved to vary little
        self.points.push(ShadingPoint { reach, turn, most_motion: -1.0, ..center });
        self.parts.push((n * n, Colors::BLACK));
        self.all.push(Fragment {
            pixel,
            shape: Some(shape),
            surface: shape.surface(scene),
            mean,
            count: n * n,
            share: 1.0,
            is_layered: false,
            center: first..first + 1,
            quadrants: None,
            rays: 0..0,
        });
        true
    }

    /// The same by the centers of its quadrants, each with the material there.
    pub fn add_whole_quadrants(
        &mut self,
        scene: &Scene,
        pixel: u32,
        at: [u32; 2],
        shape: VisibleShape,
        mean: MeanBsdf,
    ) -> bool {
        if !self.add_whole(scene, pixel, at, shape, mean.bsdf) {
            return false;
        }
        let Some(Fragment { mean: own, quadrants, .. }) = self.all.last_mut() else { return false };
        *own = mean;
        for (point, [x, y]) in quadrants.clone().unwrap_or_default().zip(quadrant_centers()) {
            let step = 1.0 / scene.antialiasing as f32;
            let (ray, differential) = scene.camera.local_ray(at[0] as f32 + x, at[1] as f32 + y, step);
            if let Some(t) = shape.intersect(scene, &ray) {
                self.points[point].bsdf = shape.bsdf(scene, &ray, t, &differential);
            }
        }
        true
    }

    /// Computes the shading points of the rays of a fragment that was [added whole](Self::add_whole): of all, or of
    /// the `most` from the middle of the pixel on; one has the mean material. Rays that miss it by a rounding get the
    /// point of the last one that does not.
    pub fn trace(&mut self, scene: &Scene, fragment: usize, [i, j]: [u32; 2], rays: &[Ray], most: usize) {
        let n = scene.antialiasing;
        let first = self.rays.len();
        let Fragment { shape, mean, .. } = &mut self.all[fragment];
        let shape = shape.expect("fragments in the trees are traced at once");
        let wanted = rays.len().min(most);
        let middle = if wanted < rays.len() { (n - 1) / 2 * (n + 1) } else { 0 };
        for k in (0..n * n).map(|k| (k + middle) % (n * n)) {
            let ray = &rays[k as usize];
            if self.rays.len() == first + wanted {
                break;
            }
            if let Some(t) = shape.intersect(scene, ray) {
                let bsdf = match mean.is_constant || wanted == 1 {
                    true => mean.bsdf,
                    false => shape.bsdf(scene, ray, t, &camera_ray(scene, i * n + k % n, j * n + k / n).1),
                };
                self.rays.push(shape.point(scene, ray, t, &bsdf));
                self.at.push([k % n, k / n].map(|at| at as u16));
            }
        }
        let is_missed = self.rays.len() == first;
        if let Some(last) = self.rays[first..].last().copied() {
            self.rays.resize(first + wanted, last);
            self.at.resize(first + wanted, *self.at.last().expect("each ray has one"));
        }
        let closed_form_budget = 1.0 / wanted as f32;
        self.rays[first..].iter_mut().for_each(|point| point.closed_form_budget = closed_form_budget);
        let fragment = &mut self.all[fragment];
        fragment.rays = first..self.rays.len();
        fragment.count = if is_missed { 0 } else { rays.len() as u32 };
    }

    /// Computes the quadrants of a fragment: its parts in the quarters of its pixel. There are none if they cannot
    /// represent it.
    pub fn find_quadrants(&mut self, scene: &Scene, fragment: usize, pixel: [u32; 2]) {
        if self.all[fragment].quadrants.is_none() {
            let first = self.points.len();
            let Fragment { shape, mean, ref rays, .. } = self.all[fragment];
            if let Some(shape) = shape.filter(|_| rays.is_empty()) {
                self.push_quadrants(scene, pixel, shape, &mean.bsdf);
            } else if self.add_quadrants(scene, fragment, pixel).is_none() {
                self.points.truncate(first);
                self.parts.truncate(first);
            }
            self.all[fragment].quadrants = Some(first..self.points.len());
        }
    }

    fn add_quadrants(&mut self, scene: &Scene, fragment: usize, pixel: [u32; 2]) -> Option<()> {
        let Fragment { shape, mean, ref rays, share, .. } = self.all[fragment];
        let rays = rays.clone();
        if rays.len() <= FEW_RAYS {
            return None;
        }
        let half = scene.antialiasing.div_ceil(2) as u16;
        for quadrant in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            let own = rays.clone().filter(|ray| self.at[*ray].map(|at| at / half) == quadrant);
            let count = own.clone().count();
            if count == 0 {
                continue;
            }
            let mean = match mean.is_constant {
                true => mean,
                false => MeanBsdf::of(own.clone().map(|ray| self.rays[ray].bsdf))?,
            };
            if mean.lobes_differ {
                return None;
            }
            let point = self.center(scene, pixel, shape, &mean.bsdf, own)?;
            let closed_form_budget = count as f32 / rays.len() as f32;
            self.points.push(ShadingPoint { share, most_motion: TOLERANCE.motion, closed_form_budget, ..point });
            self.parts.push((count as u32, mean.contrast));
        }
        Some(())
    }

    /// The center of some rays of a pixel that hit one surface, with its reach to their hits; `None` if that cannot
    /// represent them.
    fn center(
        &self,
        scene: &Scene,
        pixel: [u32; 2],
        shape: Option<VisibleShape>,
        bsdf: &Bsdf,
        rays: impl Iterator<Item = usize> + Clone,
    ) -> Option<ShadingPoint> {
        let points = rays.clone().map(|ray| &self.rays[ray]);
        let mut rest = points.clone();
        match (rest.next(), rest.next(), shape) {
            (Some(alone), None, _) => Some(*alone),
            (.., Some(shape)) => Some(center_of_shape(scene, shape, bsdf, points)),
            (.., None) => center_in_trees(scene, pixel, bsdf, rays.map(|ray| self.at[ray]), points),
        }
    }
}

/// The center of some shading points on a shape.
fn center_of_shape<'a>(
    scene: &Scene,
    shape: VisibleShape,
    bsdf: &Bsdf,
    points: impl Iterator<Item = &'a ShadingPoint> + Clone,
) -> ShadingPoint {
    let (mut count, mut q, mut wo) = (0.0, DVec3::ZERO, Vec3::ZERO);
    for point in points.clone() {
        (count, q, wo) = (count + 1.0, q + point.p.as_dvec3(), wo + point.wo);
    }
    // The mean of the hits: that of the rays may miss the shape at a rim
    let mut center = shape.point_near(scene, q / count, wo.normalize(), bsdf);
    let reach2 = points.fold(0.0f32, |reach2, point| reach2.max((point.p - center.p).length_squared()));
    center.reach = reach2.sqrt();
    center.turn = center.reach * shape.curvature(scene);
    center
}

/// Whether two shading points are on one surface, without a fold between them.
pub(crate) fn is_one_surface(one: &ShadingPoint, other: &ShadingPoint) -> bool {
    if one.surface != other.surface || !(one.ns.dot(other.ns) > 0.0) {
        return false;
    }
    let apart = other.p - one.p;
    // Neither is far off the other's tangent plane
    let off = apart.dot(one.ng).abs().max(apart.dot(other.ng).abs());
    off <= 0.5 * apart.length()
}

/// The center of some rays at the places `at` of pixel (`i`, `j`) that hit a surface in the trees at `points`; `None`
/// if the ray through the mean of the places hits another surface, or if the mean of the normals differs by more than
/// `TOLERANCE.even` from the normal there.
fn center_in_trees<'a>(
    scene: &Scene,
    [i, j]: [u32; 2],
    bsdf: &Bsdf,
    at: impl Iterator<Item = [u16; 2]>,
    points: impl Iterator<Item = &'a ShadingPoint> + Clone,
) -> Option<ShadingPoint> {
    let n = scene.antialiasing;
    let (mut count, mut x, mut y) = (0.0f32, 0.0, 0.0);
    for at in at {
        (count, x, y) = (count + 1.0, x + f32::from(at[0]), y + f32::from(at[1]));
    }
    let first = points.clone().next()?;
    let mean = |from: u32, sum: f32| from as f32 + (sum / count + 0.5) / n as f32;
    let (ray, differential) = scene.camera.local_ray(mean(i, x), mean(j, y), 1.0 / n as f32);
    let hit = scene.intersect_local(&ray).filter(|hit| hit.surface == first.surface);
    let layers = scene.layers_of(&ray, first.surface);
    let mut center = hit.into_iter().chain(layers).find_map(|hit| {
        let si = scene.local_surface(&ray, &hit, &differential);
        let center = ShadingPoint::of(&si, bsdf, &scene.ambient);
        is_one_surface(&center, first).then_some(center)
    })?;
    let mut normals = Vec3::ZERO;
    for point in points {
        center.reach = center.reach.max((point.p - center.p).length());
        let turn = (point.ns - center.ns).length().max((point.horizon - center.horizon).length());
        // A step between parallel faces turns no normal
        let off = (point.p - center.p).dot(center.horizon).abs();
        let steps = off > center.horizon.abs().dot(point.error.0 + center.error.0);
        center.turn = center.turn.max(turn).max(if steps { f32::MIN_POSITIVE } else { 0.0 });
        normals += point.ns - center.ns;
    }
    (normals.length() <= TOLERANCE.even * count).then_some(center)
}

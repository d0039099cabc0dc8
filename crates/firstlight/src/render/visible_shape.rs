//! The shapes that camera rays can hit one by one, and the materials that squares of pixels see on them.

use std::f32::consts::PI;
use std::iter;

use super::square::Square;
use crate::color::Rgb;
use crate::ids::SurfaceId;
use crate::integrate::TOLERANCE;
use crate::material::{Bsdf, Colors, Lobe, MeanLobe, ShadingPoint};
use crate::math::{DVec3, ErrorBound, Facet, Ray, Vec3};
use crate::scene::{At, Hit, Opacity, PlacedSpot, Scene};
use crate::shape::{Footprint, RayDifferential, SurfaceInteraction};

/// A shape that camera rays may hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum VisibleShape {
    Sphere(u32),
    Parallelogram(u32),
    /// A plane, by its number among the placed things.
    Plane(u32),
    /// A flat facet of a mesh that all rays of a square provably see.
    Facet(Facet),
    /// The shape of a light.
    Light(u32),
    /// Everything in the trees together. It is bounded.
    Trees,
    /// Everything that is not opaque together.
    Layers,
}

/// The material at the center of a square of pixels.
struct SquareBsdf {
    bsdf: Bsdf,
    is_constant: bool,
    /// The relative growth of a pixel's footprint over the square; `None` at a rim.
    growth: Option<f32>,
}

/// The mean of the materials that some camera rays see.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeanBsdf {
    pub bsdf: Bsdf,
    /// Whether all of them are the same.
    pub is_constant: bool,
    /// The largest difference of their colours, channel by channel.
    pub contrast: Colors,
    /// Whether their lobes differ too much for one that stands for all: then `bsdf` has that of the first.
    pub lobes_differ: bool,
}

impl MeanBsdf {
    /// The mean of one material.
    pub fn constant(bsdf: Bsdf) -> MeanBsdf {
        MeanBsdf { bsdf, is_constant: true, contrast: Colors::BLACK, lobes_differ: false }
    }

    /// Whether the widths of lobes are off their mean by no more than such a part of it.
    pub fn spans(lobes: impl IntoIterator<Item = Lobe>, part: f32) -> bool {
        let mut mean = MeanLobe::new(Lobe::None);
        lobes.into_iter().for_each(|lobe| mean.add(lobe));
        mean.mean(part).is_some()
    }

    /// The mean of at least one material.
    pub fn of(mut bsdfs: impl Iterator<Item = Bsdf>) -> Option<MeanBsdf> {
        let first = bsdfs.next()?;
        let mut same = 0;
        let is_other = |bsdf: &Bsdf| {
            same += 1;
            *bsdf != first
        };
        let Some(other) = bsdfs.find(is_other) else { return Some(MeanBsdf::constant(first)) };
        let bsdfs = iter::repeat_n(first, same - 1).chain([other]).chain(bsdfs);
        let (mut sum, mut count) = (first, 1.0f32);
        let (mut least, mut most) = (first.colors, first.colors);
        let mut lobes = MeanLobe::new(first.lobe);
        for bsdf in bsdfs {
            sum.colors += bsdf.colors;
            sum.ambient += bsdf.ambient;
            count += 1.0;
            (least, most) = (least.min(bsdf.colors), most.max(bsdf.colors));
            lobes.add(bsdf.lobe);
        }
        let part = 1.0 / count;
        let lobe = lobes.mean(TOLERANCE.same_lobe);
        let lobes_differ = lobe.is_none();
        let lobe = lobe.unwrap_or(first.lobe);
        let bsdf = Bsdf { colors: sum.colors * part, ambient: sum.ambient * part, lobe };
        Some(MeanBsdf { bsdf, is_constant: false, contrast: most + least * -1.0, lobes_differ })
    }
}

impl VisibleShape {
    /// All shapes that camera rays of a scene may hit.
    pub fn all(scene: &Scene) -> Vec<VisibleShape> {
        let geometry = &scene.geometry;
        let mut all = Vec::new();
        if geometry.listed {
            let spheres = 0..geometry.spheres.len();
            all.extend(spheres.filter(|i| geometry.spheres[*i].seen).map(|i| VisibleShape::Sphere(i as u32)));
            let flats = &geometry.parallelograms;
            all.extend((0..flats.len()).filter(|i| flats[*i].seen).map(|i| VisibleShape::Parallelogram(i as u32)));
        }
        let is_seen = |thing: &u32| geometry.placed[*thing as usize].camera != Opacity::Clear;
        all.extend(geometry.unbounded.iter().copied().filter(is_seen).map(VisibleShape::Plane));
        all.extend(geometry.has_boxes().then_some(VisibleShape::Trees));
        all.extend(scene.has_layers().then_some(VisibleShape::Layers));
        let visible = |i: &usize| scene.lights[*i].area().is_some_and(|area| area.visible);
        all.extend((0..scene.lights.len()).filter(visible).map(|i| VisibleShape::Light(i as u32)));
        all
    }

    /// The shape of a hit, if it is one by itself.
    #[inline(always)]
    pub fn of(scene: &Scene, hit: &Hit) -> Option<VisibleShape> {
        match hit.at {
            At::Sphere(i) => Some(VisibleShape::Sphere(i)),
            At::Parallelogram(i) => Some(VisibleShape::Parallelogram(i)),
            At::Placed(i, PlacedSpot::Part(_)) if scene.geometry.is_plane(i) => Some(VisibleShape::Plane(i)),
            _ => None,
        }
    }

    /// The distance along a ray at which it hits the shape.
    #[inline(always)]
    pub fn intersect(self, scene: &Scene, ray: &Ray) -> Option<f64> {
        match self {
            VisibleShape::Sphere(i) => scene.geometry.spheres[i as usize].shape.intersect(ray),
            VisibleShape::Parallelogram(i) => scene.geometry.parallelograms[i as usize].shape.intersect(ray),
            VisibleShape::Plane(i) => scene.geometry.meet_plane(i, ray),
            VisibleShape::Facet(facet) => scene.geometry.facet(facet).intersect(ray),
            VisibleShape::Light(i) => scene.lights[i as usize].area()?.shape.intersect(ray),
            VisibleShape::Trees | VisibleShape::Layers => unreachable!("the trees hold many shapes"),
        }
    }

    #[inline(always)]
    pub fn surface(self, scene: &Scene) -> SurfaceId {
        match self {
            VisibleShape::Sphere(i) => scene.geometry.spheres[i as usize].surface,
            VisibleShape::Parallelogram(i) => scene.geometry.parallelograms[i as usize].surface,
            VisibleShape::Plane(i) => scene.geometry.placed[i as usize].surface,
            VisibleShape::Facet(facet) => scene.geometry.facet_surface(facet),
            VisibleShape::Light(i) => SurfaceId(scene.geometry.surfaces.len() as u32 + i),
            VisibleShape::Trees | VisibleShape::Layers => unreachable!("the trees hold many shapes"),
        }
    }

    /// The hit of a ray that hits the shape at the distance `t`.
    #[inline(always)]
    pub fn hit_at(self, scene: &Scene, ray: &Ray, t: f64) -> Hit {
        let at = match self {
            VisibleShape::Sphere(i) => At::Sphere(i),
            VisibleShape::Parallelogram(i) => At::Parallelogram(i),
            VisibleShape::Plane(i) => At::Placed(i, PlacedSpot::Part(0)),
            VisibleShape::Facet(facet) => scene.geometry.on_facet(facet, ray.o.as_dvec3() + ray.d.as_dvec3() * t),
            VisibleShape::Light(_) => At::Light,
            VisibleShape::Trees | VisibleShape::Layers => unreachable!("the trees hold many shapes"),
        };
        Hit { t, surface: self.surface(scene), at }
    }

    /// The surface at that hit.
    pub fn interaction(self, scene: &Scene, ray: &Ray, t: f64, differential: &RayDifferential) -> SurfaceInteraction {
        scene.local_surface(ray, &self.hit_at(scene, ray, t), differential)
    }

    /// The material at that hit.
    pub fn bsdf(self, scene: &Scene, ray: &Ray, t: f64, differential: &RayDifferential) -> Bsdf {
        let si = self.interaction(scene, ray, t, differential);
        scene.bsdf(&si)
    }

    /// The shading point at that hit.
    #[inline(always)]
    pub fn point(self, scene: &Scene, ray: &Ray, t: f64, bsdf: &Bsdf) -> ShadingPoint {
        let place = match self {
            VisibleShape::Sphere(i) => scene.geometry.spheres[i as usize].shape.place(ray, t),
            VisibleShape::Parallelogram(i) => scene.geometry.parallelograms[i as usize].shape.place(ray, t),
            _ => {
                let si = self.interaction(scene, ray, t, &RayDifferential::default());
                return ShadingPoint::of(&si, bsdf, &scene.ambient);
            }
        };
        self.facing(scene, place, -ray.d, bsdf)
    }

    /// The shading point that is nearest to `q`, seen along `wo`. Points `q` of flat shapes lie next to them.
    pub fn point_near(self, scene: &Scene, q: DVec3, wo: Vec3, bsdf: &Bsdf) -> ShadingPoint {
        let place = match self {
            VisibleShape::Sphere(i) => scene.geometry.spheres[i as usize].shape.nearest_place(q),
            VisibleShape::Parallelogram(i) => scene.geometry.parallelograms[i as usize].shape.nearest_place(q),
            _ => return self.point(scene, &Ray { o: q.as_vec3(), d: -wo }, 0.0, bsdf),
        };
        self.facing(scene, place, wo, bsdf)
    }

    /// A shading point whose normal is on the viewer's side.
    #[inline(always)]
    fn facing(
        self,
        scene: &Scene,
        (p, error, normal): (Vec3, ErrorBound, Vec3),
        wo: Vec3,
        bsdf: &Bsdf,
    ) -> ShadingPoint {
        let error = error.widened(scene.geometry.rounding);
        let (n, surface) = (if normal.dot(wo) < 0.0 { -normal } else { normal }, self.surface(scene));
        let receives_shadow = scene.geometry.surfaces[surface.index()].receives_shadow;
        let base = bsdf.base(&scene.ambient);
        ShadingPoint { surface, receives_shadow, base, ..ShadingPoint::new(p, error, n, wo, bsdf) }
    }

    /// The change of the normal in radians per metre.
    pub fn curvature(self, scene: &Scene) -> f32 {
        match self {
            VisibleShape::Sphere(i) => (1.0 / scene.geometry.spheres[i as usize].shape.r) as f32,
            _ => 0.0,
        }
    }

    /// The material of a square of pixels that see only this shape, if it is constant there.
    pub fn constant_bsdf(self, scene: &Scene, square: Square) -> Option<Bsdf> {
        self.square_bsdf(scene, square).and_then(|of| of.is_constant.then_some(of.bsdf))
    }

    /// The mean material over the camera rays of a pixel that sees only this shape; `None` where lobes differ, and of
    /// materials that emit light or have a coat.
    pub fn mean_bsdf(self, scene: &Scene, pixel: [u32; 2]) -> Option<MeanBsdf> {
        let material = scene.geometry.surfaces[self.surface(scene).index()].material;
        if material.is_some_and(|material| !scene.materials[material.index()].is_one_bsdf()) {
            return None;
        }
        if let Some(whole) = self.square_bsdf(scene, Square { x: pixel[0], y: pixel[1], side: 1 }) {
            if whole.is_constant {
                return Some(MeanBsdf::constant(whole.bsdf));
            }
            if let Some(mean) = self.mean_of_textures(scene, pixel, &whole) {
                return Some(mean);
            }
        }
        self.mean_of_parts(scene, pixel, scene.antialiasing).filter(|mean| !mean.lobes_differ)
    }

    /// The material at the center of a square of pixels that see only this shape.
    fn square_bsdf(self, scene: &Scene, square: Square) -> Option<SquareBsdf> {
        let center = |from: u32| from as f32 + 0.5 * square.side as f32;
        let (ray, differential) = scene.camera.local_ray(center(square.x), center(square.y), square.side as f32);
        let t = self.intersect(scene, &ray)?;
        let si = self.interaction(scene, &ray, t, &differential);
        let growth = self.growth(scene, &si, &ray, t, &differential);
        let material = &scene.materials[si.material.index()];
        let is_constant = growth.is_some_and(|growth| {
            // Half a differential leads to the border, and half a pixel beyond are data of the pixels there
            let data = if material.has_data() { 0.5 * si.footprints_per_pixel } else { 0.0 };
            let part = (0.5 + 2.0 * growth).min(1.0) + data;
            let grown = si.with_footprints(part);
            let grows = 1.0 + 2.0 * growth;
            material.ignores(si.slope_variance * (grows * grows))
                && material.is_even(&grown, &scene.textures, &scene.ambient)
        });
        Some(SquareBsdf { bsdf: material.bsdf(&si, &scene.textures, &scene.ambient), is_constant, growth })
    }

    /// The mean material of a pixel by the exact means of textures over parallelograms: from its center, if the
    /// footprint of the whole pixel is nearly a parallelogram, else from its quarters, if they agree with the center.
    fn mean_of_textures(self, scene: &Scene, pixel: [u32; 2], whole: &SquareBsdf) -> Option<MeanBsdf> {
        let surface = &scene.geometry.surfaces[self.surface(scene).index()];
        let (contrast, ambient) = scene.materials[surface.material?.index()].contrast(&scene.textures)?;
        // At a rim footprints are not parallelograms
        let growth = whole.growth.filter(|_| scene.antialiasing > 2)?;
        let is_within = |off: Rgb, mean: Rgb| {
            let allowed = mean * TOLERANCE.same_mean;
            off.r <= allowed.r && off.g <= allowed.g && off.b <= allowed.b
        };
        let bsdf = whole.bsdf;
        // An edge between two colours is off by at most an eighth of the growth of the pixel
        let off = 0.125 * growth;
        let is_within_by = |part: f32| {
            let mut colors = contrast.0.into_iter().zip(bsdf.colors.0);
            is_within(ambient * (off * part), bsdf.ambient)
                && colors.all(|(contrast, mean)| is_within(contrast * (off * part), mean))
        };
        let mean = MeanBsdf { bsdf, is_constant: false, contrast, lobes_differ: false };
        if is_within_by(1.0) {
            return Some(mean);
        }
        let quarters = self.mean_of_parts(scene, pixel, 2)?;
        // One colour, but beside an edge, which quarters can miss by a quarter of that
        if quarters.contrast == Colors::BLACK && !is_within_by(0.25) {
            return None;
        }
        let is_same = |one: Rgb, other: Rgb| is_within((one + other * -1.0).map(f32::abs), other);
        let is_same = is_same(bsdf.ambient, quarters.bsdf.ambient)
            && bsdf.colors.0.into_iter().zip(quarters.bsdf.colors.0).all(|(one, other)| is_same(one, other));
        // The quarters are means of rays: the rays differ by at most twice as much along each axis
        (is_same && !quarters.lobes_differ).then_some(MeanBsdf {
            bsdf: quarters.bsdf,
            contrast: quarters.contrast * 2.0,
            ..mean
        })
    }

    /// The mean material over the n x n parts of a pixel that sees only this shape.
    fn mean_of_parts(self, scene: &Scene, [i, j]: [u32; 2], n: u32) -> Option<MeanBsdf> {
        let parts = (0..n).flat_map(|row| (0..n).map(move |column| [column, row]));
        MeanBsdf::of(parts.filter_map(|[column, row]| {
            let center = |from: u32, part: u32| from as f32 + (part as f32 + 0.5) / n as f32;
            let (ray, differential) = scene.camera.local_ray(center(i, column), center(j, row), 1.0 / n as f32);
            // All rays hit the shape but for roundings
            let t = self.intersect(scene, &ray)?;
            Some(self.bsdf(scene, &ray, t, &differential))
        }))
    }

    /// The relative growth of a footprint within itself: with the distance, and on a round shape by the slope and
    /// around the poles of its uv coordinates. `None` at a rim, where a footprint is not bounded by its differentials.
    fn growth(
        self,
        scene: &Scene,
        si: &SurfaceInteraction,
        ray: &Ray,
        t: f64,
        differential: &RayDifferential,
    ) -> Option<f32> {
        let [across, down] = differential.on_plane(ray.d, t as f32, si.ng, f32::MAX.sqrt() * 0.25);
        let length = across.length() + down.length();
        let (curvature, away) = (self.curvature(scene), length / t as f32);
        if curvature == 0.0 {
            return Some(away);
        }
        let (turn, cos) = (0.5 * curvature * length, si.ng.dot(si.wo));
        let Footprint { dx, dy, .. } = si.footprint;
        (turn < 0.25 * cos).then(|| turn / cos + away + PI * (dx.abs() + dy.abs()).max_element())
    }
}

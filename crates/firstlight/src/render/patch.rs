//! One surface in one pixel: what is shaded once.

use arrayvec::ArrayVec;

use super::hits::camera_ray;
use super::resolve::PixelTerms;
use super::solo::{self, Candidate};
use crate::color::Rgb;
use crate::material::{Bsdf, Colors, Lobe};
use crate::math::{Vec3, square};
use crate::scene::{Hit, Scene};
use crate::shape::SurfaceInteraction;

/// A surface in a pixel.
#[derive(Clone)]
pub(crate) struct Patch {
    /// Where it is shaded.
    pub si: SurfaceInteraction,
    /// Its material; the colours are the mean over its rays.
    pub bsdf: Bsdf,
    /// The camera rays of the pixel that see it.
    pub rays: Rays,
    /// How far it reaches from where it is shaded, in metres, and how far its normal turns on the way, in radians.
    pub reach: f32,
    pub turn: f32,
    /// How far off its middle it is shaded, as a part of `reach`.
    pub off: f32,
    /// How far the mean of its normals is from that where it is shaded: far where facets make a crease.
    pub skew: f32,
    /// Whether more than colours change over it: then it is shaded at each of its rays.
    pub uneven: bool,
    /// How far its colours differ.
    pub contrast: Contrast,
}

/// How far colours of the rays of a patch differ, channel by channel.
pub(crate) type Contrast = Colors;

/// The camera rays that see a patch.
#[derive(Clone)]
pub(crate) enum Rays {
    /// These.
    Some(Vec<Member>),
    /// All of the pixel's, which meet nothing else.
    All(Candidate),
    /// Those that are bits of this, row by row: they meet this first.
    Mask(Candidate, u64),
}

/// The most rays across a pixel for which there are masks.
const MASKED: u32 = 8;

/// What one camera ray sees of a patch.
#[derive(Clone)]
pub(crate) struct Member {
    pub si: SurfaceInteraction,
    pub bsdf: Bsdf,
    /// Where on the pixel, in rays.
    at: [f32; 2],
}

/// Normals that differ more than this cosine belong to different patches.
const SAME_NORMAL: f32 = 0.9;
/// In radians: normals that turn less from the middle of a patch belong to it.
const MAX_TURN: f32 = 0.2;

impl Patch {
    /// Whether a camera ray that sees `si` sees the same patch.
    pub fn holds(&self, si: &SurfaceInteraction) -> bool {
        let one = &self.si;
        if one.surface != si.surface || one.material != si.material || !(one.ns.dot(si.ns) > SAME_NORMAL) {
            return false;
        }
        let apart = si.p - one.p;
        // Neither is far off the other's tangent plane
        let off = apart.dot(one.ng).abs().max(apart.dot(si.ng).abs());
        off <= 0.5 * apart.length()
    }

    /// How many of the pixel's rays see it.
    pub fn count(&self, scene: &Scene) -> u32 {
        match &self.rays {
            Rays::Some(members) => members.len() as u32,
            Rays::All(_) => scene.antialiasing * scene.antialiasing,
            Rays::Mask(_, mask) => mask.count_ones(),
        }
    }

    /// Whether it fills its pixel, and is shaded in the middle.
    pub fn is_whole(&self, scene: &Scene) -> bool {
        self.off < 0.1 && self.count(scene) == scene.antialiasing * scene.antialiasing
    }

    /// Calls `each` with what every ray sees. `pixel` is the one that the patch is in.
    pub fn for_each(&self, scene: &Scene, pixel: [u32; 2], mut each: impl FnMut(&SurfaceInteraction, &Bsdf)) {
        match &self.rays {
            Rays::Some(members) => members.iter().for_each(|member| each(&member.si, &member.bsdf)),
            Rays::All(candidate) => {
                for_each_ray(scene, pixel, *candidate, 0..square_of(scene.antialiasing), &mut each);
            }
            Rays::Mask(candidate, mask) => {
                let rays = (0..square_of(scene.antialiasing)).filter(|k| mask >> k & 1 == 1);
                for_each_ray(scene, pixel, *candidate, rays, &mut each);
            }
        }
    }

    /// The patch that fills a pixel whose rays all meet one shape.
    pub fn whole(scene: &Scene, pixel: [u32; 2], candidate: Candidate) -> Option<Patch> {
        let n = scene.antialiasing as f32;
        let (ray, differential) = scene.camera.local_ray(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5, 1.0);
        let hit = candidate.hit(scene, &ray)?;
        let si = scene.local_surface(&ray, &hit, &differential);
        // To the rays in the pixel's corners
        let [across, down] = differential.on_plane(ray.d, hit.t as f32, si.ng, f32::MAX.sqrt() * 0.25);
        let reach = 0.5 * (1.0 - 1.0 / n) * ((across + down).length().max((across - down).length()));
        let turn = (reach * candidate.curvature(scene)).min(2.0);
        let material = &scene.materials[si.material.index()];
        let mut patch = Patch {
            si,
            bsdf: material.bsdf(&si, &scene.textures),
            rays: Rays::All(candidate),
            reach,
            turn,
            off: 0.0,
            skew: 0.0,
            uneven: false,
            contrast: Contrast::default(),
        };
        if scene.antialiasing == 1 {
            // The pixel's only ray is that of its middle
            let (ray, differential) = camera_ray(scene, pixel[0], pixel[1]);
            patch.si = scene.local_surface(&ray, &hit, &differential);
        } else if !candidate.is_even_over(scene, &si, &ray, hit.t, &differential) {
            let mut mean = Mean::default();
            patch.for_each(scene, pixel, |_, bsdf| mean.add(bsdf));
            mean.apply(&mut patch);
        }
        Some(patch)
    }

    /// The patch that the rays of `mask` see, which all meet one shape first; `None` if it turns too far over the pixel
    /// to be one patch.
    fn masked(scene: &Scene, pixel: [u32; 2], candidate: Candidate, mask: u64) -> Option<Patch> {
        let n = scene.antialiasing;
        let places = || (0..n * n).filter(move |k| mask >> k & 1 == 1).map(move |k| [k % n, k / n]);
        let count = mask.count_ones() as f32;
        let sum = places().fold([0, 0], |[x, y], [column, row]| [x + column, y + row]);
        // In the middle of the rays; what hides some of the shape does not matter here
        let at = |axis: usize| pixel[axis] as f32 + (sum[axis] as f32 / count + 0.5) / n as f32;
        let (ray, differential) = scene.camera.local_ray(at(0), at(1), 1.0 / n as f32);
        let hit = candidate.hit(scene, &ray)?;
        let si = scene.local_surface(&ray, &hit, &differential);
        // How far they are, and whether around it
        let curvature = candidate.curvature(scene);
        let (mut reach, mut middle) = (0.0f32, Vec3::ZERO);
        if curvature == 0.0 {
            let [across, down] = differential.on_plane(ray.d, hit.t as f32, si.ng, f32::MAX.sqrt() * 0.25);
            let from = [0, 1].map(|axis| (at(axis) - pixel[axis] as f32) * n as f32 - 0.5);
            for [column, row] in places() {
                reach = reach.max((across * (column as f32 - from[0]) + down * (row as f32 - from[1])).length());
            }
        } else {
            for [column, row] in places() {
                let (ray, _) = camera_ray(scene, pixel[0] * n + column, pixel[1] * n + row);
                let hit = candidate.hit(scene, &ray)?;
                let way = (ray.o.as_dvec3() + ray.d.as_dvec3() * hit.t).as_vec3() - si.p;
                reach = reach.max(way.length());
                middle += way;
            }
        }
        let off = if reach > 0.0 { middle.length() / (count * reach) } else { 0.0 };
        let turn = reach * curvature;
        if turn > MAX_TURN {
            return None;
        }
        let material = &scene.materials[si.material.index()];
        let bsdf = material.bsdf(&si, &scene.textures);
        let rays = Rays::Mask(candidate, mask);
        let mut patch =
            Patch { si, bsdf, rays, reach, turn, off, skew: 0.0, uneven: false, contrast: Contrast::default() };
        // Over all of the pixel
        let (ray, whole) = scene.camera.local_ray(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5, 1.0);
        let even = candidate.hit(scene, &ray).is_some_and(|hit| {
            let si = scene.local_surface(&ray, &hit, &whole);
            candidate.is_even_over(scene, &si, &ray, hit.t, &whole)
        });
        if mask.count_ones() > 1 && !even {
            let mut mean = Mean::default();
            patch.for_each(scene, pixel, |_, bsdf| mean.add(bsdf));
            mean.apply(&mut patch);
        }
        Some(patch)
    }

    /// Finds the middle of the members, and how far they reach.
    fn settle(&mut self) {
        let Rays::Some(members) = &self.rays else { return };
        let count = members.len() as f32;
        if members.len() == 1 {
            return;
        }
        let (mut x, mut y) = (0.0, 0.0);
        let mut mean = Mean::default();
        for member in members {
            (x, y) = (x + member.at[0], y + member.at[1]);
            mean.add(&member.bsdf);
        }
        let (x, y) = (x / count, y / count);
        let distance = |member: &Member| square(member.at[0] - x) + square(member.at[1] - y);
        let nearest = members.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("a patch has members");
        let (si, bsdf) = (nearest.si, nearest.bsdf);
        self.place(si);
        self.bsdf = bsdf;
        mean.apply(self);
    }

    /// Has it shaded at `si`.
    fn place(&mut self, si: SurfaceInteraction) {
        let Rays::Some(members) = &self.rays else { return };
        let (mut middle, mut normals) = (Vec3::ZERO, Vec3::ZERO);
        let (mut reach, mut turn, mut uneven) = (0.0f32, 0.0f32, false);
        for member in members {
            uneven |= member.si.receives_shadow != si.receives_shadow;
            reach = reach.max((member.si.lit_from - si.lit_from).length());
            turn = turn.max((member.si.ns - si.ns).length()).max((member.si.horizon - si.horizon).length());
            middle += member.si.lit_from - si.lit_from;
            normals += member.si.ns - si.ns;
        }
        let count = members.len() as f32;
        let off = middle.length() / count;
        self.skew = normals.length() / count;
        self.off = if reach > 0.0 { off / reach } else { 0.0 };
        (self.si, self.reach, self.turn, self.uneven) = (si, reach, turn, uneven);
    }
}

/// The mean of materials in numbers.
#[derive(Default)]
struct Mean {
    colors: Colors,
    ambient: Rgb,
    count: u32,
    /// The least and the most of diffuse, of specular.
    range: Option<[Colors; 2]>,
    lobe: Option<crate::material::Lobe>,
    uneven: bool,
}

impl Mean {
    fn add(&mut self, bsdf: &Bsdf) {
        self.colors += bsdf.colors;
        self.ambient += bsdf.ambient;
        self.count += 1;
        let [least, most] = self.range.get_or_insert([bsdf.colors; 2]);
        (*least, *most) = (least.min(bsdf.colors), most.max(bsdf.colors));
        // Any ray that sees a highlight says what it is like
        if bsdf.lobe != Lobe::None {
            match self.lobe {
                None => self.lobe = Some(bsdf.lobe),
                Some(lobe) => self.uneven |= lobe != bsdf.lobe,
            }
        }
    }

    fn apply(self, patch: &mut Patch) {
        let mean = |sum: Rgb| sum * (1.0 / self.count as f32);
        let lobe = self.lobe.unwrap_or(patch.bsdf.lobe);
        patch.bsdf = Bsdf { colors: self.colors.map(mean), ambient: mean(self.ambient), lobe };
        patch.uneven |= self.uneven;
        if let Some([least, most]) = self.range {
            patch.contrast = most + least * -1.0;
        }
    }
}

fn square_of(n: u32) -> u32 {
    n * n
}

fn for_each_ray(
    scene: &Scene,
    [i, j]: [u32; 2],
    candidate: Candidate,
    rays: impl Iterator<Item = u32>,
    each: &mut impl FnMut(&SurfaceInteraction, &Bsdf),
) {
    let n = scene.antialiasing;
    for k in rays {
        let (ray, differential) = camera_ray(scene, i * n + k % n, j * n + k / n);
        // It is proved that it meets it; a rounding may say otherwise
        let Some(hit) = candidate.hit(scene, &ray) else { continue };
        let si = scene.local_surface(&ray, &hit, &differential);
        each(&si, &scene.materials[si.material.index()].bsdf(&si, &scene.textures));
    }
}

/// The most shapes in a pixel for which there are masks.
const KINDS: usize = 8;

/// What the rays of a pixel see.
#[derive(Default)]
pub(crate) struct PixelPatches {
    pub patches: Vec<Patch>,
    /// But for ambient light, which is that of the patches.
    pub terms: PixelTerms,
    /// Lists that are not used any more, for their memory.
    pub spare: Vec<Vec<Member>>,
}

impl PixelPatches {
    pub fn clear(&mut self) {
        let spare = &mut self.spare;
        spare.extend(self.patches.drain(..).filter_map(|patch| match patch.rays {
            Rays::Some(members) => Some(members),
            _ => None,
        }));
        self.terms = PixelTerms::default();
    }

    /// Sorts what the rays of a pixel see that meet nothing but these. `once`: see [`collect`](Self::collect).
    pub fn collect_listed(&mut self, scene: &Scene, [i, j]: [u32; 2], once: bool, candidates: &[Candidate]) {
        let n = scene.antialiasing;
        let first = |k: u32| {
            let (ray, _) = camera_ray(scene, i * n + k % n, j * n + k / n);
            solo::first(scene, candidates, &ray)
        };
        let one_by_one = |pixel: &mut Self| {
            pixel.collect(scene, [i, j], once, |column, row| first(row * n + column).map(|(_, hit)| hit));
        };
        if !once || n > MASKED {
            return one_by_one(self);
        }
        self.clear();
        let mut masks: ArrayVec<(usize, u64), KINDS> = ArrayVec::new();
        for k in 0..n * n {
            let Some((place, _)) = first(k) else {
                self.terms.background += 1;
                continue;
            };
            if let Candidate::Light(light) = candidates[place] {
                self.terms.emission += scene.lights[light as usize].radiance;
                continue;
            }
            match masks.iter().position(|(known, _)| *known == place) {
                Some(known) => masks[known].1 |= 1 << k,
                None if masks.is_full() => return one_by_one(self),
                None => masks.push((place, 1 << k)),
            }
        }
        for (place, mask) in masks {
            match Patch::masked(scene, [i, j], candidates[place], mask) {
                Some(patch) => self.patches.push(patch),
                None => return one_by_one(self),
            }
        }
    }

    /// Sorts what the rays of a pixel see. `once` puts what is one surface together; without it each ray is a patch.
    pub fn collect(&mut self, scene: &Scene, [i, j]: [u32; 2], once: bool, hit: impl Fn(u32, u32) -> Option<Hit>) {
        self.clear();
        let n = scene.antialiasing;
        for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
            let Some(hit) = hit(column, row) else {
                self.terms.background += 1;
                continue;
            };
            if let Some(light) = hit.surface.index().checked_sub(scene.geometry.surfaces.len()) {
                self.terms.emission += scene.lights[light].radiance;
                continue;
            }
            let (ray, differential) = camera_ray(scene, i * n + column, j * n + row);
            let si = scene.local_surface(&ray, &hit, &differential);
            let bsdf = scene.materials[si.material.index()].bsdf(&si, &scene.textures);
            let member = Member { si, bsdf, at: [column as f32, row as f32] };
            let same = self.patches.iter_mut().find(|patch| once && patch.holds(&si));
            match same.map(|patch| &mut patch.rays) {
                Some(Rays::Some(members)) => members.push(member),
                _ => {
                    let mut members = self.spare.pop().unwrap_or_default();
                    members.clear();
                    members.push(member);
                    let rays = Rays::Some(members);
                    self.patches.push(Patch {
                        si,
                        bsdf,
                        rays,
                        reach: 0.0,
                        turn: 0.0,
                        off: 0.0,
                        skew: 0.0,
                        uneven: false,
                        contrast: Contrast::default(),
                    });
                }
            }
        }
        self.patches.iter_mut().for_each(Patch::settle);
        // Where one surface fills the pixel, it is shaded in the middle
        if let [patch] = &mut self.patches[..]
            && patch.off > 0.0
            && patch.count(scene) == n * n
        {
            let (ray, differential) = scene.camera.local_ray(i as f32 + 0.5, j as f32 + 0.5, 1.0);
            let hit = scene.intersect_local(&ray).filter(|hit| hit.surface == patch.si.surface);
            if let Some(si) = hit.map(|hit| scene.local_surface(&ray, &hit, &differential))
                && patch.holds(&si)
            {
                patch.place(si);
            }
        }
    }
}

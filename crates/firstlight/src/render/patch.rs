//! One surface in one pixel: what is shaded once.

use super::hits::camera_ray;
use super::solo::Candidate;
use crate::color::Rgb;
use crate::material::Bsdf;
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
    /// Whether more than colours change over it: then it is shaded at each of its rays.
    pub uneven: bool,
}

/// The camera rays that see a patch.
#[derive(Clone)]
pub(crate) enum Rays {
    /// These.
    Some(Vec<Member>),
    /// All of the pixel's, which meet nothing else.
    All(Candidate),
}

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

impl Patch {
    /// Whether a camera ray that sees `si` sees the same patch.
    fn holds(&self, si: &SurfaceInteraction) -> bool {
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
            Rays::All(candidate) => for_each_ray(scene, pixel, *candidate, &mut each),
        }
    }

    /// The patch that fills a pixel whose rays all meet one shape.
    pub fn whole(scene: &Scene, pixel: [u32; 2], candidate: Candidate) -> Option<Patch> {
        let n = scene.antialiasing as f32;
        let (ray, differential) = scene.camera.ray(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5, 1.0);
        let hit = candidate.hit(scene, &ray)?;
        let si = scene.surface(&ray, &hit, &differential);
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
            uneven: false,
        };
        if scene.antialiasing == 1 {
            // The pixel's only ray is that of its middle
            let (ray, differential) = camera_ray(scene, pixel[0], pixel[1]);
            patch.si = scene.surface(&ray, &hit, &differential);
        } else if !material.is_even(&si, &scene.textures) {
            let mut mean = Mean::default();
            for_each_ray(scene, pixel, candidate, &mut |_, bsdf| mean.add(bsdf));
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
        let mut middle = Vec3::ZERO;
        let (mut reach, mut turn, mut uneven) = (0.0f32, 0.0f32, false);
        for member in members {
            uneven |= member.si.receives_shadow != si.receives_shadow;
            reach = reach.max((member.si.lit_from - si.lit_from).length());
            turn = turn.max((member.si.ns - si.ns).length());
            middle += member.si.lit_from - si.lit_from;
        }
        let off = middle.length() / members.len() as f32;
        self.off = if reach > 0.0 { off / reach } else { 0.0 };
        (self.si, self.reach, self.turn, self.uneven) = (si, reach, turn, uneven);
    }
}

/// The mean of materials in numbers.
#[derive(Default)]
struct Mean {
    diffuse: Rgb,
    specular: Rgb,
    ambient: Rgb,
    count: u32,
    lobe: Option<crate::material::Lobe>,
    uneven: bool,
}

impl Mean {
    fn add(&mut self, bsdf: &Bsdf) {
        self.diffuse += bsdf.diffuse;
        self.specular += bsdf.specular;
        self.ambient += bsdf.ambient;
        self.count += 1;
        // Any ray that sees a highlight says what it is like
        if !bsdf.specular.is_black() {
            match self.lobe {
                None => self.lobe = Some(bsdf.lobe),
                Some(lobe) => self.uneven |= lobe != bsdf.lobe,
            }
        }
    }

    fn apply(self, patch: &mut Patch) {
        let mean = |sum: Rgb| sum * (1.0 / self.count as f32);
        let lobe = self.lobe.unwrap_or(patch.bsdf.lobe);
        let (diffuse, specular, ambient) = (mean(self.diffuse), mean(self.specular), mean(self.ambient));
        patch.bsdf = Bsdf { diffuse, specular, ambient, lobe };
        patch.uneven |= self.uneven;
    }
}

fn for_each_ray(
    scene: &Scene,
    [i, j]: [u32; 2],
    candidate: Candidate,
    each: &mut impl FnMut(&SurfaceInteraction, &Bsdf),
) {
    let n = scene.antialiasing;
    for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
        let (ray, differential) = camera_ray(scene, i * n + column, j * n + row);
        // It is proved that it meets it; a rounding may say otherwise
        let Some(hit) = candidate.hit(scene, &ray) else { continue };
        let si = scene.surface(&ray, &hit, &differential);
        each(&si, &scene.materials[si.material.index()].bsdf(&si, &scene.textures));
    }
}

/// What the rays of a pixel see.
#[derive(Default)]
pub(crate) struct PixelPatches {
    pub patches: Vec<Patch>,
    pub background: u32,
    pub emission: Rgb,
}

impl PixelPatches {
    pub fn clear(&mut self) {
        self.patches.clear();
        (self.background, self.emission) = (0, Rgb::BLACK);
    }

    /// Sorts what the rays of a pixel see. `once` puts what is one surface together; without it each ray is a patch.
    pub fn collect(&mut self, scene: &Scene, [i, j]: [u32; 2], once: bool, hit: impl Fn(u32, u32) -> Option<Hit>) {
        self.clear();
        let n = scene.antialiasing;
        for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column))) {
            let Some(hit) = hit(column, row) else {
                self.background += 1;
                continue;
            };
            if let Some(light) = hit.surface.index().checked_sub(scene.geometry.surfaces.len()) {
                self.emission += scene.lights[light].radiance;
                continue;
            }
            let (ray, differential) = camera_ray(scene, i * n + column, j * n + row);
            let si = scene.surface(&ray, &hit, &differential);
            let bsdf = scene.materials[si.material.index()].bsdf(&si, &scene.textures);
            let member = Member { si, bsdf, at: [column as f32, row as f32] };
            let same = self.patches.iter_mut().find(|patch| once && patch.holds(&si));
            match same.map(|patch| &mut patch.rays) {
                Some(Rays::Some(members)) => members.push(member),
                _ => {
                    let rays = Rays::Some(vec![member]);
                    self.patches.push(Patch { si, bsdf, rays, reach: 0.0, turn: 0.0, off: 0.0, uneven: false });
                }
            }
        }
        self.patches.iter_mut().for_each(Patch::settle);
        // Where one surface fills the pixel, it is shaded in the middle
        if let [patch] = &mut self.patches[..]
            && patch.off > 0.0
            && patch.count(scene) == n * n
        {
            let (ray, differential) = scene.camera.ray(i as f32 + 0.5, j as f32 + 0.5, 1.0);
            let hit = scene.intersect(&ray).filter(|hit| hit.surface == patch.si.surface);
            if let Some(si) = hit.map(|hit| scene.surface(&ray, &hit, &differential))
                && patch.holds(&si)
            {
                patch.place(si);
            }
        }
    }
}

//! One surface in one pixel: what is shaded once.

use super::hits::camera_ray;
use crate::color::Rgb;
use crate::material::Bsdf;
use crate::math::Vec3;
use crate::scene::{Hit, Scene};
use crate::shape::SurfaceInteraction;

/// A surface in a pixel.
#[derive(Clone)]
pub(crate) struct Patch {
    /// Where it is shaded.
    pub si: SurfaceInteraction,
    /// Its material; the colours are the mean over the members.
    pub bsdf: Bsdf,
    /// The camera rays of the pixel that see it, row by row.
    pub members: Vec<Member>,
    /// How far it reaches from where it is shaded, in metres, and how far its normal turns on the way, in radians.
    pub reach: f32,
    pub turn: f32,
    /// Whether its highlight changes over it, or anything else but colours: then it is shaded at each of its rays.
    pub uneven: bool,
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
        let one = &self.members[0].si;
        if one.surface != si.surface || one.material != si.material || !(one.ns.dot(si.ns) > SAME_NORMAL) {
            return false;
        }
        let apart = si.p - one.p;
        // Neither is far off the other's tangent plane
        let off = apart.dot(one.ng).abs().max(apart.dot(si.ng).abs());
        off <= 0.5 * apart.length()
    }
}

/// The patches of a pixel, and what else its rays see.
pub(crate) struct PixelPatches {
    pub patches: Vec<Patch>,
    pub background: u32,
    pub emission: Rgb,
}

impl PixelPatches {
    pub fn new() -> Self {
        PixelPatches { patches: Vec::new(), background: 0, emission: Rgb::BLACK }
    }

    /// Sorts what the rays of pixel (`i`, `j`) see. `once` puts what is one surface together; without it each ray is a patch.
    pub fn collect(&mut self, scene: &Scene, [i, j]: [u32; 2], once: bool, hit: impl Fn(u32, u32) -> Option<Hit>) {
        self.patches.clear();
        (self.background, self.emission) = (0, Rgb::BLACK);
        let n = scene.antialiasing;
        for row in 0..n {
            for column in 0..n {
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
                match self.patches.iter_mut().find(|patch| once && patch.holds(&si)) {
                    Some(patch) => patch.members.push(member),
                    None => self.patches.push(Patch {
                        si,
                        bsdf,
                        members: vec![member],
                        reach: 0.0,
                        turn: 0.0,
                        uneven: false,
                    }),
                }
            }
        }
        for patch in &mut self.patches {
            patch.settle();
        }
    }
}

impl Patch {
    /// Finds the middle of the members, and how far they reach.
    fn settle(&mut self) {
        let count = self.members.len() as f32;
        if self.members.len() == 1 {
            return;
        }
        let (mut x, mut y) = (0.0, 0.0);
        let (mut diffuse, mut specular, mut ambient) = (Rgb::BLACK, Rgb::BLACK, Rgb::BLACK);
        for member in &self.members {
            (x, y) = (x + member.at[0], y + member.at[1]);
            diffuse += member.bsdf.diffuse;
            specular += member.bsdf.specular;
            ambient += member.bsdf.ambient;
        }
        let (x, y) = (x / count, y / count);
        let distance = |member: &Member| (member.at[0] - x).powi(2) + (member.at[1] - y).powi(2);
        let nearest = self.members.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let nearest = nearest.expect("a patch has members").clone();
        self.si = nearest.si;
        let mean = |sum: Rgb| sum * (1.0 / count);
        self.bsdf = Bsdf { diffuse: mean(diffuse), specular: mean(specular), ambient: mean(ambient), ..nearest.bsdf };
        // Any member that has a highlight says what it is like
        let mut lobe = None;
        for member in &self.members {
            if !member.bsdf.specular.is_black() {
                match lobe {
                    None => lobe = Some(member.bsdf.lobe),
                    Some(lobe) => self.uneven |= lobe != member.bsdf.lobe,
                }
            }
            self.uneven |= member.si.receives_shadow != self.si.receives_shadow;
            let apart: Vec3 = member.si.p - self.si.p;
            self.reach = self.reach.max(apart.length());
            self.turn = self.turn.max((member.si.ns - self.si.ns).length());
        }
        if let Some(lobe) = lobe {
            self.bsdf.lobe = lobe;
        }
    }
}

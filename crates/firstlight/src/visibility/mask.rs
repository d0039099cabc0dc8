//! Masks of the hidden samples of a light, as one point sees it.

use fearless_simd::{Level, f32x16, prelude::*};

use super::Viewpoint;
use super::target::{SampleBlock, Target};
use super::view::ShadowView;
use crate::accel::{RayPacket16, dispatch_all};
use crate::math::{LANES, ShadowRay, UNIT_ROUNDOFF, Vec3, least_and_most};
use crate::scene::{Scene, ShadowMesh, ShadowRays};
use crate::shape::{LightSeen, SeenParts, SeenTriangle, bits};

impl ShadowView {
    /// Fills [`hidden`](Self::hidden) with the samples that triangles, solids and point sets hide, and those that are
    /// certainly below the horizon. Spheres and parallelograms are not tested here.
    ///
    /// `asked` is a mask of the samples to test; `None` for all. Returns the number of samples whose rays were traced.
    pub fn mask(
        &mut self,
        level: Level,
        scene: &Scene,
        target: &Target,
        asked: Option<&[u16]>,
        point: &Viewpoint,
    ) -> u64 {
        let count = target.blocks.len();
        let mut traced = 0;
        self.hidden.clear();
        if count == 0 || !self.needs_mask() {
            return 0;
        }
        self.in_space.clear();
        // Samples that are not to be tested count as hidden
        self.in_space.extend(target.blocks.iter().map(|block| {
            let Some(asked) = asked else { return !block.present };
            if target.is_in_order {
                return !asked[block.sample[0] as usize / LANES];
            }
            let is_asked = |k: u32| asked[k as usize / LANES] >> (k as usize % LANES) & 1;
            let lanes = block.sample.iter().enumerate();
            !lanes.fold(0, |lanes, (lane, k)| lanes | is_asked(*k) << lane) | !block.present
        }));
        dispatch_all!(level, simd => self.mask_triangles(simd, scene, target, point));
        if self.trees || !self.others.is_empty() {
            traced = self.trace(level, scene, target, point);
        }
        if target.is_in_order {
            self.hidden.extend_from_slice(&self.in_space);
            return traced;
        }
        // From the order of the blocks to that of the light's samples
        self.hidden.resize(count, 0);
        for (block, hidden) in target.blocks.iter().zip(&self.in_space) {
            for lane in bits(u64::from(hidden & block.present)) {
                let k = block.sample[lane] as usize;
                self.hidden[k / LANES] |= 1 << (k % LANES);
            }
        }
        traced
    }

    #[inline(always)]
    fn mask_triangles<S: Simd>(&mut self, simd: S, scene: &Scene, target: &Target, point: &Viewpoint) {
        // Samples below the horizon count as hidden
        let seen = target.hull.from(point.p);
        let wrong = point.horizon.abs().element_sum() * seen.longest * (64.0 * UNIT_ROUNDOFF);
        let (middle, reach) = seen.range(point.horizon);
        if middle - reach < wrong {
            let slopes = seen.axes.map(|axis| point.horizon.dot(axis));
            for (block, hidden) in target.blocks.iter().zip(&mut self.in_space) {
                let [x, y, z] = [0, 1, 2].map(|axis: usize| f32x16::load_array_ref(simd, &block.at[axis]));
                let height = z * slopes[2] + (y * slopes[1] + (x * slopes[0] + middle));
                *hidden |= height.simd_lt(-wrong).to_bitmask() as u16;
            }
        }
        let ball = BallSeen::of(&seen);
        let are_bounded = self.triangles.iter().any(SeenTriangle::is_bounded);
        // Blocks with samples that are not hidden yet, sixteen at a time
        let mut next = if self.triangles.is_empty() { target.blocks.len() } else { 0 };
        while next < target.blocks.len() {
            let (mut places, mut count) = ([0u32; LANES], 0);
            while count < LANES && next < target.blocks.len() {
                places[count] = next as u32;
                count += usize::from(self.in_space[next] != u16::MAX);
                next += 1;
            }
            if count == 0 {
                break;
            }
            let is_run = count == LANES
                && places[0].is_multiple_of(LANES as u32)
                && places[LANES - 1] == places[0] + LANES as u32 - 1;
            let gathered;
            let cells = if is_run {
                &target.cells[places[0] as usize / LANES]
            } else {
                gathered = target.bounds_of(&places);
                &gathered
            };
            let parts = match &ball {
                _ if !are_bounded => SeenParts::NONE,
                Some(ball) => ball.parts(simd, places[..count].iter().map(|place| &target.blocks[*place as usize])),
                None => SeenParts::flat(simd, &cells.middle, &cells.half, count),
            };
            // A bit for each block that is not all hidden yet
            let mut open = ((1u32 << count) - 1) as u16;
            for triangle in &self.triangles {
                if open == 0 {
                    break;
                }
                let verdict = triangle.cells(simd, &cells.middle, &cells.half, &parts);
                for i in bits(u64::from((verdict.hidden | verdict.unsure) & open)) {
                    let (block, hidden) = (&target.blocks[places[i] as usize], &mut self.in_space[places[i] as usize]);
                    if verdict.hidden >> i & 1 == 1 {
                        *hidden = u16::MAX;
                    } else {
                        let told = triangle.samples(simd, &block.at);
                        let unsure = told.unsure & !*hidden & !told.hidden;
                        *hidden |= told.hidden;
                        if unsure != 0 {
                            *hidden |= by_kernel(simd, scene, target, triangle, block, point, unsure);
                        }
                    }
                    open &= !(u16::from(*hidden == u16::MAX) << i);
                }
            }
        }
    }

    /// Traces rays through the trees, or only to solids and point sets.
    fn trace(&mut self, level: Level, scene: &Scene, target: &Target, point: &Viewpoint) -> u64 {
        let mut traced = 0;
        let from = [point.ray(target.end(), Vec3::ZERO, true)];
        for (block, hidden) in target.blocks.iter().zip(&mut self.in_space) {
            let asking = !*hidden;
            if asking == 0 {
                continue;
            }
            traced += u64::from(asking.count_ones());
            let shadows = dispatch_all!(level, simd => shadow_rays(simd, &from, point, block));
            *hidden |= if self.trees {
                scene.geometry.are_blocked(level, &shadows, asking)
            } else {
                scene.geometry.are_blocked_by(level, &self.others, &shadows, asking)
            };
        }
        traced
    }
}

/// The rays from a point to a block of samples.
#[inline(always)]
fn shadow_rays<'a, S: Simd>(
    simd: S,
    from: &'a [ShadowRay; 1],
    point: &Viewpoint,
    block: &SampleBlock,
) -> ShadowRays<'a> {
    let mut shadows = ShadowRays { from, rays: RayPacket16::ZERO, t_end: [0.0; LANES] };
    let l = [
        f32x16::load_array_ref(simd, &block.point[0]) - point.p.x,
        f32x16::load_array_ref(simd, &block.point[1]) - point.p.y,
        f32x16::load_array_ref(simd, &block.point[2]) - point.p.z,
    ];
    for (axis, l) in l.iter().enumerate() {
        shadows.rays.o[axis] = [point.start[axis]; LANES];
        l.store_slice(&mut shadows.rays.d[axis]);
    }
    // `ShadowRay::end`, operation by operation
    let o = point.start.abs().element_sum();
    let length = l[0].abs() + l[1].abs() + l[2].abs();
    let plane = from[0].to.plane;
    let approach = if plane == Vec3::ZERO { length } else { (l[0] * plane.x + l[1] * plane.y + l[2] * plane.z).abs() };
    let end = -((length + o) / approach * (32.0 * UNIT_ROUNDOFF)) + 1.0;
    end.store_slice(&mut shadows.t_end);
    shadows
}

/// Tests the samples in `unsure` by the kernel that traces rays. Returns a mask of the hidden ones.
#[inline(never)]
fn by_kernel<S: Simd>(
    simd: S,
    scene: &Scene,
    target: &Target,
    triangle: &SeenTriangle,
    block: &SampleBlock,
    point: &Viewpoint,
    unsure: u16,
) -> u16 {
    simd.vectorize(
        #[inline(always)]
        || {
            let Some(mesh) = ShadowMesh::of(&scene.geometry, triangle.source, target.light) else { return 0 };
            let from = [point.ray(target.end(), Vec3::ZERO, true)];
            let shadows = shadow_rays(simd, &from, point, block);
            let own = mesh.own_rays(&shadows.rays, unsure);
            mesh.mesh.tree.meets(simd, own.as_ref().unwrap_or(&shadows.rays), &shadows.t_end, triangle, unsure)
        },
    )
}

/// The projection of a spherical light from the point to the plane through the center that faces the point.
struct BallSeen {
    /// From coordinates along the light's axes to those along its frame.
    turn: [[f32; 3]; 3],
    radii: f32,
    /// Error bound of projected coordinates.
    room: f32,
}

impl BallSeen {
    fn of(light: &LightSeen) -> Option<BallSeen> {
        let radii = light.radii?;
        let turn = light.frame.map(|to| light.axes.map(|axis| axis.dot(to) / to.length_squared()));
        // Rounding of directions; the projection magnifies it most for the nearest points
        let nearest = radii / (radii - 1.0).max(UNIT_ROUNDOFF);
        Some(BallSeen { turn, radii, room: 64.0 * UNIT_ROUNDOFF * (radii + 2.0) * nearest * nearest })
    }

    /// Bounds of the projections of at most sixteen blocks.
    #[inline(always)]
    fn parts<'a, S: Simd>(&self, simd: S, blocks: impl Iterator<Item = &'a SampleBlock>) -> SeenParts {
        let mut parts = SeenParts::NONE;
        for (lane, block) in blocks.enumerate() {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| f32x16::load_array_ref(simd, &block.at[axis]));
            let along = |[a, b, c]: [f32; 3]| z * c + (y * b + x * a);
            let longer = simd.splat_f32x16(self.radii) / (along(self.turn[2]) + self.radii);
            for axis in 0..2 {
                let [low, high] = least_and_most(along(self.turn[axis]) * longer);
                (parts.low[axis][lane], parts.high[axis][lane]) = (low - self.room, high + self.room);
            }
        }
        parts
    }
}

//! What lies inside of some planes.

use fearless_simd::{f32x8, prelude::*};

use super::Aabb;
use super::node::BoxNode;
use crate::math::{DAffine3, DVec3, Vec3};

/// A part of space that planes bound: a pyramid and the plane it begins at.
pub(crate) struct Planes(pub [HalfSpace; 5]);

/// A plane, by its unit normal, which points outward, and a point on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfSpace {
    pub n: DVec3,
    pub p: DVec3,
}

/// Planes as one tree sees them: outside is n.x > c.
pub(crate) struct TreePlanes([(Vec3, f32); 5]);

/// How far beyond a plane a box has to lie, as a part of how far off it is.
const SLACK: f64 = 1e-5;

impl Planes {
    /// Around neighbouring rays, of which these are the corners, one after the other: origins and directions.
    pub fn around(corners: [[DVec3; 2]; 4]) -> Planes {
        let sum = |of: usize| corners.iter().map(|ray| ray[of]).sum::<DVec3>();
        let (o, d) = (sum(0) * 0.25, sum(1));
        let side = |k: usize| {
            let [[o0, d0], [o1, d1]] = [corners[k], corners[(k + 1) % 4]];
            // Along both rays and from one to the other, whether they begin at one place or go one way
            let n = (d0 + d1).cross(o1 + d1 - o0 - d0).normalize_or_zero();
            HalfSpace { n: if n.dot(o + d - o0) > 0.0 { -n } else { n }, p: o0 }
        };
        let behind = HalfSpace { n: -d.normalize_or_zero(), p: o };
        Planes([side(0), side(1), side(2), side(3), behind])
    }

    /// The same in the space of something placed.
    pub fn placed(&self, world_from_object: &DAffine3, object_from_world: &DAffine3) -> Planes {
        Planes(self.0.map(|HalfSpace { n, p }| HalfSpace {
            n: (world_from_object.matrix3.transpose() * n).normalize_or_zero(),
            p: object_from_world.transform_point3(p),
        }))
    }

    /// In a tree around `center` that reaches `half` from it.
    pub fn within(&self, center: Vec3, half: f32) -> TreePlanes {
        TreePlanes(self.0.map(|HalfSpace { n, p }| {
            let way = p - center.as_dvec3();
            let slack = (way.abs().max_element() + f64::from(half) + p.abs().max_element()) * SLACK;
            (n.as_vec3(), (n.dot(way) + slack) as f32)
        }))
    }

    /// Whether all of a triangle is outside of one of them.
    pub fn misses(&self, corners: &[Vec3; 3]) -> bool {
        self.0.iter().any(|HalfSpace { n, p }| {
            corners.iter().all(|q| {
                let way = q.as_dvec3() - p;
                n.dot(way) > (way.abs().max_element() + p.abs().max_element()) * SLACK
            })
        })
    }

    /// Whether a box may reach inside.
    pub fn may_meet(&self, Aabb { min, max }: Aabb) -> bool {
        let (min, max) = (min.as_dvec3(), max.as_dvec3());
        self.0.iter().all(|HalfSpace { n, p }| {
            let least = n.max(DVec3::ZERO).dot(min - p) + n.min(DVec3::ZERO).dot(max - p);
            let size = (min - p).abs().max((max - p).abs()).max_element() + p.abs().max_element();
            least <= size * SLACK
        })
    }
}

impl TreePlanes {
    /// [`meet`](Self::meet) for who visits a tree.
    #[inline(always)]
    pub fn test<S: Simd>(self) -> impl Fn(S, &BoxNode) -> (u32, f32x8<S>) {
        #[inline(always)]
        move |simd, node| self.meet(simd, node)
    }

    /// The children of a node that may reach inside: a bit for each, and no order.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, simd: S, node: &BoxNode) -> (u32, f32x8<S>) {
        let mut met = 0xff;
        for (n, c) in &self.0 {
            // The corner that is farthest inside
            let side =
                |axis: usize| f32x8::load_array_ref(simd, &node.planes[axis][usize::from(n[axis] < 0.0)]) * n[axis];
            // Of what does not exist this is infinite, or no number
            met &= (side(0) + side(1) + side(2)).simd_le(*c).to_bitmask() as u32;
        }
        (met, simd.splat_f32x8(0.0))
    }
}

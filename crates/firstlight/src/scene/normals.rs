//! Shading normals that maps bend, and what is made of those that face away from the viewer.

use super::Scene;
use super::geometry::Hit;
use crate::material::NormalFix;
use crate::math::{Ray, Vec3};
use crate::shape::SurfaceInteraction;

/// The least cosine between a bent normal and the direction to the viewer, and of the mirrored direction above the
/// surface: below it a highlight at grazing angles is brighter than what is around it.
const LEAST_COS: f32 = 0.01;

impl Scene {
    /// Bends the shading normal of a surface, seen from one side, by the maps of its material. `front` is the shading
    /// normal of the front.
    #[inline(never)]
    pub(super) fn bend_normal(&self, si: &mut SurfaceInteraction, ray: &Ray, hit: &Hit, front: Vec3) {
        let material = &self.materials[si.material.index()];
        let Some(maps) = &material.common.normals else { return };
        let Some(frame) = self.geometry.normal_frame(ray, hit, front) else { return };
        let Some((bent, slope_variance)) = maps.bent(si, &frame, &self.textures) else { return };
        // Turned together with the shading normal
        let is_back = si.ns.dot(front) < 0.0;
        si.ns = if is_back { -bent } else { bent };
        si.slope_variance = slope_variance;
        if material.common.normal_fix == NormalFix::Raise {
            si.ns = raised(si.ng, si.wo, si.ns, material.has_lobe());
        }
    }
}

/// A shading normal on the side of the geometric normal `ng`, that faces the viewer, and that mirrors the viewer above
/// the surface where there is a highlight. `ng` faces the viewer. All are unit.
///
/// The mirrored direction r is where r.ng is the smaller of 0.01 and 0.9 (ng.wo) at least: the normal is turned towards
/// ng in the plane of both, as little as that takes. Source: the rule that Cycles has, "Fix for black areas with
/// specular bump maps", `ensure_valid_specular_reflection`, Blender 2.80.
fn raised(ng: Vec3, wo: Vec3, ns: Vec3, has_lobe: bool) -> Vec3 {
    let mut ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
    // The smallest turn after which the viewer sees its front
    let cos_o = ns.dot(wo);
    if cos_o < LEAST_COS {
        let across = (ns - wo * cos_o).normalize_or_zero();
        if across == Vec3::ZERO {
            return ng;
        }
        ns = across * (1.0 - LEAST_COS * LEAST_COS).sqrt() + wo * LEAST_COS;
    }
    if !has_lobe {
        return ns;
    }
    let height = ng.dot(wo);
    let least = LEAST_COS.min(0.9 * height);
    let mirrored = ns * (2.0 * ns.dot(wo)) - wo;
    if mirrored.dot(ng) >= least {
        return ns;
    }
    // In the plane of ng (z) and ns (x): wo has the parts x and z there. With n = (sin a, cos a), the height of the
    // mirrored direction is 2 (n.wo) n.z - z = least, a quadratic in n.z^2
    let along = (ns - ng * ns.dot(ng)).normalize_or_zero();
    let (x, z) = (wo.dot(along), height);
    let a = x * x + z * z;
    let b = 2.0 * (a + z * least);
    let c = (least + z) * (least + z);
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    let squared = 0.25 * (if x < 0.0 { b + root } else { b - root }) / a;
    let squared = if squared > 0.0 { squared.min(1.0) } else { return ng };
    along * (1.0 - squared).sqrt() + ng * squared.sqrt()
}

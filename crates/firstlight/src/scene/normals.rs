//! Shading normals that maps bend, and what is made of those that face away from the viewer.

use super::Scene;
use super::geometry::{At, Geometry, Hit, Placed, PlacedSpot, PlacedTarget, Surface};
use crate::ids::SurfaceId;
use crate::material::{NormalFix, NormalMapping};
use crate::math::{Ray, Vec3};
use crate::shape::{BumpShadowing, NormalFrame, RayDifferential, SolidHit, SurfaceInteraction};

/// The least cosine between a bent normal and the direction to the viewer, and of the mirrored direction above the
/// surface: below it a highlight at grazing angles is brighter than what is around it.
const LEAST_COS: f32 = 0.01;

/// The variance of a pixel's filter, in pixels^2: a Gaussian of standard deviation 1 / sqrt(2 pi).
const PIXEL_VARIANCE: f32 = 0.159_154_94;
/// The largest variance of slopes that curvature adds.
const MOST_CURVED: f32 = 0.09;

impl Scene {
    /// Whether anything of a surface depends on the footprints of rays: textures, and filtered normals.
    pub(crate) fn needs_differentials(&self) -> bool {
        !self.textures.is_empty() || self.geometry.rules.refines_any()
    }

    /// Bends the shading normal of a surface, seen from one side, by the maps of its material, and finds how much the
    /// normals vary within the pixel. `front` is the shading normal of the front.
    #[inline(never)]
    pub(super) fn refine_normal(
        &self,
        si: &mut SurfaceInteraction,
        ray: &Ray,
        hit: &Hit,
        front: Vec3,
        differential: &RayDifferential,
    ) {
        let material = &self.materials[si.material.index()];
        let filters = material.common.specular_antialiasing;
        if filters {
            si.slope_variance = self.curved(ray, hit, differential);
        }
        let smooth = (si.ns, si.slope_variance);
        // Turned together with the shading normal
        let is_back = si.ns.dot(front) < 0.0;
        let bent = |si: &SurfaceInteraction, maps: &NormalMapping| {
            let frame = |set| self.geometry.normal_frame(ray, hit, front, set);
            let (bent, slope_variance) = maps.bent(si, frame, &self.textures)?;
            let added = if filters { slope_variance } else { 0.0 };
            Some((if is_back { -bent } else { bent }, smooth.1 + added))
        };
        let raises = material.common.normal_fix == NormalFix::Raise;
        let (maps, coat) = (material.common.normals.as_ref(), material.coat_normals());
        (si.ns, si.slope_variance) = maps.and_then(|maps| bent(si, maps)).unwrap_or(smooth);
        (si.coat_ns, si.coat_slope_variance) = coat.and_then(|maps| bent(si, maps)).unwrap_or(smooth);
        si.lobe_ns = si.ns;
        if raises && si.ns != si.ng {
            si.ns = facing(si.ng, si.wo, si.ns);
            si.lobe_ns = si.ns;
            if maps.is_some() {
                si.bump_shadowing = BumpShadowing::new(smooth.0, si.ns);
                if material.has_lobe() {
                    si.lobe_ns = mirroring(si.ng, si.wo, si.ns);
                }
            }
        }
        if raises && si.coat_ns != si.ng {
            si.coat_ns = facing(si.ng, si.wo, si.coat_ns);
            if coat.is_some() {
                si.coat_bump_shadowing = BumpShadowing::new(smooth.0, si.coat_ns);
                si.coat_ns = mirroring(si.ng, si.wo, si.coat_ns);
            }
        }
    }

    /// The variance of slopes within a pixel that the curvature of a shape makes.
    ///
    /// Half of min(2 sigma^2 (|dn/dx|^2 + |dn/dy|^2), 0.18), sigma^2 = 1 / (2 pi): Tokuyoshi, Kaplanyan, "Improved
    /// geometric specular antialiasing", I3D 2019. alpha^2 is twice the variance of slopes.
    fn curved(&self, ray: &Ray, hit: &Hit, differential: &RayDifferential) -> f32 {
        let Some(pixel) = differential.of_pixel() else { return 0.0 };
        let [dx, dy] = self.geometry.normal_steps(ray, hit, &pixel);
        let squared = dx.length_squared() + dy.length_squared();
        if squared.is_finite() { (PIXEL_VARIANCE * squared).min(MOST_CURVED) } else { MOST_CURVED }
    }
}

/// The shading normal `ns` on the side of the geometric normal `ng`, turned as little as lets it face the viewer. `ng`
/// faces the viewer. All are unit.
fn facing(ng: Vec3, wo: Vec3, ns: Vec3) -> Vec3 {
    let ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
    let cos_o = ns.dot(wo);
    if cos_o >= LEAST_COS {
        return ns;
    }
    let across = (ns - wo * cos_o).normalize_or_zero();
    if across == Vec3::ZERO {
        return ng;
    }
    across * (1.0 - LEAST_COS * LEAST_COS).sqrt() + wo * LEAST_COS
}

/// The normal of a highlight that mirrors the viewer above the surface, from a shading normal that faces the viewer.
///
/// The mirrored direction r has r.ng >= min(0.01, 0.9 ng.wo): the normal is turned towards ng in the plane of both, as
/// little as that takes. Source: the rule that Cycles has, "Fix for black areas with
/// specular bump maps", `ensure_valid_specular_reflection`, Blender 2.80.
fn mirroring(ng: Vec3, wo: Vec3, ns: Vec3) -> Vec3 {
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

impl Geometry {
    /// The tangent frame of a set of texture coordinates at a hit of a shape whose front normal there is `n`. `None`
    /// where neither u nor v has a direction.
    pub fn normal_frame(&self, ray: &Ray, hit: &Hit, n: Vec3, set: Option<u8>) -> Option<NormalFrame> {
        match hit.at {
            At::World(point) => self.world.as_ref()?.mesh.normal_frame(None, point, set),
            At::Placed(index, PlacedSpot::Triangle(point)) => {
                let Placed { placement, target, .. } = &self.placed[index as usize];
                let PlacedTarget::Mesh(mesh) = *target else { unreachable!("only meshes have triangles") };
                self.meshes[mesh as usize].normal_frame(Some(placement), point, set)
            }
            _ => NormalFrame::new(n.as_dvec3(), self.tangents(ray, hit)),
        }
    }

    /// Whether the material at a hit bends the shading normal.
    #[inline(always)]
    pub fn is_mapped(&self, hit: &Hit) -> bool {
        self.rules.has_maps() && {
            let surface = self.surfaces.get(hit.surface.index());
            surface.is_some_and(|surface| {
                self.rules.is_mapped(surface.material.unwrap_or_else(|| self.face_material(hit)))
            })
        }
    }

    /// Whether a material of a surface may bend the shading normal.
    pub fn may_be_mapped(&self, surface: SurfaceId) -> bool {
        let may = |surface: &Surface| surface.material.is_none_or(|material| self.rules.is_mapped(material));
        self.rules.has_maps() && self.surfaces.get(surface.index()).is_some_and(may)
    }

    /// How the unit shading normal of the front changes from a hit of a shape with each step.
    fn normal_steps(&self, ray: &Ray, hit: &Hit, differential: &RayDifferential) -> [Vec3; 2] {
        match hit.at {
            At::Sphere(i) => self.spheres[i as usize].shape.normal_steps(ray, hit.t, differential),
            At::Parallelogram(_) | At::Light => [Vec3::ZERO; 2],
            At::World(point) => {
                let world = self.world.as_ref().expect("the hit is on it");
                world.mesh.normal_steps(None, point, ray, hit.t, differential)
            }
            At::Placed(index, spot) => {
                let Placed { placement, target, .. } = &self.placed[index as usize];
                match (*target, spot) {
                    (PlacedTarget::Mesh(mesh), PlacedSpot::Triangle(point)) => {
                        self.meshes[mesh as usize].normal_steps(Some(placement), point, ray, hit.t, differential)
                    }
                    (PlacedTarget::Points(points), PlacedSpot::Point(point)) => {
                        self.point_sets[points as usize].normal_steps(placement, point, ray, hit.t, differential)
                    }
                    (PlacedTarget::Solid(solid), PlacedSpot::Part(part)) => {
                        let hit = SolidHit { t: hit.t, part };
                        placement.solid_normal_steps(&self.solids[solid as usize], &hit, ray, differential)
                    }
                    _ => unreachable!("a spot is on the kind of thing that was hit"),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raised_normals_face_the_viewer_and_mirror_above_the_surface() {
        let ng = Vec3::Z;
        let mut changed = [0; 2];
        for k in 0..20_000u32 {
            // Viewers and normals all around, from grazing to straight on
            let at = |step: u32, of: u32| (k / step % of) as f32 / of as f32;
            let (z, turn, lean) = (0.0005 + 0.999 * at(1, 25) * at(1, 25), at(25, 20), at(500, 40));
            let ring = (1.0 - z * z).sqrt();
            let wo = Vec3::new(ring, 0.0, z);
            let (sin, cos) = crate::math::sin_cos_of_turns(f64::from(turn));
            let (tip, up) = crate::math::sin_cos_of_turns(f64::from(0.5 * lean));
            let ns = Vec3::new((tip * cos) as f32, (tip * sin) as f32, up as f32).normalize();
            for has_lobe in [false, true] {
                let mut raised = facing(ng, wo, ns);
                if has_lobe {
                    raised = mirroring(ng, wo, raised);
                }
                assert!((raised.length() - 1.0).abs() < 1e-4, "{wo} {ns} {raised}");
                assert!(raised.dot(wo) > 0.0, "{wo} {ns} {raised}");
                if !has_lobe {
                    assert!(raised.dot(wo) > 0.0099, "{wo} {ns} {raised}");
                    let front = if ns.z < 0.0 { -ns } else { ns };
                    assert!(front.dot(wo) < 0.01 || raised == front, "{wo} {ns} {raised}");
                    changed[0] += u32::from(raised != ns);
                } else {
                    let mirrored = raised * (2.0 * raised.dot(wo)) - wo;
                    assert!(mirrored.z >= 0.01f32.min(0.9 * z) - 2e-3, "{wo} {ns} {raised} {mirrored}");
                    changed[1] += u32::from(raised != ns);
                }
            }
        }
        assert!(changed[0] > 1000 && changed[1] > changed[0], "{changed:?}");
        assert_eq!(mirroring(ng, Vec3::new(0.6, 0.0, 0.8), facing(ng, Vec3::new(0.6, 0.0, 0.8), Vec3::Z)), Vec3::Z);
    }
}

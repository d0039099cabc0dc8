//! Planes from the centre rays of pixels: depth, normals, ids and others that are never averaged.
//!
//! One ray through the middle of each pixel, independent of antialiasing and of all lighting.

use std::cell::OnceCell;

use fearless_simd::Level;

use super::hits::{PixelHits, grid_ray};
use super::motion;
use super::{CenterValue, FilmTile};
use crate::camera::Frame;
use crate::color::Rgb;
use crate::image::{Buffer, Plane};
use crate::light::Light;
use crate::math::{DVec3, Ray, Vec3};
use crate::scene::{Hit, ObjectSpace, Scene};
use crate::shape::{RayDifferential, ShadowTerminator, SurfaceInteraction};

/// The hit of a centre ray, or of another camera ray.
pub(super) struct Center<'a> {
    pub scene: &'a Scene,
    ray: Ray,
    differential: RayDifferential,
    pub hit: Hit,
    /// The light that it is on, if any.
    light: Option<&'a Light>,
    /// The surface, computed at its first use; `None` on a light.
    surface: OnceCell<Option<SurfaceInteraction>>,
}

/// Fills the planes of a tile that come from centre rays. Returns the number of rays that were traced.
pub(crate) fn fill(scene: &Scene, level: Level, film: &mut FilmTile) -> u64 {
    let there = scene.motion.as_deref().map(|motion| &motion.there);
    // The motion back is that of the scene at its end, to this one
    let (backward, forward): (Vec<_>, Vec<_>) = (0..)
        .zip(film.planes().into_iter().map(Buffer::plane))
        .filter(|(_, plane)| plane.is_of_center())
        .partition(|(_, plane)| *plane == Plane::MotionBackward);
    let back: Vec<_> = backward.into_iter().map(|(number, _)| (number, Plane::Motion)).collect();
    let to_here = there.map_or(0, |there| fill_some(there, Some(scene), level, film, &back));
    fill_some(scene, there, level, film, &forward) + to_here
}

/// Fills the planes of a tile with these numbers as those of centre rays. `there` is the scene that motion leads to.
fn fill_some(
    scene: &Scene,
    there: Option<&Scene>,
    level: Level,
    film: &mut FilmTile,
    planes: &[(usize, Plane)],
) -> u64 {
    if planes.is_empty() {
        return 0;
    }
    let tile = film.tile;
    let has = |of: Plane| planes.iter().any(|(_, plane)| *plane == of);
    let has_motion = has(Plane::Motion);
    let has_texture = [Plane::Albedo, Plane::Roughness, Plane::Metallic].into_iter().any(has);
    let mut hits = PixelHits::new(level, 1);
    for block in tile.parts(hits.side(), 1) {
        hits.trace(scene, block);
        for [i, j] in block.pixels() {
            let ray = hits.ray([i, j]);
            let needs_differential = has_texture || scene.has_layers();
            let differential = if needs_differential { grid_ray(scene, 1, i, j).1 } else { RayDifferential::default() };
            let end = hits.get([i, j], 0, 0);
            let center = scene.shown(&ray, &differential, end).map(|hit| Center::new(scene, ray, differential, hit));
            for (number, plane) in planes {
                let value = match (&center, there) {
                    (Some(center), Some(there)) if *plane == Plane::Motion => {
                        CenterValue::Floats(motion::of_thing(center, there, level))
                    }
                    (None, Some(there)) if *plane == Plane::Motion => {
                        CenterValue::Floats(motion::of_nothing(scene, there, &ray, level))
                    }
                    _ if *plane == Plane::Opacity => {
                        CenterValue::Floats([scene.first_opacity(&ray, &differential, end), 0.0, 0.0])
                    }
                    (Some(center), _) => center.says(*plane),
                    (None, _) => nothing(*plane),
                };
                film.set_center(*number, [i, j], value);
            }
        }
    }
    u64::from(tile.width) * u64::from(tile.height) * if has_motion { 2 } else { 1 }
}

/// The value of a plane at a ray without a hit.
pub(super) fn nothing(plane: Plane) -> CenterValue {
    match plane {
        Plane::Depth | Plane::Distance => CenterValue::Floats([f32::INFINITY; 3]),
        plane if plane.is_whole() => CenterValue::Whole(0),
        _ => CenterValue::Floats([0.0; 3]),
    }
}

impl<'a> Center<'a> {
    pub fn new(scene: &'a Scene, ray: Ray, differential: RayDifferential, hit: Hit) -> Self {
        let light = hit.surface.index().checked_sub(scene.geometry.surfaces.len()).map(|light| &scene.lights[light]);
        Center { scene, ray, differential, hit, light, surface: OnceCell::new() }
    }

    /// The surface; `None` on a light. It is not lit, so it is not lifted off its facet.
    fn surface(&self) -> Option<&SurfaceInteraction> {
        let Center { scene, ray, differential, hit, light, .. } = self;
        let find = || light.is_none().then(|| scene.surface_with(ray, hit, differential, ShadowTerminator::Hard));
        self.surface.get_or_init(find).as_ref()
    }

    /// Its position, in the scene's own coordinates.
    pub fn p(&self) -> DVec3 {
        match self.surface() {
            Some(surface) => surface.p.as_dvec3(),
            None => self.ray.o.as_dvec3() + self.ray.d.as_dvec3() * self.hit.t,
        }
    }

    /// The error bound of that position, in metres.
    pub fn error(&self) -> f64 {
        self.surface().map_or(0.0, |surface| f64::from(surface.error.0.max_element()))
    }

    /// The object space of its shape; `None` on a light.
    fn space(&self) -> Option<&ObjectSpace> {
        let geometry = &self.scene.geometry;
        geometry.surfaces.get(self.hit.surface.index()).map(|surface| &geometry.spaces[surface.space as usize])
    }

    /// The unit normal of the front: of a shape, or of a light.
    pub fn front(&self) -> Vec3 {
        match self.light {
            None => self.scene.geometry.normals(&self.ray, &self.hit)[0],
            Some(light) => light.area().map_or(Vec3::ZERO, |area| area.shape.normal_at(self.p())),
        }
    }

    /// Whether the ray meets the front.
    pub fn is_front(&self) -> bool {
        self.front().dot(self.ray.d) < 0.0
    }

    /// The geometric and the shading normal, towards the viewer.
    pub fn normals(&self) -> [Vec3; 2] {
        // Without what else there is to know of the surface
        let [normal, shading] = match self.light {
            None => self.scene.geometry.normals(&self.ray, &self.hit),
            Some(_) => [self.front(); 2],
        };
        if normal.dot(-self.ray.d) < 0.0 { [-normal, -shading] } else { [normal, shading] }
    }

    pub fn says(&self, plane: Plane) -> CenterValue {
        let Scene { camera, geometry, .. } = self.scene;
        let (d, t) = (self.ray.d.as_dvec3(), self.hit.t);
        let float = |number: f64| CenterValue::Floats([number as f32, 0.0, 0.0]);
        let vector = |v: Vec3| CenterValue::Floats(v.to_array());
        let Frame { right, up, forward, origin, position, near, .. } = camera.frame();
        let from_camera =
            |v: DVec3| CenterValue::Floats([*right, *up, -*forward].map(|axis| axis.as_dvec3().dot(v) as f32));
        let (ng, ns) = (|| self.normals()[0], || self.normals()[1]);
        match plane {
            Plane::Depth => float(near + forward.as_dvec3().dot(d) * t),
            Plane::Distance => float(near / forward.as_dvec3().dot(d) + d.length() * t),
            Plane::Position => vector((self.p() + *origin).as_vec3()),
            Plane::PositionCamera => from_camera(self.p() + *origin - *position),
            Plane::Normal => vector(ns()),
            Plane::NormalCamera => from_camera(ns().as_dvec3()),
            Plane::NormalGeometric => vector(ng()),
            Plane::NormalGeometricCamera => from_camera(ng().as_dvec3()),
            Plane::Tangent => {
                let along_u = self.surface().map(|_| geometry.tangents(&self.ray, &self.hit)[0]);
                vector(along_u.map_or(Vec3::ZERO, |along| along.normalize_or_zero().as_vec3()))
            }
            Plane::PositionObject => {
                let object = self.space().map(|space| space.scene_from_object.inverse().transform_point3(self.p()));
                vector(object.map_or(Vec3::ZERO, DVec3::as_vec3))
            }
            Plane::NormalObject => {
                // Normals go back by the transpose
                let object = self.space().map(|space| space.scene_from_object.matrix3.transpose() * ns().as_dvec3());
                vector(object.map_or(Vec3::ZERO, |n| n.normalize_or_zero().as_vec3()))
            }
            Plane::Albedo => {
                let Scene { materials, textures, .. } = self.scene;
                let color = self.surface().map(|si| materials[si.material.index()].albedo(si, textures));
                vector(color.map_or(Vec3::ZERO, |Rgb { r, g, b }| Vec3::new(r, g, b)))
            }
            Plane::Roughness | Plane::Metallic => {
                let Scene { materials, textures, .. } = self.scene;
                let of_metal = plane == Plane::Metallic;
                let of = |si: &SurfaceInteraction| {
                    let material = &materials[si.material.index()];
                    if of_metal { material.metallic(si, textures) } else { material.roughness(si, textures) }
                };
                CenterValue::Floats([self.surface().map_or(0.0, of), 0.0, 0.0])
            }
            Plane::InstanceId => CenterValue::Whole(self.space().map_or(0, |space| space.instance)),
            Plane::Uv => vector(self.surface().map_or(Vec3::ZERO, |surface| surface.uv.extend(0.0))),
            Plane::Barycentric => vector(self.hit.barycentric().extend(0.0)),
            Plane::ObjectId => CenterValue::Whole(self.hit.surface.0 + 1),
            Plane::MaterialId => CenterValue::Whole(self.surface().map_or(0, |surface| surface.material.0 + 1)),
            Plane::PrimitiveId => CenterValue::Whole(geometry.primitive(&self.hit).map_or(0, |number| number + 1)),
            Plane::FaceOrientation => CenterValue::Whole(if self.is_front() { 1 } else { 2 }),
            _ => unreachable!("{} is not of the centre", plane.name()),
        }
    }
}

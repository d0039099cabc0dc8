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
use crate::image::Plane;
use crate::math::{DVec3, Ray, Vec3};
use crate::scene::{Hit, ObjectSpace, Scene};
use crate::shape::{RayDifferential, ShadowTerminator, SurfaceInteraction};

/// Fills the planes of tiles from centre rays, for one thread.
struct Centers<'a> {
    scene: &'a Scene,
    /// The scene that motion leads to.
    there: Option<&'a Scene>,
    level: Level,
    hits: PixelHits,
}

/// The hit of a centre ray, or of another camera ray.
pub(super) struct Center<'a> {
    pub scene: &'a Scene,
    ray: Ray,
    differential: RayDifferential,
    pub hit: Hit,
    /// The surface, computed at its first use; `None` on a light.
    surface: OnceCell<Option<SurfaceInteraction>>,
}

/// Fills the planes of a tile that come from centre rays. Returns the number of rays that were traced.
pub(crate) fn fill(scene: &Scene, level: Level, film: &mut FilmTile) -> u64 {
    let there = scene.motion.as_deref().map(|motion| &motion.there);
    let has = |film: &FilmTile, backward: bool| {
        let of_center = |plane: Plane| plane.is_of_center() && (plane == Plane::MotionBackward) == backward;
        film.planes().iter().any(|buffer| of_center(buffer.plane()))
    };
    let mut rays = 0;
    if has(film, false) {
        let says = |plane: Plane| (plane != Plane::MotionBackward).then_some(plane);
        rays += Centers::new(scene, there, level).fill(film, says);
    }
    if let (true, Some(there)) = (has(film, true), there) {
        // Of the other picture, the way to this one
        let says = |plane: Plane| (plane == Plane::MotionBackward).then_some(Plane::Motion);
        rays += Centers::new(there, Some(scene), level).fill(film, says);
    }
    rays
}

impl<'a> Centers<'a> {
    fn new(scene: &'a Scene, there: Option<&'a Scene>, level: Level) -> Self {
        Centers { scene, there, level, hits: PixelHits::new(level, 1) }
    }

    /// Fills planes of a tile; `asks` maps a buffer to the plane of centre rays that it is, if it is one.
    fn fill(&mut self, film: &mut FilmTile, asks: impl Fn(Plane) -> Option<Plane>) -> u64 {
        let (scene, there, level) = (self.scene, self.there, self.level);
        let (tile, side) = (film.tile, self.hits.side());
        // The planes of the film that come from centre rays
        let planes: Vec<(usize, Plane)> = (0..)
            .zip(film.planes())
            .filter(|(_, buffer)| buffer.plane().is_of_center())
            .filter_map(|(number, buffer)| Some((number, asks(buffer.plane())?)))
            .collect();
        let asked = |of: Plane| planes.iter().any(|(_, plane)| *plane == of);
        let (asks_motion, asks_texture) = (asked(Plane::Motion), asked(Plane::Albedo));
        for top in (0..tile.height).step_by(side as usize) {
            for left in (0..tile.width).step_by(side as usize) {
                let (w, h) = ((tile.width - left).min(side), (tile.height - top).min(side));
                let [x, y] = [tile.x + left, tile.y + top];
                self.hits.trace(scene, x, y, w, h);
                for (j, i) in (0..h).flat_map(|j| (0..w).map(move |i| (j, i))) {
                    let ray = self.hits.ray(i, j);
                    let center = self.hits.get(i, j, 0, 0).map(|hit| {
                        let differential =
                            if asks_texture { grid_ray(scene, 1, x + i, y + j).1 } else { RayDifferential::default() };
                        Center::new(scene, ray, differential, hit)
                    });
                    for (number, plane) in &planes {
                        let said = match (&center, there) {
                            (Some(center), Some(there)) if *plane == Plane::Motion => {
                                CenterValue::Floats(motion::of_thing(center, there, level))
                            }
                            (None, Some(there)) if *plane == Plane::Motion => {
                                CenterValue::Floats(motion::of_nothing(scene, there, &ray, level))
                            }
                            (Some(center), _) => center.says(*plane),
                            (None, _) => nothing(*plane),
                        };
                        film.set_center(*number, [left + i, top + j], said);
                    }
                }
            }
        }
        u64::from(tile.width) * u64::from(tile.height) * if asks_motion { 2 } else { 1 }
    }
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
        Center { scene, ray, differential, hit, surface: OnceCell::new() }
    }

    /// The surface; `None` on a light. It is not lit, so it is not lifted off its facet.
    fn surface(&self) -> Option<&SurfaceInteraction> {
        let Center { scene, ray, differential, hit, .. } = self;
        let is_light = hit.surface.index() >= scene.geometry.surfaces.len();
        let find = || (!is_light).then(|| scene.surface_with(ray, hit, differential, ShadowTerminator::Hard));
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
        let Scene { geometry, lights, .. } = self.scene;
        match self.hit.surface.index().checked_sub(geometry.surfaces.len()) {
            None => geometry.normals(&self.ray, &self.hit)[0],
            Some(light) => lights[light].area().map_or(Vec3::ZERO, |area| area.shape.normal_at(self.p())),
        }
    }

    /// Whether the ray meets the front.
    pub fn is_front(&self) -> bool {
        self.front().dot(self.ray.d) < 0.0
    }

    /// The geometric and the shading normal, towards the viewer.
    pub fn normals(&self) -> [Vec3; 2] {
        let Scene { geometry, .. } = self.scene;
        let is_light = self.hit.surface.index() >= geometry.surfaces.len();
        // Without what else there is to know of the surface
        let [normal, shading] = if is_light { [self.front(); 2] } else { geometry.normals(&self.ray, &self.hit) };
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
                let color = self.surface().map(|si| materials[si.material.index()].bsdf(si, textures).colors.cosine());
                vector(color.map_or(Vec3::ZERO, |Rgb { r, g, b }| Vec3::new(r, g, b)))
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

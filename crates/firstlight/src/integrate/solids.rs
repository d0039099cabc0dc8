//! Solids between a point and a light: which cannot hide any of it, and what is known in closed form of those that can.

use super::between::{Asker, Between, Pyramid, SLACK};
use super::emitter::Emitter;
use super::hider::Hider;
use super::view::View;
use crate::math::DVec3;
use crate::scene::{Placed, Scene, Target};
use crate::shape::Solid;

impl Between {
    /// Adds a solid or a point set, as it is placed; `false` if the trees have to be asked.
    pub(super) fn solid(
        &mut self,
        scene: &Scene,
        other: u32,
        view: &View,
        pyramid: &Pyramid,
        emitter: &Emitter,
        asker: &Asker,
    ) -> bool {
        if self.hidden {
            return true;
        }
        let thing = &scene.geometry.placed[other as usize];
        let Target::Solid(solid) = thing.target else { return false };
        let solid = &scene.geometry.solids[solid as usize];
        match Rise::of(thing, solid, asker) {
            Rise::Below => return true,
            Rise::Near => {
                self.drift = f32::INFINITY;
                return true;
            }
            Rise::Above => {}
        }
        match solid {
            Solid::Disk(disk) => match disk.placed(&thing.placement) {
                Some(disk) => {
                    self.disk(view, emitter, pyramid, &disk, asker);
                    true
                }
                None => false,
            },
            Solid::Cuboid(cuboid) => {
                let from = asker.si.lit_from.as_dvec3();
                let place = |q| thing.placement.world_from_object.transform_point3(q) - from;
                let middle = place(cuboid.middle());
                let faces = cuboid.faces().map(|face| face.map(place));
                // Those that turn their outside to the point; from inside all hide what is outside
                let is_seen = faces.map(|[a, b, _, d]| {
                    let n = (b - a).cross(d - a);
                    n.dot(a) * n.dot(a - middle) < 0.0
                });
                let is_outside = is_seen.contains(&true);
                let mut faces = faces.iter().zip(is_seen).filter(|(_, is_seen)| *is_seen || !is_outside);
                faces.all(|(face, _)| self.polygon(view, pyramid, emitter, asker, &face.map(|q| q.as_vec3())))
            }
            Solid::Plane(_) => {
                let Some((at, n)) = solid.plane() else { return false };
                let placement = &thing.placement;
                let at = placement.world_from_object.transform_point3(at) - asker.si.lit_from.as_dvec3();
                let n = (placement.object_from_world.matrix3.transpose() * n).normalize();
                self.half_space(view, emitter, at.dot(n), n, asker)
            }
            Solid::Frustum(_) | Solid::Torus(_) | Solid::Ball(_) => false,
        }
    }

    /// Adds an infinite plane with this unit normal, `distance` from the point along it; `false` if the trees have to
    /// be asked.
    fn half_space(&mut self, view: &View, emitter: &Emitter, distance: f64, n: DVec3, asker: &Asker) -> bool {
        let (distance, n) = if distance < 0.0 { (-distance, -n) } else { (distance, n) };
        let heights = match emitter {
            // All of it, not what stands for it
            Emitter::Ball { center, radius, .. } => {
                let middle = n.dot(*center - asker.si.lit_from.as_dvec3());
                [middle - radius, middle + radius]
            }
            _ => {
                let heights = view.corners().map(|l| n.dot(l.as_dvec3()));
                [
                    heights.into_iter().fold(f64::INFINITY, f64::min),
                    heights.into_iter().fold(f64::NEG_INFINITY, f64::max),
                ]
            }
        };
        let [low, high] = heights.map(|height| height - distance);
        let room = f64::from(SLACK) * (distance + heights[0].abs().max(heights[1].abs()));
        // Which part of the light is beyond it is the same from everywhere on its one side
        if distance <= f64::from(asker.reach) + room {
            self.drift = f32::INFINITY;
        }
        if high < -room {
            return true;
        }
        if low > room {
            self.hidden = true;
            return true;
        }
        if matches!(emitter, Emitter::Ball { .. }) || self.hiders.is_full() {
            return false;
        }
        self.add(Some(Hider::beyond(view, n.as_vec3(), distance as f32)));
        true
    }
}

/// How a solid lies to the horizon of a patch.
#[derive(Clone, Copy, Debug)]
enum Rise {
    /// Below that of all its points.
    Below,
    /// Below that of its middle.
    Near,
    Above,
}

impl Rise {
    fn of(thing: &Placed, solid: &Solid, asker: &Asker) -> Rise {
        let (n, p) = (asker.si.horizon.as_dvec3(), asker.si.lit_from.as_dvec3());
        let to_world = &thing.placement.world_from_object;
        let top = solid.support(to_world.matrix3.transpose() * n) + n.dot(to_world.translation);
        let above = top - n.dot(p);
        // A torus can hide what is beside a point of its own
        let is_own = thing.surface == asker.si.surface && !matches!(solid, Solid::Torus(_));
        let Some([low, high]) = solid.bounds().map(|bounds| thing.placement.bounds(bounds)) else {
            return if is_own && above < f64::INFINITY { Rise::Below } else { Rise::Above };
        };
        // What of it is its own surface, is the horizon of all of it: nothing that looks outward is hidden by what it
        // is part of
        let size = (low - p).abs().max((high - p).abs()).length();
        let room = f64::from(SLACK) * size;
        let reach = f64::from(asker.reach);
        if is_own && above <= room || above < -(room + reach * (1.0 + size)) {
            Rise::Below
        } else if above < -room {
            Rise::Near
        } else {
            Rise::Above
        }
    }
}

//! Is the light right? Pictures against what can be known without a renderer: closed forms, symmetry, proofs, another
//! program's picture. Everything here goes through the public interface, but for the light points of [`graded`].

mod alpha;
mod analytic;
mod area_lights;
mod buffers;
mod cameras;
mod cases;
mod checker;
mod coplanar;
mod coverage;
mod determinism;
mod deviations;
mod distances;
mod exact;
mod geometry;
mod known;
mod links;
mod many_lights;
mod masks;
mod materials;
mod meshes;
mod metals;
mod motion;
mod multisample;
mod near;
mod normals;
mod proved;
mod relight;
mod robust;
mod shadow_catcher;
mod studio;
mod terminator;
mod terms;
mod uv_sets;

use firstlight_testkit::{converged, exact_scenes, kept, random, scenes};

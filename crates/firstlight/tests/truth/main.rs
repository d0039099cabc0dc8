//! Is the light right? Pictures against what can be known without a renderer: closed forms, symmetry, proofs, another
//! program's picture. Everything here goes through the public interface, but for the light points of [`graded`].

mod analytic;
mod area_lights;
mod cameras;
mod checker;
mod converged;
mod determinism;
mod deviations;
mod exact;
mod exact_scenes;
mod geometry;
mod graded;
mod kept;
mod known;
mod links;
mod many_lights;
mod random;
mod robust;
mod scenes;
mod terminator;

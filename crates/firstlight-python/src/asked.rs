//! Queries of a scene without a render: `cast` traces rays, `visible` finds the visible fraction of a light.

use firstlight::{CastHit, DVec3, Scene, Vec3, WorldRay};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::error::did_you_mean;
use crate::pool;

/// Rays from arrays of origins and directions.
pub fn rays(origins: &Bound<'_, PyAny>, directions: &Bound<'_, PyAny>) -> PyResult<Vec<WorldRay>> {
    let (origins, directions) = (arrays::points(origins, "origins")?, arrays::points(directions, "directions")?);
    if directions.len() != origins.len() {
        let message = format!("{} origins and {} directions", origins.len(), directions.len());
        return Err(PyValueError::new_err(message));
    }
    let ray = |(i, (o, d)): (usize, (&[f64; 3], &[f64; 3]))| {
        let (o, unit) = (DVec3::from(*o), DVec3::from(*d).normalize_or_zero());
        if !o.is_finite() || unit == DVec3::ZERO {
            return Err(PyValueError::new_err(format!("ray {i} has no direction, or a number that is not finite")));
        }
        Ok(WorldRay { o, d: unit.as_vec3() })
    };
    origins.iter().zip(&directions).enumerate().map(ray).collect()
}

/// What rays meet, as a dict of arrays.
pub fn cast<'py>(py: Python<'py>, scene: &Scene, rays: &[WorldRay]) -> PyResult<Bound<'py, PyDict>> {
    let count = rays.len();
    let hits = pool::run(py, || scene.cast(count, |i| rays[i]));
    let dict = PyDict::new(py);
    let numbers = |of: &dyn Fn(&CastHit) -> u32| hits.iter().map(|h| h.as_ref().map_or(0, of)).collect();
    let vectors = |of: &dyn Fn(&CastHit) -> [f32; 3]| -> PyResult<Bound<'py, PyAny>> {
        let list: Vec<[f32; 3]> = hits.iter().map(|hit| hit.as_ref().map_or([0.0; 3], of)).collect();
        Ok(PyArray1::from_vec(py, list.into_flattened()).reshape([count, 3])?.into_any())
    };
    let pairs = |of: &dyn Fn(&CastHit) -> [f32; 2]| -> PyResult<Bound<'py, PyAny>> {
        let list: Vec<[f32; 2]> = hits.iter().map(|hit| hit.as_ref().map_or([0.0; 2], of)).collect();
        Ok(PyArray1::from_vec(py, list.into_flattened()).reshape([count, 2])?.into_any())
    };
    let distances: Vec<f64> = hits.iter().map(|hit| hit.as_ref().map_or(f64::INFINITY, |hit| hit.t)).collect();
    let places: Vec<[f64; 3]> = hits.iter().map(|hit| hit.as_ref().map_or([0.0; 3], |h| h.p.to_array())).collect();
    dict.set_item("hit", PyArray1::from_vec(py, hits.iter().map(Option::is_some).collect::<Vec<bool>>()))?;
    dict.set_item("distance", PyArray1::from_vec(py, distances))?;
    dict.set_item("position", PyArray1::from_vec(py, places.into_flattened()).reshape([count, 3])?)?;
    dict.set_item("normal", vectors(&|hit| hit.ns.to_array())?)?;
    dict.set_item("normal_geometric", vectors(&|hit| hit.ng.to_array())?)?;
    dict.set_item("uv", pairs(&|hit| hit.uv.to_array())?)?;
    dict.set_item("barycentric", pairs(&|hit| hit.barycentric.to_array())?)?;
    dict.set_item("object_id", PyArray1::<u32>::from_vec(py, numbers(&|hit| hit.surface.0 + 1)))?;
    let material = numbers(&|hit| hit.material.map_or(0, |material| material.0 + 1));
    dict.set_item("material_id", PyArray1::<u32>::from_vec(py, material))?;
    let primitive = numbers(&|hit| hit.primitive.map_or(0, |primitive| primitive + 1));
    dict.set_item("primitive_id", PyArray1::<u32>::from_vec(py, primitive))?;
    Ok(dict)
}

/// The places of a call, and the normals there, if it gives some.
pub struct Places {
    points: Vec<[f64; 3]>,
    normals: Option<Vec<[f64; 3]>>,
}

/// From arrays.
pub fn places(points: &Bound<'_, PyAny>, normals: Option<&Bound<'_, PyAny>>) -> PyResult<Places> {
    let points = arrays::points(points, "points")?;
    let normals = normals.map(|normals| arrays::points(normals, "normals")).transpose()?;
    if let Some(normals) = normals.as_ref().filter(|normals| normals.len() != points.len()) {
        return Err(PyValueError::new_err(format!("{} points and {} normals", points.len(), normals.len())));
    }
    if points.iter().flatten().chain(normals.iter().flatten().flatten()).any(|number| !number.is_finite()) {
        return Err(PyValueError::new_err("points, normals: there are numbers that are not finite"));
    }
    Ok(Places { points, normals })
}

/// The share of a light that points see. `light` is its name, or which it is in scene order, from 1 on: also as `#1`,
/// as buffers have it.
pub fn visible<'py>(
    py: Python<'py>,
    scene: &Scene,
    places: &Places,
    light: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let names: Vec<Option<&str>> = scene.summary().lights.iter().map(|(_, name, _)| name.as_deref()).collect();
    let number = match light.extract::<String>() {
        Ok(name) => match names.iter().position(|own| *own == Some(&name)) {
            Some(index) => Some(index + 1),
            None => name.strip_prefix('#').and_then(|number| number.parse().ok()),
        },
        Err(_) => light.extract::<usize>().ok(),
    };
    let Some(id) = number.and_then(|number| scene.lights().nth(number.checked_sub(1)?)) else {
        let named: Vec<&str> = names.iter().copied().flatten().collect();
        let (light, count) = (light.to_string(), names.len());
        let called = if named.is_empty() { String::new() } else { format!(", named {}", named.join(", ")) };
        let message = match count {
            0 => format!("no light {light}: the scene has none"),
            _ => format!("no light {light}: the scene has {count}, from 1 on{called}{}", did_you_mean(&light, &named)),
        };
        return Err(PyKeyError::new_err(message));
    };
    let Places { points, normals } = places;
    let normal = |i: usize| normals.as_ref().map(|list| DVec3::from(list[i]).normalize_or_zero().as_vec3());
    let seen = |i: usize| (DVec3::from(points[i]), normal(i).filter(|n: &Vec3| *n != Vec3::ZERO));
    Ok(PyArray1::from_vec(py, pool::run(py, || scene.visible_fractions(id, points.len(), seen))))
}

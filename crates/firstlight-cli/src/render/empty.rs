//! A model by itself of which nothing is in the picture.
//!
//! Of a scene that is said in a note, for somebody may mean it so. Of a model by itself nobody does: its camera was
//! found so that it sees all of it, and a picture of the background would pass for one of the model.

use firstlight::{Film, Plane, PlaneNumbers, Scene};

use crate::report::Failure;

/// The largest number of camera rays along each side of the picture that the search traces, which takes a few seconds.
const MOST_RAYS: u64 = 4096;

/// Whether no camera ray meets anything.
pub(super) fn is_empty(scene: &Scene, film: &Film) -> bool {
    if scene.summary().bounds.is_none() {
        return true;
    }
    // A picture of several colours shows something
    if let Some(PlaneNumbers::Floats(color)) = film.numbers(Plane::Color) {
        let pixels = color.as_chunks::<4>().0;
        if pixels.iter().any(|pixel| *pixel != pixels[0]) {
            return false;
        }
    }
    // Ray by ray, from the middle of the picture on, where there is something to be met; of very many a part
    let sides = [scene.width(), scene.height()];
    let [columns, rows] = sides.map(|side| (u64::from(side) * u64::from(scene.antialiasing())).min(MOST_RAYS));
    let at = |ray: u64, rays: u64, side: u32| ((ray as f64 + 0.5) * f64::from(side) / rays as f64) as f32;
    let misses = |column: u64, row: u64| {
        let (ray, _) = scene.camera().ray(at(column, columns, sides[0]), at(row, rows, sides[1]), 1.0);
        scene.intersect(&ray).is_none()
    };
    outwards(rows).all(|row| outwards(columns).all(|column| misses(column, row)))
}

/// The numbers below `count`, from the middle outwards.
fn outwards(count: u64) -> impl Iterator<Item = u64> {
    let middle = count / 2;
    let pair = move |i: u64| [middle.checked_sub(i + 1), Some(middle + i).filter(|n| *n < count)];
    (0..count.div_ceil(2)).flat_map(pair).flatten()
}

/// The error of a model that no camera ray hits, with a hint.
pub(super) fn failure(name: &str, scene: &Scene) -> Failure {
    let summary = scene.summary();
    let why = match summary.triangles + summary.points {
        0 => "there is nothing in it that could be seen".to_owned(),
        _ if summary.bounds.is_none() => "none of its triangles has an area and finite corners".to_owned(),
        _ => "what it holds is thinner than the distance between camera rays; more pixels (--size), more camera rays \
              in each (--aa) or another side (--view) may show it"
            .to_owned(),
    };
    Failure::Work(format!("{name}: no camera ray meets the model, and no picture was written: {why}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_comes_once_from_the_middle_on() {
        assert_eq!(outwards(5).collect::<Vec<_>>(), [1, 2, 0, 3, 4]);
        for count in 0..20 {
            let mut all: Vec<u64> = outwards(count).collect();
            all.sort_unstable();
            assert_eq!(all, (0..count).collect::<Vec<_>>());
        }
    }
}

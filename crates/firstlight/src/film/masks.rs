//! Which pixels each object covers: those where it is seen, and those where it would be seen if it were alone.
//!
//! Both are of the centre rays of pixels. The second, *amodal* masks, come from one traversal of all hits along each
//! ray, not from a render of each object.

use super::Film;
use super::hits::grid_ray;
use crate::image::{Plane, PlaneNumbers, Window};
use crate::parallel;
use crate::scene::Scene;

/// A set of pixels of a picture, in runs down its columns, from the left: the order of COCO.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    width: u32,
    height: u32,
    /// The first pixel of each run and the one after its last, counted down the columns; none touch.
    runs: Vec<[u64; 2]>,
}

/// The masks of one object of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectMasks {
    /// As in [`Plane::ObjectId`].
    pub id: u32,
    /// Where it is seen.
    pub visible: Mask,
    /// Where it would be seen if it were alone; not beyond the picture's edges.
    pub amodal: Mask,
}

/// Columns whose rays are kept at a time.
const TOGETHER: u32 = 64;

impl Mask {
    fn empty(window: Window) -> Mask {
        Mask { width: window.width, height: window.height, runs: Vec::new() }
    }

    /// Adds a pixel: one that was added last again, or one that comes after it.
    fn add(&mut self, x: u32, y: u32) {
        let pixel = u64::from(x) * u64::from(self.height) + u64::from(y);
        match self.runs.last_mut() {
            Some([_, end]) if pixel < *end => {}
            Some([_, end]) if pixel == *end => *end += 1,
            _ => self.runs.push([pixel, pixel + 1]),
        }
    }

    /// The width and height of the picture.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// How many pixels it has.
    pub fn area(&self) -> u64 {
        self.runs.iter().map(|[start, end]| end - start).sum()
    }

    /// The least rectangle around it: x, y, width, height; `None` of none.
    pub fn bounds(&self) -> Option<[u32; 4]> {
        let height = u64::from(self.height);
        let ([first, _], [_, last]) = (self.runs.first()?, self.runs.last()?);
        let [left, right] = [first / height, (last - 1) / height];
        // A run that goes on in the next column covers both ends of the picture
        let rows = self.runs.iter().map(|[start, end]| match (start / height, (end - 1) / height) {
            (from, to) if from < to => [0, height - 1],
            _ => [start % height, (end - 1) % height],
        });
        let [top, bottom] = rows.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])?;
        Some([left, top, right - left + 1, bottom - top + 1].map(|side| side as u32))
    }

    /// How long its runs are: pixels that do not belong to it, pixels that do, and so on, to the end of the picture.
    pub fn counts(&self) -> Vec<u64> {
        let all = u64::from(self.width) * u64::from(self.height);
        let mut ends: Vec<u64> = std::iter::once(0).chain(self.runs.iter().flatten().copied()).collect();
        if ends.last() != Some(&all) || ends.len() == 1 {
            ends.push(all);
        }
        ends.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    /// The same as text, as COCO's own tools compress it: from the fourth on the difference to the last but one, in
    /// groups of five bits, the lowest first.
    ///
    /// Source: pycocotools, `rleToString` in maskApi.c.
    pub fn compressed_counts(&self) -> String {
        let counts = self.counts();
        let mut text = String::new();
        for (i, count) in counts.iter().enumerate() {
            let mut rest = *count as i64 - if i > 2 { counts[i - 2] as i64 } else { 0 };
            loop {
                let group = (rest & 0x1f) as u8;
                rest >>= 5;
                let is_last = rest == if group & 0x10 == 0 { 0 } else { -1 };
                text.push(char::from(48 + group + if is_last { 0 } else { 0x20 }));
                if is_last {
                    break;
                }
            }
        }
        text
    }
}

impl Scene {
    /// The masks of all objects that are seen in a film of this scene, in the order of their ids; `None` if
    /// [`Plane::ObjectId`] was not rendered.
    pub fn object_masks(&self, film: &Film) -> Option<Vec<ObjectMasks>> {
        let Some(PlaneNumbers::Wholes(ids)) = film.numbers(Plane::ObjectId) else { return None };
        Some(self.masks_of_ids(film.window(), ids))
    }

    /// The masks of the objects whose ids are given, for each pixel of a window of this scene's film by rows, in the
    /// order of their ids. Those that are given as 0 have none.
    ///
    /// # Panics
    /// If there are fewer ids than pixels.
    pub fn masks_of_ids(&self, window: Window, ids: &[u32]) -> Vec<ObjectMasks> {
        let Window { x: left, y: top, width, height } = window;
        // Of each id, from 0 on; an object that is not seen keeps none
        let most = ids.iter().copied().max().unwrap_or(0) as usize;
        let mut masks: Vec<Option<ObjectMasks>> = vec![None; most + 1];
        for (x, y) in (0..width).flat_map(|x| (0..height).map(move |y| (x, y))) {
            let id = ids[y as usize * width as usize + x as usize];
            if id > 0 {
                let (visible, amodal) = (Mask::empty(window), Mask::empty(window));
                masks[id as usize].get_or_insert(ObjectMasks { id, visible, amodal }).visible.add(x, y);
            }
        }
        for first in (0..width).step_by(TOGETHER as usize) {
            let columns = TOGETHER.min(width - first);
            let is_seen = |id: u32| masks.get(id as usize).is_some_and(Option::is_some);
            let met = parallel::collect(columns as usize, |column| {
                let x = first + column as u32;
                let mut met: Vec<(u32, u32)> = Vec::new();
                for y in 0..height {
                    // What is seen there is seen alone as well, also where two things are at exactly one place
                    met.push((ids[y as usize * width as usize + x as usize], y));
                    let (ray, _) = grid_ray(self, 1, left + x, top + y);
                    self.meet_all(&ray, |surface| {
                        let id = surface.0 + 1;
                        if is_seen(id) {
                            met.push((id, y));
                        }
                    });
                }
                met
            });
            for (column, met) in met.into_iter().enumerate() {
                for (id, y) in met {
                    // Nothing has no mask
                    if let Some(masks) = &mut masks[id as usize] {
                        masks.amodal.add(first + column as u32, y);
                    }
                }
            }
        }
        masks.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mask(width: u32, height: u32, pixels: &[(u32, u32)]) -> Mask {
        let mut mask = Mask::empty(Window { x: 0, y: 0, width, height });
        pixels.iter().for_each(|(x, y)| mask.add(*x, *y));
        mask
    }

    #[test]
    fn runs_go_down_the_columns() {
        let some = mask(4, 3, &[(0, 2), (1, 0), (1, 0), (1, 1), (3, 1)]);
        assert_eq!((some.counts(), some.area(), some.bounds()), (vec![2, 3, 5, 1, 1], 4, Some([0, 0, 4, 3])));
        let none = mask(4, 3, &[]);
        assert_eq!((none.counts(), none.area(), none.bounds()), (vec![12], 0, None));
        let all = mask(2, 1, &[(0, 0), (1, 0)]);
        assert_eq!((all.counts(), all.bounds()), (vec![0, 2], Some([0, 0, 2, 1])));
        assert_eq!(mask(5, 9, &[(2, 3), (2, 4), (3, 7)]).bounds(), Some([2, 3, 2, 5]));
    }

    /// The texts are those of pycocotools 2.0.
    #[test]
    fn counts_are_compressed_as_by_cocos_own_tools() {
        assert_eq!(mask(4, 3, &[(0, 2), (1, 0), (1, 1), (3, 1)]).compressed_counts(), "235NL");
        assert_eq!(mask(4, 3, &[]).compressed_counts(), "<");
    }
}

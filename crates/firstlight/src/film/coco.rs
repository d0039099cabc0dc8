//! Annotations in COCO's format: a mask and a box of each object in each of many pictures, as JSON.
//!
//! An annotation is an object as [`Plane::ObjectId`] counts them. Its category is its own name: the last part of
//! `left/leg` where it was placed by the instance `left`, so that all instances of a group share their categories.
//!
//! Source: cocodataset.org, "Data format", object detection.

use std::collections::BTreeMap;

use serde_json::{Value as Json, json};

use super::Film;
use super::masks::{Mask, ObjectMasks};
use crate::image::{Plane, PlaneNumbers, Window};
use crate::scene::Scene;

/// A data set that grows picture by picture.
#[derive(Clone, Debug, Default)]
pub struct Coco {
    images: Vec<Json>,
    /// Their names, and the ids: from 1 on, in the order in which they came.
    categories: BTreeMap<String, usize>,
    annotations: Vec<Json>,
}

/// The category of what has no name.
const UNNAMED: &str = "unnamed";

impl Coco {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a picture with all objects that are visible in it. Returns false, and adds nothing, if the film has no
    /// [`Plane::ObjectId`]. `file_name` is the name of the picture's file in the data set. All names in the scene
    /// become categories, visible or not, so that they are the same in all of its pictures.
    pub fn add(&mut self, scene: &Scene, film: &Film, file_name: &str) -> bool {
        let Some(PlaneNumbers::Wholes(ids)) = film.numbers(Plane::ObjectId) else { return false };
        self.add_some(scene, film.window(), ids, &|_| true, file_name);
        true
    }

    /// Adds a picture with those objects that are `wanted`, by their places in
    /// [`object_names`](Scene::object_names); the names of no others become categories. `ids` are those of
    /// [`Plane::ObjectId`] in a window of the scene's film, by rows.
    ///
    /// # Panics
    /// If there are fewer ids than pixels, or one that is no object's.
    pub fn add_some(
        &mut self,
        scene: &Scene,
        window: Window,
        ids: &[u32],
        wanted: &(dyn Fn(usize) -> bool + Sync),
        file_name: &str,
    ) {
        let wanted_id = |id: u32| if id > 0 && wanted(id as usize - 1) { id } else { 0 };
        let ids: Vec<u32> = ids.iter().map(|id| wanted_id(*id)).collect();
        let masks = scene.masks_of_ids(window, &ids);
        let names = scene.object_names();
        let category = |(object, name): (usize, &Option<&str>)| wanted(object).then(|| self.category(*name));
        let categories: Vec<Option<usize>> = names.iter().enumerate().map(category).collect();
        let (image, Window { width, height, .. }) = (self.images.len() + 1, window);
        self.images.push(json!({ "id": image, "file_name": file_name, "width": width, "height": height }));
        for ObjectMasks { id, visible, amodal } in masks {
            let object = id as usize - 1;
            self.annotations.push(json!({
                "id": self.annotations.len() + 1,
                "image_id": image,
                "category_id": categories[object],
                "segmentation": run_lengths(&visible),
                "area": visible.area(),
                "bbox": visible.bounds(),
                "iscrowd": 0,
                "object_id": id,
                "object_name": names[object],
                "amodal_segmentation": run_lengths(&amodal),
                "amodal_area": amodal.area(),
                "amodal_bbox": amodal.bounds(),
                "visible_fraction": visible.area() as f64 / amodal.area() as f64,
            }));
        }
    }

    /// The category of an object of that name: the last part of it, `unnamed` if it has none.
    pub fn category_of(name: Option<&str>) -> &str {
        name.and_then(|name| name.rsplit('/').next()).filter(|own| !own.is_empty()).unwrap_or(UNNAMED)
    }

    /// How many pictures, annotations and categories it has.
    pub fn counts(&self) -> [usize; 3] {
        [self.images.len(), self.annotations.len(), self.categories.len()]
    }

    /// The id of the category of a name.
    fn category(&mut self, name: Option<&str>) -> usize {
        let next = self.categories.len() + 1;
        *self.categories.entry(Self::category_of(name).to_owned()).or_insert(next)
    }

    /// As JSON, an annotation on each line.
    pub fn to_json(&self) -> String {
        let mut categories: Vec<(&String, &usize)> = self.categories.iter().collect();
        categories.sort_by_key(|(_, id)| *id);
        let categories: Vec<Json> = categories.iter().map(|(name, id)| json!({ "id": id, "name": name })).collect();
        let lines = |list: &[Json]| list.iter().map(Json::to_string).collect::<Vec<_>>().join(",\n");
        let info = json!({ "description": crate::image::SOFTWARE });
        format!(
            "{{\"info\": {info},\n\"images\": [\n{}\n],\n\"categories\": [\n{}\n],\n\"annotations\": [\n{}\n]}}\n",
            lines(&self.images),
            lines(&categories),
            lines(&self.annotations)
        )
    }
}

/// A mask as pycocotools reads it.
fn run_lengths(mask: &Mask) -> Json {
    let [width, height] = mask.size();
    json!({ "size": [height, width], "counts": mask.compressed_counts() })
}

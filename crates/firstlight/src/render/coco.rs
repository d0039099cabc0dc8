//! Annotations in COCO's format: a mask and a box of each object in each of many pictures, as JSON.
//!
//! An annotation is an object as [`Plane::ObjectId`] counts them. Its category is its own name: the last part of
//! `left/leg` where it was placed by the instance `left`, so that all instances of a group share their categories.
//!
//! Source: cocodataset.org, "Data format", object detection.

use std::collections::BTreeMap;

use serde_json::{Value as Json, json};

use super::film::Film;
use super::masks::{Mask, ObjectMasks};
use crate::image::Window;
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

    /// Adds a picture with all objects that are seen in it, and says whether it could: not where the film has no
    /// [`Plane::ObjectId`](crate::Plane::ObjectId). `file_name` is what the data set calls the picture's file. All
    /// names in the scene become categories, seen or not, so that they are the same in all of its pictures.
    pub fn add(&mut self, scene: &Scene, film: &Film, file_name: &str) -> bool {
        let Some(masks) = scene.object_masks(film) else { return false };
        let names = scene.object_names();
        let categories: Vec<usize> = names.iter().map(|name| self.category(*name)).collect();
        let (image, Window { width, height, .. }) = (self.images.len() + 1, film.window());
        self.images.push(json!({ "id": image, "file_name": file_name, "width": width, "height": height }));
        for ObjectMasks { id, visible, amodal } in masks {
            let object = id as usize - 1;
            let visible_fraction = visible.area() as f64 / amodal.area() as f64;
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
                "visible_fraction": visible_fraction,
            }));
        }
        true
    }

    /// The id of the category of a name.
    fn category(&mut self, name: Option<&str>) -> usize {
        let own = name.and_then(|name| name.rsplit('/').next()).filter(|own| !own.is_empty()).unwrap_or(UNNAMED);
        if let Some(id) = self.categories.get(own) {
            return *id;
        }
        let id = self.categories.len() + 1;
        self.categories.insert(own.to_owned(), id);
        id
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

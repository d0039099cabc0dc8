//! Numbers of things, which stay theirs while other things are added and removed.

use firstlight::SceneDesc;

/// The families of things in a scene's lists.
pub const FAMILIES: [&str; 5] = ["shape", "light", "camera", "material", "texture"];

/// The number of each thing, family by family, in the order of the lists of a description: later ones are larger.
#[derive(Default)]
pub struct Numbers {
    lists: [Vec<usize>; FAMILIES.len()],
    next: usize,
}

impl Numbers {
    /// Those of a description.
    pub fn of(desc: &SceneDesc) -> Self {
        let lengths =
            [desc.shapes.len(), desc.lights.len(), desc.cameras.len(), desc.materials.len(), desc.textures.len()];
        let mut numbers = Self::default();
        for (family, length) in FAMILIES.into_iter().zip(lengths) {
            for _ in 0..length {
                numbers.push(family);
            }
        }
        numbers
    }

    fn list(&mut self, family: &str) -> Option<&mut Vec<usize>> {
        FAMILIES.iter().position(|own| *own == family).map(|i| &mut self.lists[i])
    }

    /// The number of a thing that is added to the end of its list.
    pub fn push(&mut self, family: &str) -> usize {
        let number = self.next;
        self.next += 1;
        if let Some(list) = self.list(family) {
            list.push(number);
        }
        number
    }

    /// The number of the thing at a place of its list.
    pub fn at(&mut self, family: &str, index: usize) -> usize {
        self.list(family).map_or(0, |list| list[index])
    }

    /// Where the thing of that number is in its list; `None` if it was removed. The picture is at 0.
    pub fn index(&mut self, family: &str, number: usize) -> Option<usize> {
        if family == "render" {
            return Some(0);
        }
        self.list(family)?.binary_search(&number).ok()
    }

    /// How many things a family has.
    pub fn count(&mut self, family: &str) -> usize {
        self.list(family).map_or(0, |list| list.len())
    }

    /// Forgets the thing at a place of its list.
    pub fn remove(&mut self, family: &str, index: usize) {
        if let Some(list) = self.list(family) {
            list.remove(index);
        }
    }

    /// Forgets all of them; no number comes twice.
    pub fn clear(&mut self) {
        self.lists.iter_mut().for_each(Vec::clear);
    }
}

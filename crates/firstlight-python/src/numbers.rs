//! Numbers of things, which stay theirs while other things are added and removed, and what is found by its name.

use std::collections::HashMap;

use firstlight::SceneDesc;

use crate::item::names;

/// The families of things in a scene's lists.
pub const FAMILIES: [&str; 5] = ["shape", "light", "camera", "material", "texture"];

/// The number of each thing, family by family.
#[derive(Default)]
pub struct Numbers {
    families: [Family; FAMILIES.len()],
    next: usize,
}

#[derive(Default)]
struct Family {
    /// In the order of the list of a description: later ones are larger.
    list: Vec<usize>,
    /// By name, the first of that name.
    named: HashMap<String, usize>,
    /// Whether several are called alike, as shapes of a text may be.
    has_twins: bool,
}

impl Numbers {
    /// Those of a description.
    pub fn of(desc: &SceneDesc) -> Self {
        let lengths =
            [desc.shapes.len(), desc.lights.len(), desc.cameras.len(), desc.materials.len(), desc.textures.len()];
        let mut numbers = Self::default();
        for (family, length) in FAMILIES.into_iter().zip(lengths) {
            for _ in 0..length {
                numbers.push(family, None);
            }
            numbers.name_all(family, desc);
        }
        numbers
    }

    fn family(&mut self, family: &str) -> Option<&mut Family> {
        FAMILIES.iter().position(|own| *own == family).map(|i| &mut self.families[i])
    }

    /// Finds the names of a family in a description.
    fn name_all(&mut self, family: &str, desc: &SceneDesc) {
        let Some(own) = self.family(family) else { return };
        own.named.clear();
        own.has_twins = false;
        for (index, name) in names(desc, family) {
            let number = own.list[index];
            own.has_twins |= *own.named.entry(name.into_owned()).or_insert(number) != number;
        }
    }

    /// The number of a thing that is added to the end of its list; its name is not taken.
    pub fn push(&mut self, family: &str, name: Option<String>) -> usize {
        let number = self.next;
        self.next += 1;
        if let Some(own) = self.family(family) {
            own.list.push(number);
            own.named.extend(name.map(|name| (name, number)));
        }
        number
    }

    /// Where the thing of that number is in its list; `None` if it was removed. The picture is at 0.
    pub fn index(&mut self, family: &str, number: usize) -> Option<usize> {
        if family == "render" {
            return Some(0);
        }
        self.family(family)?.list.binary_search(&number).ok()
    }

    /// The number of the first thing of that name.
    pub fn named(&mut self, family: &str, name: &str) -> Option<usize> {
        self.family(family)?.named.get(name).copied()
    }

    /// How many things a family has.
    pub fn count(&mut self, family: &str) -> usize {
        self.family(family).map_or(0, |own| own.list.len())
    }

    /// Notes that the thing of a number has another name than `before`; `desc` has it already.
    pub fn rename(&mut self, family: &str, number: usize, before: Option<&str>, now: Option<String>, desc: &SceneDesc) {
        let Some(own) = self.family(family) else { return };
        if own.has_twins {
            return self.name_all(family, desc);
        }
        before.map(|before| own.named.remove(before));
        own.named.extend(now.map(|now| (now, number)));
    }

    /// Forgets the thing at a place of its list, which `desc` no longer has.
    pub fn remove(&mut self, family: &str, index: usize, name: Option<&str>, desc: &SceneDesc) {
        let Some(own) = self.family(family) else { return };
        own.list.remove(index);
        if own.has_twins {
            return self.name_all(family, desc);
        }
        name.map(|name| own.named.remove(name));
    }

    /// Forgets all of them; no number comes twice.
    pub fn clear(&mut self) {
        self.families = Default::default();
    }
}

//! Which lights shine on a surface, and for which lights it casts shadows: sets of lights, each kept once.
//!
//! Surfaces that say nothing have no set and pay nothing. The lists of an instance and those of what it places are
//! combined: both must allow a light.

use std::collections::HashMap;

use crate::context::{CompileContext, MAX_FAULTS};
use crate::ids::LightId;
use crate::light::LightDesc;

/// A set of lights, one of [`LinkSets`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct LinkId(u32);

/// Sets of lights, bit by bit.
#[derive(Clone, Debug, Default)]
pub(crate) struct LinkSets {
    /// Of each set.
    words: usize,
    bits: Vec<u64>,
}

impl LinkSets {
    /// Whether no surface chooses among the lights.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.bits.is_empty()
    }

    /// Whether a light is in a set; `None` is all lights.
    #[inline(always)]
    pub fn contains(&self, set: Option<LinkId>, light: LightId) -> bool {
        set.is_none_or(|set| self.bits_of(set)[light.index() / 64] >> (light.index() % 64) & 1 == 1)
    }

    /// The link class of each light: two lights have the same class if every set holds both or neither.
    pub fn classes(&self, lights: usize) -> Vec<u32> {
        let mut classes = vec![0; lights];
        for set in self.bits.chunks_exact(self.words.max(1)) {
            let mut numbers: HashMap<(u32, bool), u32> = HashMap::new();
            for (light, class) in classes.iter_mut().enumerate() {
                let is_in = set[light / 64] >> (light % 64) & 1 == 1;
                let next = numbers.len() as u32;
                *class = *numbers.entry((*class, is_in)).or_insert(next);
            }
        }
        classes
    }

    #[inline]
    fn bits_of(&self, LinkId(set): LinkId) -> &[u64] {
        &self.bits[set as usize * self.words..][..self.words]
    }
}

/// Bytes of all sets.
const MAX_BYTES: usize = 1 << 28;

/// Names to sets of lights.
pub(super) struct Links {
    /// Of the lights that have one, each once.
    names: Vec<String>,
    /// The lights of a name.
    lights: HashMap<String, Vec<usize>>,
    count: usize,
    sets: LinkSets,
    ids: HashMap<Box<[u64]>, LinkId>,
    /// What two sets have in common, where that was asked.
    common: HashMap<(LinkId, LinkId), Option<LinkId>>,
    /// Whether the sets take more than they may.
    full: bool,
}

impl Links {
    pub fn new(described: &[LightDesc]) -> Self {
        let mut lights: HashMap<String, Vec<usize>> = HashMap::new();
        let mut names = Vec::new();
        for (number, light) in LightDesc::in_scene_order(described).enumerate() {
            if let Some(name) = light.name() {
                if !lights.contains_key(&name) {
                    names.push(name.clone());
                }
                lights.entry(name).or_default().push(number);
            }
        }
        // A scene without lights may be given one
        let count = described.len().max(1);
        let sets = LinkSets { words: count.div_ceil(64), bits: Vec::new() };
        Links { names, lights, count, sets, ids: HashMap::new(), common: HashMap::new(), full: false }
    }

    /// The set of a list of names that are in it, or of one of names that are not. `None` for all lights.
    pub fn compile(
        &mut self,
        cx: &mut CompileContext,
        [include_field, exclude_field]: [&str; 2],
        [include, exclude]: [Option<&[String]>; 2],
    ) -> Option<LinkId> {
        if include.is_some() && exclude.is_some() {
            let message = format!("it is said beside {include_field}");
            cx.error(exclude_field, message, Some("name the lights that count, or those that do not"));
        }
        let (field, list) = include.map(|list| (include_field, list)).or(exclude.map(|list| (exclude_field, list)))?;
        let mut bits = vec![0u64; self.sets.words];
        for (i, name) in list.iter().enumerate() {
            match self.lights.get(name.as_str()) {
                Some(lights) => lights.iter().for_each(|light| bits[light / 64] |= 1 << (light % 64)),
                None => {
                    // Of too many faults none is shown
                    let shown = if cx.error_count() < MAX_FAULTS { self.names.as_slice() } else { &[] };
                    let names: Vec<&str> = shown.iter().map(String::as_str).collect();
                    cx.unknown(&format!("{field}[{i}]"), "light", name, &names);
                }
            }
        }
        if include.is_none() {
            for (i, word) in bits.iter_mut().enumerate() {
                *word = !*word & self.all(i);
            }
        }
        self.intern(bits)
    }

    /// The bits of all lights.
    fn all(&self, word: usize) -> u64 {
        let left = self.count - word * 64;
        if left >= 64 { u64::MAX } else { (1 << left) - 1 }
    }

    fn intern(&mut self, bits: Vec<u64>) -> Option<LinkId> {
        if bits.iter().enumerate().all(|(i, word)| *word == self.all(i)) {
            return None;
        }
        if let Some(id) = self.ids.get(bits.as_slice()) {
            return Some(*id);
        }
        if size_of_val(self.sets.bits.as_slice()) >= MAX_BYTES {
            self.full = true;
            return None;
        }
        let id = LinkId(self.ids.len() as u32);
        self.sets.bits.extend(&bits);
        self.ids.insert(bits.into(), id);
        Some(id)
    }

    /// The lights of both sets.
    pub fn both(&mut self, a: Option<LinkId>, b: Option<LinkId>) -> Option<LinkId> {
        let (Some(a), Some(b)) = (a, b) else { return a.or(b) };
        if a == b {
            return Some(a);
        }
        if let Some(known) = self.common.get(&(a, b)) {
            return *known;
        }
        let bits = self.sets.bits_of(a).iter().zip(self.sets.bits_of(b)).map(|(a, b)| a & b).collect();
        let both = self.intern(bits);
        self.common.insert((a, b), both);
        both
    }

    /// The sets that were made, or a fault if they are too many.
    pub fn finish(self, cx: &mut CompileContext) -> LinkSets {
        if self.full {
            let message = format!("the lists of lights make different sets of more than {MAX_BYTES} bytes together");
            cx.error("instance", message, Some("let more shapes share their lists"));
        }
        self.sets
    }
}

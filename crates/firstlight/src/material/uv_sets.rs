//! The sets of texture coordinates that the textures of a material name.

use super::{Material, NormalMapping};
use crate::ids::TextureId;
use crate::shape::UV_SETS;

/// The sets of texture coordinates that the textures of a material name. If none names a set, `all`, `maps` and
/// `named_by` are empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct UvSetUse {
    /// The sets, as bits.
    pub all: u8,
    /// Those of normal maps and bump maps.
    pub maps: u8,
    /// Whether a normal map or a bump map names none.
    pub has_own_map: bool,
    /// For each set the first texture that names it, as an index of the textures of the scene's description.
    pub named_by: [Option<u32>; UV_SETS],
}

impl UvSetUse {
    /// The sets of both.
    pub fn joined(self, other: &UvSetUse) -> UvSetUse {
        UvSetUse {
            all: self.all | other.all,
            maps: self.maps | other.maps,
            has_own_map: self.has_own_map || other.has_own_map,
            named_by: std::array::from_fn(|set| self.named_by[set].or(other.named_by[set])),
        }
    }

    /// The first set at or beyond the first `sets`, and the texture that names it.
    pub fn beyond(&self, sets: usize) -> Option<(usize, u32)> {
        (sets..UV_SETS).find_map(|set| Some((set, self.named_by[set]?)))
    }
}

impl Material {
    /// The sets that its textures name; `named` is the one that a texture names, and the texture's index.
    pub(crate) fn uv_set_use(&self, named: impl Fn(TextureId) -> Option<(u8, u32)>) -> UvSetUse {
        let mut sets = UvSetUse::default();
        let alpha = self.common.alpha.iter().flat_map(|alpha| alpha.textures());
        for (set, texture) in self.textures().chain(alpha).flatten().filter_map(&named) {
            sets.all |= 1 << set;
            sets.named_by[usize::from(set)].get_or_insert(texture);
        }
        let maps = self.common.normals.iter().chain(self.coat_normals());
        for map in maps.flat_map(NormalMapping::textures).flatten() {
            match named(map) {
                Some((set, _)) => sets.maps |= 1 << set,
                None => sets.has_own_map = true,
            }
        }
        sets
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_joined_and_those_that_are_missing_found() {
        let one = UvSetUse { all: 0b0010, named_by: [None, Some(7), None, None], ..UvSetUse::default() };
        let other = UvSetUse { all: 0b1010, maps: 0b1000, has_own_map: true, named_by: [None, Some(2), None, Some(3)] };
        let both = one.joined(&other);
        assert_eq!((both.all, both.maps, both.has_own_map), (0b1010, 0b1000, true));
        assert_eq!(both.named_by, [None, Some(7), None, Some(3)]);
        assert_eq!([1, 2, 4, 9].map(|sets| both.beyond(sets)), [Some((1, 7)), Some((3, 3)), None, None]);
    }
}

//! Cryptomatte: who is in each pixel, and how much of it is theirs, in channels that compositing programs read.
//!
//! A layer has six ranks in a pixel, the greatest share first, each an id and a share. An id is a hash of a name, so it
//! is the same in every file, whatever else is in the scene; what has the same name is one matte.
//!
//! Source: Friedman and Jones, "Fully automatic id mattes with support for motion blur and transparency", 2015;
//! Psyop, "Cryptomatte specification", version 1.2.0. The hash: Appleby, MurmurHash3, 32 bits for x86.

use std::collections::BTreeMap;

use super::{NamedPlane, Plane, Receipt};

/// Numbers of a pixel of a layer: six ids, each followed by its share.
pub(crate) const NUMBERS: usize = 12;

/// What ids are given to, in scene order, and names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Named {
    Object,
    Instance,
    Material,
}

/// The channels of a layer of that name.
macro_rules! layer {
    ($name:literal) => {
        [
            concat!($name, "00.R"),
            concat!($name, "00.G"),
            concat!($name, "00.B"),
            concat!($name, "00.A"),
            concat!($name, "01.R"),
            concat!($name, "01.G"),
            concat!($name, "01.B"),
            concat!($name, "01.A"),
            concat!($name, "02.R"),
            concat!($name, "02.G"),
            concat!($name, "02.B"),
            concat!($name, "02.A"),
        ]
    };
}

impl Named {
    pub const ALL: [Named; 3] = [Named::Object, Named::Instance, Named::Material];

    /// What a plane tells apart.
    pub fn of(plane: Plane) -> Option<Named> {
        match plane {
            Plane::ObjectId | Plane::CryptoObject | Plane::BackgroundCoverage => Some(Named::Object),
            Plane::InstanceId | Plane::CryptoInstance => Some(Named::Instance),
            Plane::MaterialId | Plane::CryptoMaterial => Some(Named::Material),
            _ => None,
        }
    }

    /// The layer of a plane that is one.
    pub fn of_layer(plane: Plane) -> Option<Named> {
        Named::of(plane).filter(|named| plane.channels() == named.channels())
    }

    /// In a word.
    pub fn word(self) -> &'static str {
        match self {
            Named::Object => "object",
            Named::Instance => "instance",
            Named::Material => "material",
        }
    }

    /// The name of its layer, as other renderers have it.
    #[cfg_attr(not(feature = "exr"), allow(dead_code, reason = "only EXR files say it"))]
    fn layer(self) -> &'static str {
        match self {
            Named::Object => "CryptoObject",
            Named::Instance => "CryptoInstance",
            Named::Material => "CryptoMaterial",
        }
    }

    /// The channels of its layer: id, share, id, share of two ranks in each four.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Named::Object => &layer!("CryptoObject"),
            Named::Instance => &layer!("CryptoInstance"),
            Named::Material => &layer!("CryptoMaterial"),
        }
    }

    /// The key of its [`manifest`] in receipts.
    pub fn manifest_key(self) -> String {
        format!("{}_manifest", self.word())
    }
}

/// What is hashed of thing number `id`, from 1 on: its name, or the number of one that has none.
pub(crate) fn hashed_name(id: usize, name: Option<&str>) -> String {
    name.map_or_else(|| format!("#{id}"), str::to_owned)
}

/// The bits of the number that stands for a name: its hash, with the exponent of one that is finite and not 0.
pub(crate) fn id_bits(name: &str) -> u32 {
    let hash = murmur3_32(name.as_bytes());
    let exponent = (hash >> 23 & 255).clamp(1, 254);
    hash & !(255 << 23) | exponent << 23
}

/// MurmurHash3_x86_32 with the seed 0.
fn murmur3_32(bytes: &[u8]) -> u32 {
    let mix = |word: u32| word.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let (words, tail) = bytes.as_chunks::<4>();
    let mut hash = 0u32;
    for word in words {
        hash = (hash ^ mix(u32::from_le_bytes(*word))).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    hash ^= mix(tail.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte)));
    hash ^= bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

/// The JSON dictionary from names to their [bits](id_bits), 8 hexadecimal digits, sorted by name.
pub(crate) fn manifest<'a>(names: impl Iterator<Item = Option<&'a str>>) -> String {
    let named = (1..).zip(names).map(|(id, name)| hashed_name(id, name));
    let with_bits = |name: String| {
        let bits = format!("{:08x}", id_bits(&name));
        (name, bits)
    };
    serde_json::json!(named.map(with_bits).collect::<BTreeMap<_, _>>()).to_string()
}

/// What a file of such layers says before its pixels: keys and values.
#[cfg_attr(not(feature = "exr"), allow(dead_code, reason = "only EXR files say it"))]
pub(crate) fn metadata(planes: &[NamedPlane<'_>], receipt: &Receipt) -> Vec<(String, String)> {
    let mut all = Vec::new();
    for named in planes.iter().filter_map(|plane| Named::of_layer(plane.plane)) {
        let layer = named.layer();
        let key = format!("{:08x}", id_bits(layer));
        let mut say =
            |what: &str, value: &str| all.push((format!("cryptomatte/{}/{what}", &key[..7]), value.to_owned()));
        say("name", layer);
        say("hash", "MurmurHash3_32");
        say("conversion", "uint32_to_float32");
        let manifest_key = named.manifest_key();
        if let Some((_, manifest)) = receipt.entries.iter().find(|(key, _)| *key == manifest_key) {
            say("manifest", manifest);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_those_that_others_have() {
        // Published values of the hash
        for (text, hash) in [
            ("", 0),
            ("hello", 0x248b_fa47),
            ("hello, world", 0x149b_bb7f),
            ("The quick brown fox jumps over the lazy dog", 0x2e4f_f723),
        ] {
            assert_eq!(murmur3_32(text.as_bytes()), hash, "{text}");
        }
        // The manifest that the specification prints
        for (name, bits) in [("bunny", 0x1385_1a76), ("default", 0x42c9_679f), ("bunny_porcelain_mat", 0xb24b_26d4)] {
            assert_eq!(id_bits(name), bits, "{name}");
        }
        // By which a header knows the layer
        assert_eq!(format!("{:08x}", id_bits("CryptoObject"))[..7], *"3ae39a5");
    }

    #[test]
    fn ids_are_finite_numbers() {
        for number in 0..20_000 {
            let name = format!("thing {number}");
            assert!(f32::from_bits(id_bits(&name)).is_normal(), "{name}");
        }
        assert_eq!(id_bits(""), 1 << 23);
    }

    #[test]
    fn manifests_are_sorted_and_name_what_has_no_name() {
        let names = [Some("b \"1\""), None, Some("a"), Some("a")];
        let ids = ["#2", "a", "b \"1\""].map(|name| format!("{:08x}", id_bits(name)));
        let expected = format!("{{\"#2\":\"{}\",\"a\":\"{}\",\"b \\\"1\\\"\":\"{}\"}}", ids[0], ids[1], ids[2]);
        assert_eq!(manifest(names.into_iter()), expected);
    }
}

//! Damage to what is no text.

use crate::Random;

/// Numbers where something ends, as the bits of 32.
const WORDS: &[u32] = &[
    0,
    1,
    2,
    0xff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    // NaN, infinity, the largest and the smallest numbers, 1e20, -1e9, 1e-30
    0x7fc0_0000,
    0x7f80_0000,
    0xff80_0000,
    0x7f7f_ffff,
    0xff7f_ffff,
    0x0000_0001,
    0x60ad_78ec,
    0xce6e_6b28,
    0x0da2_4260,
];

/// The longest file that becomes longer.
const LONGEST: usize = 1 << 18;

fn place(bytes: &[u8], random: &mut Random) -> usize {
    random.below(bytes.len().max(1) as u32) as usize
}

/// Blindly.
pub fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let (at, other) = (place(bytes, random), place(bytes, random));
    let (low, high) = (at.min(other), at.max(other));
    match random.below(8) {
        0 => bytes.truncate(at),
        1 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
        2 if !bytes.is_empty() => bytes[at] = random.pick(&[0, b'0', b'-', b'"', b'{', b'\n', 0x7f, 0x80, 0xff]),
        3 => drop(bytes.drain(low..high.min(low + 16))),
        4 if bytes.len() < LONGEST => {
            let again = bytes[low..high].to_vec();
            bytes.splice(low..low, again);
        }
        5 if !bytes.is_empty() => bytes.swap(at, other),
        6 => (0..4).for_each(|_| bytes.insert(at.min(bytes.len()), random.below(256) as u8)),
        _ => word(bytes, at, random),
    }
}

/// Numbers of two and four bytes, where they may be.
pub fn damage_numbers(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = place(bytes, random) & !3;
    match random.below(8) {
        0 => bytes.truncate(place(bytes, random)),
        1 => bytes.extend((0..=random.below(64)).map(|i| i as u8)),
        2 => {
            let end = bytes.len().min(at + 4);
            bytes[at.min(end)..end].reverse();
        }
        3 => {
            let (value, from) = (random.pick(WORDS), place(bytes, random) & !3);
            for word in bytes[from.min(at)..at.max(from)].as_chunks_mut::<4>().0 {
                *word = value.to_le_bytes();
            }
        }
        4 => {
            let half = random.pick(WORDS) as u16;
            if let Some(bytes) = bytes.get_mut(at..at + 2) {
                bytes.copy_from_slice(&half.to_le_bytes());
            }
        }
        _ => word(bytes, at, random),
    }
}

fn word(bytes: &mut [u8], at: usize, random: &mut Random) {
    let value = if random.chance(0.2) { random.bits() as u32 } else { random.pick(WORDS) };
    if let Some(bytes) = bytes.get_mut(at..at + 4) {
        bytes.copy_from_slice(&value.to_le_bytes());
    }
}

/// The headers of a GLB file and of its chunks.
pub fn damage_header(bytes: &mut [u8], random: &mut Random) {
    let json = bytes.get(12..16).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let at = random.pick(&[0, 4, 8, 12, 16, json.saturating_add(20), json.saturating_add(24)]);
    let Some(bytes) = bytes.get_mut(at..at.saturating_add(4)) else { return };
    let old = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let new = match random.below(5) {
        0 => random.pick(WORDS),
        1 => random.pick(&[0x4e4f_534a, 0x004e_4942]),
        2 => old.wrapping_add(random.below(9)).wrapping_sub(4),
        3 => old / 2,
        _ => 1 << random.below(32),
    };
    bytes.copy_from_slice(&new.to_le_bytes());
}

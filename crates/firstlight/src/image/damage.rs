//! Damage in picture files that is looked for before a decoder sees them, because decoders fail on it.
//!
//! Only what no sound file has is refused, and what cannot be followed is left to the decoder: it knows best what a
//! file may lack. What neither of the two finds is caught (`contain.rs`).

/// Looks at the palette of a PNG file.
///
/// # Errors
/// What is wrong.
pub(super) fn in_png(bytes: &[u8]) -> Result<(), String> {
    let mut rest = bytes.get(8..).unwrap_or_default();
    while let Some((&[a, b, c, d, ref kind @ ..], data)) = rest.split_first_chunk::<8>() {
        let length = u32::from_be_bytes([a, b, c, d]) as usize;
        match kind {
            b"IDAT" => break,
            b"PLTE" if length == 0 || !length.is_multiple_of(3) || length > 3 * 256 => {
                return Err(format!("its palette has {length} bytes, not 3 for each of 1 to 256 colours"));
            }
            _ => {}
        }
        // The checksum follows the data
        let Some(next) = length.checked_add(4).and_then(|skip| data.get(skip..)) else { break };
        rest = next;
    }
    Ok(())
}

/// Looks at what the segments of a JPEG file say of its components, codes and scans.
///
/// Source: ITU-T T.81, sections B.2.2 (frame), B.2.3 (scan), B.2.4.2 (Huffman codes), G.1.1.1 (progressive scans).
///
/// # Errors
/// What is wrong.
pub(super) fn in_jpeg(bytes: &[u8]) -> Result<(), String> {
    let mut frame: Option<JpegFrame> = None;
    let mut at = 2;
    // What does not begin a segment belongs to the pixels, or is passed over by the decoder too
    while let Some(found) = bytes.get(at..).and_then(|rest| rest.iter().position(|b| *b == 0xff)) {
        at += found + 1;
        let Some(&marker) = bytes.get(at) else { break };
        match marker {
            // The end; what follows is no part of the picture
            0xd9 => break,
            // A byte of the pixels, a filling, a restart
            0x00 | 0x01 | 0xd0..=0xd8 | 0xff => continue,
            _ => {}
        }
        let Some(&[high, low]) = bytes.get(at + 1..at + 3) else { break };
        let length = usize::from(u16::from_be_bytes([high, low]));
        let Some(segment) = bytes.get(at + 3..at + 1 + length) else { break };
        match marker {
            0xc0..=0xc2 if frame.is_some() => return Err("it has two frames".into()),
            0xc0..=0xc2 => frame = Some(JpegFrame::read(segment, marker == 0xc2)?),
            0xc4 => check_codes(segment)?,
            0xda => match &frame {
                None => return Err("its pixels come before its frame".into()),
                Some(frame) => frame.check_scan(segment)?,
            },
            _ => {}
        }
        at += 1 + length;
    }
    Ok(())
}

/// What a frame's header says.
struct JpegFrame {
    progressive: bool,
    /// The number and the sampling factors of each component, across and down.
    components: Vec<[u8; 3]>,
}

impl JpegFrame {
    fn read(segment: &[u8], progressive: bool) -> Result<Self, String> {
        let Some((&[_, _, _, _, _, count], rest)) = segment.split_first_chunk::<6>() else {
            return Err("its frame is cut short".into());
        };
        // Two are no picture: neither gray nor colours
        if !matches!(count, 1 | 3 | 4) || rest.len() != 3 * usize::from(count) {
            return Err(format!("its frame has {count} components in {} bytes, not 1, 3 or 4 in 3 each", rest.len()));
        }
        let components: Vec<[u8; 3]> = rest.chunks_exact(3).map(|c| [c[0], c[1] >> 4, c[1] & 15]).collect();
        for (i, [number, across, down]) in components.iter().enumerate() {
            if !(1..=4).contains(across) || !(1..=4).contains(down) {
                return Err(format!("component {number} is sampled {across} x {down}, not 1 to 4 times"));
            }
            if components[..i].iter().any(|other| other[0] == *number) {
                return Err(format!("its frame has component {number} twice"));
            }
        }
        Ok(Self { progressive, components })
    }

    fn check_scan(&self, segment: &[u8]) -> Result<(), String> {
        let count = segment.first().map_or(0, |n| usize::from(*n));
        if !(1..=4).contains(&count) || segment.len() != 4 + 2 * count {
            return Err(format!("a scan has {count} components in {} bytes", segment.len()));
        }
        let (components, last) = segment[1..].split_at(2 * count);
        let mut blocks = 0;
        for (i, component) in components.chunks_exact(2).enumerate() {
            let [number, tables] = [component[0], component[1]];
            let Some([_, across, down]) = self.components.iter().find(|known| known[0] == number) else {
                return Err(format!("a scan has component {number}, which the frame has not"));
            };
            if components[..2 * i].chunks_exact(2).any(|other| other[0] == number) {
                return Err(format!("a scan has component {number} twice"));
            }
            if tables >> 4 > 3 || tables & 15 > 3 {
                return Err(format!("a scan uses codes {} and {}, not 0 to 3", tables >> 4, tables & 15));
            }
            blocks += across * down;
        }
        if count > 1 && blocks > 10 {
            return Err(format!("a scan has {blocks} blocks in each unit, the limit is 10"));
        }
        let [start, end, bits] = [last[0], last[1], last[2]];
        let (high, low) = (bits >> 4, bits & 15);
        let band = if start == 0 { end == 0 } else { count == 1 && start <= end && end <= 63 };
        if self.progressive && !(band && low <= 13 && (high == 0 || high == low + 1)) {
            return Err(format!("a scan has coefficients {start} to {end} of bits {high} and {low}, which none can"));
        }
        Ok(())
    }
}

/// Looks at Huffman codes.
fn check_codes(mut segment: &[u8]) -> Result<(), String> {
    while let Some((&[kind, ref counts @ ..], rest)) = segment.split_first_chunk::<17>() {
        let symbols: usize = counts.iter().map(|n| usize::from(*n)).sum();
        // Codes of each length, as parts of 2^16
        let room: usize = counts.iter().zip(1..).map(|(n, length)| usize::from(*n) << (16 - length)).sum();
        if kind >> 4 > 1 || kind & 15 > 3 || symbols > 256 || room > 1 << 16 {
            return Err(format!("its code {kind:#04x} of {symbols} symbols is none"));
        }
        segment = rest.get(symbols..).ok_or_else(|| String::from("a code is cut short"))?;
    }
    if segment.is_empty() { Ok(()) } else { Err("a code is cut short".into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(name: &str) -> Vec<u8> {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/images");
        std::fs::read(folder.join(name)).unwrap()
    }

    /// Where the first segment of a marker begins, behind its length.
    fn segment(bytes: &[u8], marker: u8) -> usize {
        let mut at = 2;
        while bytes[at + 1] != marker {
            at += 2 + usize::from(u16::from_be_bytes([bytes[at + 2], bytes[at + 3]]));
        }
        at + 4
    }

    #[test]
    fn sound_files_pass() {
        for name in ["basn3p04.png", "tbbn3p08.png", "basn2c16.png", "s07i3p02.png", "bricks-color.png"] {
            in_png(&data(name)).unwrap();
        }
        for name in ["bricks-color.jpeg", "progressive_cat.jpg", "exif_portrait_2.jpg"] {
            in_jpeg(&data(name)).unwrap();
        }
        // Whatever is cut off
        let cat = data("progressive_cat.jpg");
        for length in 0..cat.len() {
            in_jpeg(&cat[..length]).unwrap();
        }
    }

    #[test]
    fn a_palette_is_whole_colours() {
        let chunk = |length: u32| [b"\x89PNG\r\n\x1a\n".as_slice(), &length.to_be_bytes(), b"PLTE"].concat();
        for (length, sound) in [(0, false), (1, false), (3, true), (4, false), (767, false), (768, true), (771, false)]
        {
            assert_eq!(in_png(&chunk(length)).is_ok(), sound, "{length}");
        }
        assert_eq!(in_png(&chunk(4)).unwrap_err(), "its palette has 4 bytes, not 3 for each of 1 to 256 colours");
    }

    #[test]
    fn damaged_segments_are_told() {
        let (cat, bricks) = (data("progressive_cat.jpg"), data("bricks-color.jpeg"));
        let words = |file: &[u8], marker: u8, at: usize, value: u8| {
            let mut damaged = file.to_vec();
            let at = segment(file, marker) + at;
            assert_ne!(damaged[at], value);
            damaged[at] = value;
            in_jpeg(&damaged).unwrap_err()
        };
        assert_eq!(words(&cat, 0xc2, 5, 2), "its frame has 2 components in 9 bytes, not 1, 3 or 4 in 3 each");
        assert_eq!(words(&cat, 0xc2, 7, 0x50), "component 1 is sampled 5 x 0, not 1 to 4 times");
        assert_eq!(words(&cat, 0xc2, 9, 1), "its frame has component 1 twice");
        assert_eq!(words(&cat, 0xda, 0, 9), "a scan has 9 components in 10 bytes");
        assert_eq!(words(&cat, 0xda, 1, 9), "a scan has component 9, which the frame has not");
        assert_eq!(words(&cat, 0xda, 1, 2), "a scan has component 2 twice");
        assert_eq!(words(&cat, 0xda, 2, 0x54), "a scan uses codes 5 and 4, not 0 to 3");
        assert_eq!(words(&cat, 0xda, 8, 63), "a scan has coefficients 0 to 63 of bits 0 and 1, which none can");
        assert_eq!(words(&bricks, 0xc0, 7, 0x44), "a scan has 18 blocks in each unit, the limit is 10");
        assert_eq!(words(&bricks, 0xc4, 0, 0x20), "its code 0x20 of 10 symbols is none");
        assert_eq!(words(&bricks, 0xc4, 1, 255), "its code 0x00 of 265 symbols is none");
        assert_eq!(words(&bricks, 0xc4, 1, 3), "its code 0x00 of 13 symbols is none");
        let twice = [&bricks[..segment(&bricks, 0xda) - 4], &bricks[segment(&bricks, 0xc0) - 4..]].concat();
        assert_eq!(in_jpeg(&twice).unwrap_err(), "it has two frames");
        let late = [&bricks[..2], &bricks[segment(&bricks, 0xda) - 4..]].concat();
        assert_eq!(in_jpeg(&late).unwrap_err(), "its pixels come before its frame");
    }
}

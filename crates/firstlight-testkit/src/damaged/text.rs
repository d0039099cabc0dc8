//! Damage to texts of lines and words.

use super::{bytes, reference};
use crate::Random;

/// Numbers, and words in place of numbers.
const WORDS: &[&str] = &[
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "0.5",
    "1e308",
    "-1e308",
    "1e309",
    "1e39",
    "1e-320",
    "1e20",
    "1000000",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "-2147483648",
    "nan",
    "NaN",
    "inf",
    "-inf",
    "0x10",
    "1,5",
    "1.2.3",
    "--1",
    "1/1/1",
    "1//1",
    "1/",
    "/",
    "-1/-1/-1",
    "99999999",
    "",
    "#",
    "\\",
    "\"",
    "\u{0}",
    "\u{fffd}",
    "on",
    "off",
    "-o",
    "-s",
    "-t",
    "-mm",
    "-bm",
    "-clamp",
    "-imfchan",
    "-texres",
    "-blendu",
    "-boost",
    "-type",
];

/// Statements and options of OBJ and MTL files.
const LINES: &[&str] = &[
    "newmtl",
    "newmtl red",
    "newmtl \u{e9}\u{1f600}",
    "usemtl red",
    "usemtl",
    "usemtl none",
    "mtllib",
    "s 99999999999",
    "s off",
    "f 1 2 3 4 5 6 7 8",
    "f -1 -2 -3",
    "f 1 1 1",
    "f 0 0 0",
    "v 1e38 1e38 1e38",
    "v nan nan nan",
    "v 0 0 0 0",
    "v 1 2 3 1 0 0",
    "vt 1e38 -1e38",
    "vn 0 0 0",
    "vn nan nan nan",
    "g a b c",
    "o",
    "l 1 2",
    "p 1",
    "cstype bezier",
    "illum 10",
    "illum -1",
    "Ns 1e30",
    "Ns nan",
    "Ni 0",
    "d -1",
    "d -halo 0.5",
    "Tr 2",
    "Kd spectral a.rfl 1",
    "Kd xyz 1 2 3",
    "Ke 1e30 1e30 1e30",
    "map_Kd -s 0 0 0 -o 1e30 1e30 -mm -1e30 1e30 wood.png",
    "map_Kd -clamp on -imfchan z -texres 1e9 -blendu off wood.png",
    "map_Kd -s",
    "map_d -imfchan m wood.png",
    "map_bump -bm 1e30 wood.png",
    "norm -bm -1e30 wood.png",
    "map_Pr -mm 0.5 nan wood.png",
    "element vertex 4294967295",
    "element face -1",
    "property list uchar int vertex_indices",
    "property list double double x",
    "property uchar red",
    "property float nx",
    "format binary_big_endian 1.0",
    "end_header",
];

/// The longest text that becomes longer.
const LONGEST: usize = 1 << 18;

pub fn damage(content: &mut Vec<u8>, random: &mut Random, names: &[String]) {
    let mut lines: Vec<Vec<u8>> = content.split(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
    let count = lines.len() as u32;
    let at = random.below(count) as usize;
    match random.below(9) {
        0 => drop(lines.remove(at)),
        1 => {
            // A crowd of them now and then
            let times = random.pick(&[1, 1, 2, 10, 300]).min(1 + LONGEST / (content.len() + lines[at].len() + 1));
            let line = lines[at].clone();
            lines.splice(at..at, std::iter::repeat_n(line, times));
        }
        2 => lines.swap(at, random.below(count) as usize),
        3 => lines.insert(at, random.pick(LINES).as_bytes().to_vec()),
        4 => bytes::damage(&mut lines[at], random),
        _ => lines[at] = of_words(&lines[at], random, names),
    }
    *content = lines.join(&b'\n');
}

/// A line with a word that is another one, missing, or there twice.
fn of_words(line: &[u8], random: &mut Random, names: &[String]) -> Vec<u8> {
    let mut words: Vec<Vec<u8>> = line.split(|byte| *byte == b' ').map(<[u8]>::to_vec).collect();
    let at = random.below(words.len() as u32) as usize;
    let is_reference = line.starts_with(b"mtllib") || line.starts_with(b"map_") || line.starts_with(b"norm");
    match random.below(6) {
        0 => drop(words.remove(at)),
        1 => words.insert(at, words[at].clone()),
        2 => words.insert(at, random.pick(WORDS).as_bytes().to_vec()),
        3 if is_reference => *words.last_mut().expect("no line has no part") = reference(random, names).into_bytes(),
        _ => words[at] = random.pick(WORDS).as_bytes().to_vec(),
    }
    words.join(&b' ')
}

/// Breaks a number somewhere in a text as no value of JSON could say it.
pub fn damage_number(content: &mut Vec<u8>, random: &mut Random) {
    let is_digit = |i: usize| content[i].is_ascii_digit();
    let starts: Vec<usize> = (0..content.len()).filter(|i| is_digit(*i) && (*i == 0 || !is_digit(i - 1))).collect();
    if starts.is_empty() {
        return;
    }
    let start = starts[random.below(starts.len() as u32) as usize];
    let length = content[start..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let words = ["NaN", "Infinity", "-1", "1e999", "-1e999", "0x10", "1.", "01", "1e", "18446744073709551616", "[[[["];
    content.splice(start..start + length, random.pick(&words).bytes());
}

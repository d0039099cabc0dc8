//! Damage to the JSON of glTF and GLB files.

use serde_json::{Value, json};

use super::{bytes, reference, text};
use crate::Random;

/// The longest JSON that becomes longer.
const LONGEST: usize = 1 << 17;

/// Keys whose values decide what is read from where; they are damaged more often than others.
const TELLING: &[&str] = &[
    "buffer",
    "bufferView",
    "byteLength",
    "byteOffset",
    "byteStride",
    "children",
    "componentType",
    "count",
    "index",
    "indices",
    "input",
    "inverseBindMatrices",
    "joints",
    "light",
    "material",
    "matrix",
    "mesh",
    "mode",
    "node",
    "nodes",
    "output",
    "POSITION",
    "rotation",
    "sampler",
    "scale",
    "skin",
    "source",
    "texCoord",
    "TEXCOORD_0",
    "translation",
    "TRANSLATION",
    "type",
    "uri",
    "weights",
];

/// The JSON text of a glTF file.
pub fn damage_text(content: &mut Vec<u8>, random: &mut Random, names: &[String]) {
    match serde_json::from_slice::<Value>(content) {
        Ok(mut value) => {
            damage(&mut value, random, names);
            *content = value.to_string().into_bytes();
            if random.chance(0.05) {
                text::damage_number(content, random);
            }
        }
        // An earlier damage
        Err(_) => bytes::damage(content, random),
    }
}

/// One of the chunks of a GLB file, or their headers.
pub fn damage_container(content: &mut Vec<u8>, random: &mut Random, names: &[String]) {
    let Some((json, mut rest)) = parts(content).filter(|_| random.chance(0.85)) else {
        return bytes::damage_header(content, random);
    };
    let mut json = json.to_vec();
    if random.chance(0.3) && rest.len() > 8 {
        let mut binary = rest.split_off(8);
        bytes::damage_numbers(&mut binary, random);
        binary.resize(binary.len().next_multiple_of(4), 0);
        rest[..4].copy_from_slice(&(binary.len() as u32).to_le_bytes());
        rest.extend(binary);
    } else {
        damage_text(&mut json, random, names);
    }
    *content = container(json, &rest);
}

/// The JSON of a GLB file, and all chunks behind it.
fn parts(content: &[u8]) -> Option<(&[u8], Vec<u8>)> {
    let length = content.get(12..16)?;
    let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize;
    let (json, rest) = content.get(20..)?.split_at_checked(length)?;
    Some((json, rest.to_vec()))
}

/// A GLB file of a JSON text and of the chunks behind it.
pub fn container(mut json: Vec<u8>, rest: &[u8]) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((20 + json.len() + rest.len()) as u32).to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    out.extend(rest);
    out
}

/// The pointers of all values below one, itself left out.
fn pointers(value: &Value, at: &str, all: &mut Vec<String>) {
    let mut below = |key: &str, value: &Value| {
        let pointer = format!("{at}/{}", key.replace('~', "~0").replace('/', "~1"));
        all.push(pointer.clone());
        pointers(value, &pointer, all);
    };
    match value {
        Value::Object(object) => object.iter().for_each(|(key, value)| below(key, value)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, value)| below(&i.to_string(), value)),
        _ => {}
    }
}

fn key_of(pointer: &str) -> &str {
    pointer.rsplit('/').next().unwrap_or_default()
}

/// One change somewhere.
fn damage(root: &mut Value, random: &mut Random, names: &[String]) {
    let mut all = Vec::new();
    pointers(root, "", &mut all);
    if all.is_empty() {
        return;
    }
    let telling: Vec<&String> = all.iter().filter(|pointer| TELLING.contains(&key_of(pointer))).collect();
    let pointer = match telling.len() {
        0 => &all[random.below(all.len() as u32) as usize],
        _ if random.chance(0.4) => &all[random.below(all.len() as u32) as usize],
        count => telling[random.below(count as u32) as usize],
    };
    let other = &all[random.below(all.len() as u32) as usize];
    let length = root.to_string().len();
    match random.below(12) {
        0 => remove(root, pointer),
        1 => {
            let graft = root.pointer(other).cloned().unwrap_or_default();
            put(root, pointer, graft);
        }
        2 => {
            let (a, b) = (root.pointer(pointer).cloned(), root.pointer(other).cloned());
            put(root, pointer, b.unwrap_or_default());
            put(root, other, a.unwrap_or_default());
        }
        3 => crowd(root, pointer, random, LONGEST.saturating_sub(length)),
        4 => forge(root, random),
        5 => circle(root, random),
        _ => {
            let old = root.pointer(pointer).cloned().unwrap_or_default();
            let new = telling_value(key_of(pointer), &old, random, names);
            put(root, pointer, new);
        }
    }
}

fn put(root: &mut Value, pointer: &str, new: Value) {
    if let Some(value) = root.pointer_mut(pointer) {
        *value = new;
    }
}

fn remove(root: &mut Value, pointer: &str) {
    let Some((above, key)) = pointer.rsplit_once('/') else { return };
    match root.pointer_mut(above) {
        Some(Value::Object(object)) => drop(object.shift_remove(&key.replace("~1", "/").replace("~0", "~"))),
        Some(Value::Array(list)) => drop(key.parse().ok().filter(|i| *i < list.len()).map(|i: usize| list.remove(i))),
        _ => {}
    }
}

/// Repeats an element of a list, up to some hundred times.
fn crowd(root: &mut Value, pointer: &str, random: &mut Random, room: usize) {
    // The list that the place is in, or is
    let mut at = pointer;
    while !at.is_empty() {
        if let Some(Value::Array(list)) = root.pointer_mut(at)
            && !list.is_empty()
        {
            let element = list[random.below(list.len() as u32) as usize].clone();
            let times = random.pick(&[1, 2, 20, 300]).min(room / element.to_string().len().max(1));
            list.extend(std::iter::repeat_n(element, times));
            return;
        }
        at = at.rsplit_once('/').map_or("", |(above, _)| above);
    }
}

/// An accessor that claims more than there is: by its count, without a buffer view, or with one whose elements lie on
/// top of each other.
fn forge(root: &mut Value, random: &mut Random) {
    let Some(accessors) = root.get_mut("accessors").and_then(Value::as_array_mut).filter(|list| !list.is_empty())
    else {
        return;
    };
    let index = random.below(accessors.len() as u32) as usize;
    let accessor = &mut accessors[index];
    if !accessor.is_object() {
        return;
    }
    // Few of the numbers are those that are slow to fill, and not refused
    let count = random.pick(&[0, 1, 3, 1000, 100_000, 1 << 32, 1 << 40, 1 << 53, u64::MAX]);
    let count = if random.chance(0.01) { 3_000_000 } else { count };
    accessor["count"] = count.into();
    match random.below(3) {
        0 => drop(accessor.as_object_mut().and_then(|accessor| accessor.shift_remove("bufferView"))),
        1 => {
            let view = accessor.get("bufferView").and_then(Value::as_u64).unwrap_or(0) as usize;
            if let Some(view @ Value::Object(_)) = root.get_mut("bufferViews").and_then(|views| views.get_mut(view)) {
                view["byteStride"] = 0.into();
            }
        }
        _ => {}
    }
}

/// A node below another one, or below itself.
fn circle(root: &mut Value, random: &mut Random) {
    let Some(nodes) = root.get_mut("nodes").and_then(Value::as_array_mut).filter(|list| !list.is_empty()) else {
        return;
    };
    let count = nodes.len() as u32;
    let child = random.below(count + 1);
    let node = &mut nodes[random.below(count) as usize];
    if node.is_object() {
        match node.get_mut("children") {
            Some(Value::Array(children)) => children.push(child.into()),
            _ => node["children"] = json!([child]),
        }
    }
}

/// Another value, of those that mean something at this key half the time.
fn telling_value(key: &str, old: &Value, random: &mut Random, names: &[String]) -> Value {
    if random.chance(0.5) {
        match key {
            "uri" => return reference(random, names).into(),
            "type" => {
                let types = ["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4", "vec3", "spot", "orthographic"];
                return random.pick(&types).into();
            }
            "componentType" => return random.pick(&[5120, 5121, 5122, 5123, 5124, 5125, 5126, 5130]).into(),
            "byteStride" => return random.pick(&[0, 1, 2, 3, 4, 252, 256, 1 << 31]).into(),
            "mode" => return random.below(8).into(),
            "path" => return random.pick(&["translation", "rotation", "scale", "weights", "pointer"]).into(),
            "interpolation" => return random.pick(&["STEP", "LINEAR", "CUBICSPLINE", "linear"]).into(),
            _ => {}
        }
    }
    if let Some(number) = old.as_f64().filter(|_| random.chance(0.5)) {
        return match random.below(8) {
            0 => json!(number + 1.0),
            1 => json!(number - 1.0),
            2 => json!(-number),
            3 => json!(number * 2.0),
            4 => json!(number * 1e30),
            5 => json!(number + 0.5),
            // As whole numbers
            6 => (number as i64).saturating_add(1).into(),
            _ => (number as i64).saturating_sub(1).into(),
        };
    }
    hostile(random)
}

/// A value that is seldom right.
fn hostile(random: &mut Random) -> Value {
    match random.below(24) {
        0 => Value::Null,
        1 => true.into(),
        2 => json!([]),
        3 => json!({}),
        4 => json!([[[[0]]]]),
        5 => json!({ "extensions": { "KHR_texture_transform": { "offset": [1e308, -1e308] } } }),
        6 => "".into(),
        7 => "NaN".into(),
        8 => "\u{0}\u{1b}[31m\u{202e}".into(),
        9 => "x".repeat(3000).into(),
        10 => random.pick(&[1e308, -1e308, 1e39, -1e39, 1e-308, 5e-324, 1e20, 1e9]).into(),
        11 => random.pick(&[u64::MAX, 1 << 63, 1 << 53, 1 << 32, u64::from(u32::MAX), 1 << 31]).into(),
        12 => random.pick(&[-1, i64::MIN, -1 << 31]).into(),
        13 => json!([1e308, 1e308, 1e308]),
        14 => json!([0, 0, 0]),
        15 => json!([0, 0, 0, 0]),
        16 => json!([1e20, -1e20, 1e20, 1]),
        17 => json!([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]),
        18 => random.between(-2.0, 2.0).into(),
        19 => random.pick(&[255, 256, 65535, 65536, 9728, 9729, 10497, 33071, 33648]).into(),
        _ => random.below(12).into(),
    }
}

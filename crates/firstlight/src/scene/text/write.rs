//! From a description to text: what reads back to an equal one.

use crate::describe::Family;
use crate::describe::write::{json_string, key};
use crate::describe::{Table, TextValue};
use crate::scene::description::SceneDesc;

type WrittenFields = Vec<(&'static str, TextValue)>;

impl SceneDesc {
    /// The description as TOML. It reads back to an equal one, its lists in scene order (see [`SceneDesc::sort`]);
    /// fields that have their default are left out.
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        let mut table = |header: String, fields: WrittenFields| {
            if !out.is_empty() {
                out.push('\n');
            }
            out.push_str(&header);
            out.push('\n');
            for (name, value) in fields {
                out.push_str(&format!("{name} = {}\n", value.to_toml()));
            }
        };
        let render = self.render.write();
        if !render.is_empty() {
            table("[render]".into(), render);
        }
        let alone = self.has_nameless_camera();
        for (name, camera) in &self.cameras {
            table(if alone { "[camera]".into() } else { format!("[camera.{}]", key(name)) }, camera.write());
        }
        for (name, texture) in in_order(&self.textures, |(_, t)| t.kind_index()) {
            table(format!("[texture.{}.{}]", kind_name(texture), key(name)), texture.write());
        }
        for (name, material) in in_order(&self.materials, |(_, m)| m.kind_index()) {
            table(format!("[material.{}.{}]", kind_name(material), key(name)), material.write());
        }
        for shape in in_order(&self.shapes, Family::kind_index) {
            table(format!("[[{}]]", kind_name(shape)), shape.write());
        }
        for (name, group) in &self.groups {
            let name = key(name);
            if group.shapes.is_empty() {
                table(format!("[group.{name}]"), Vec::new());
            }
            for shape in in_order(&group.shapes, Family::kind_index) {
                table(format!("[[group.{name}.{}]]", kind_name(shape)), shape.write());
            }
        }
        for light in in_order(&self.lights, Family::kind_index) {
            table(format!("[[light.{}]]", kind_name(light)), light.write());
        }
        if out.is_empty() {
            // A file without anything in it is no scene
            out.push_str("# A scene without anything in it\n");
        }
        out
    }

    /// The description as JSON, as [`SceneDesc::to_toml`]. Numbers that are not finite, with which no scene compiles,
    /// have no words in JSON: they become `null`, which reading refuses.
    pub fn to_json(&self) -> String {
        let mut top: Vec<(String, String)> = Vec::new();
        let render = self.render.write();
        if !render.is_empty() {
            top.push(("render".into(), object(&render, 1)));
        }
        if self.has_nameless_camera() {
            top.extend(self.cameras.iter().map(|(_, camera)| ("camera".into(), object(&camera.write(), 1))));
        } else if !self.cameras.is_empty() {
            let cameras = self.cameras.iter().map(|(name, camera)| (name.clone(), object(&camera.write(), 2)));
            top.push(("camera".into(), braces(&cameras.collect::<Vec<_>>(), 1)));
        }
        top.extend(named("texture", &self.textures));
        top.extend(named("material", &self.materials));
        top.extend(arrays(&self.shapes, 1));
        if !self.groups.is_empty() {
            let groups = self.groups.iter().map(|(name, group)| (name.clone(), braces(&arrays(&group.shapes, 3), 2)));
            top.push(("group".into(), braces(&groups.collect::<Vec<_>>(), 1)));
        }
        let lights = arrays(&self.lights, 2);
        if !lights.is_empty() {
            top.push(("light".into(), braces(&lights, 1)));
        }
        braces(&top, 0) + "\n"
    }

    /// Whether `[camera]` says its only camera.
    fn has_nameless_camera(&self) -> bool {
        matches!(self.cameras.as_slice(), [(name, _)] if name.is_empty())
    }
}

fn kind_name<F: Family>(desc: &F) -> &'static str {
    F::KINDS[desc.kind_index()]
}

/// References, by kind, each kind in the order it has.
fn in_order<T>(list: &[T], kind: impl Fn(&T) -> usize) -> Vec<&T> {
    let mut sorted: Vec<&T> = list.iter().collect();
    sorted.sort_by_key(|item| kind(item));
    sorted
}

/// Lines of `"key": value` in braces; `depth` is that of the braces.
fn braces(pairs: &[(String, String)], depth: usize) -> String {
    if pairs.is_empty() {
        return "{}".into();
    }
    let indent = "  ".repeat(depth + 1);
    let lines: Vec<String> = pairs.iter().map(|(k, v)| format!("{indent}{}: {v}", json_string(k))).collect();
    format!("{{\n{}\n{}}}", lines.join(",\n"), "  ".repeat(depth))
}

fn object(fields: &WrittenFields, depth: usize) -> String {
    let pairs: Vec<(String, String)> = fields.iter().map(|(k, v)| ((*k).to_owned(), v.to_json())).collect();
    braces(&pairs, depth)
}

/// `"material": { "phong": { "NAME": { ... } } }`, nothing if there is none.
fn named<F: Family>(word: &str, list: &[(String, F)]) -> Option<(String, String)> {
    let kinds: Vec<(String, String)> = F::KINDS
        .iter()
        .enumerate()
        .filter_map(|(kind, name)| {
            let of_kind = list.iter().filter(|(_, desc)| desc.kind_index() == kind);
            let pairs: Vec<_> = of_kind.map(|(n, desc)| (n.clone(), object(&desc.write(), 3))).collect();
            (!pairs.is_empty()).then(|| ((*name).to_owned(), braces(&pairs, 2)))
        })
        .collect();
    (!kinds.is_empty()).then(|| (word.to_owned(), braces(&kinds, 1)))
}

/// `"sphere": [{ ... }, { ... }]` for each kind there is; `depth` is that of the key.
fn arrays<F: Family>(list: &[F], depth: usize) -> Vec<(String, String)> {
    let indent = "  ".repeat(depth);
    let kinds = F::KINDS.iter().enumerate().filter_map(|(kind, name)| {
        let of_kind = list.iter().filter(|desc| desc.kind_index() == kind);
        let objects: Vec<String> =
            of_kind.map(|desc| format!("{indent}  {}", object(&desc.write(), depth + 1))).collect();
        (!objects.is_empty()).then(|| ((*name).to_owned(), format!("[\n{}\n{indent}]", objects.join(",\n"))))
    });
    kinds.collect()
}

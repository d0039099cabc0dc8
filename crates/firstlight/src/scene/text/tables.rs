//! The tables of a scene's text that hold others: arrays, groups, kinds, things with names, cameras.

use std::collections::HashMap;

use crate::camera::CameraDesc;
use crate::describe::node::{self, Data, Node, Span, Syntax, quoted};
use crate::describe::read::Reader;
use crate::describe::synonyms::did_you_mean;
use crate::describe::write::key;
use crate::describe::{Family, Table};
use crate::light::LightDesc;
use crate::shape::{GroupDesc, ShapeDesc};

/// The arrays of tables of one text, whose elements count on from those of the texts before.
pub(super) struct Arrays<'a> {
    /// How many there are of each so far.
    pub counts: &'a mut HashMap<String, usize>,
    /// With how many each began in this text.
    pub bases: Vec<(String, usize)>,
    pub syntax: Syntax,
}

impl Arrays<'_> {
    /// Reads the array `key` at `path`, each element by `read`.
    pub fn read(
        &mut self,
        reader: &mut Reader<'_>,
        path: &str,
        key: &str,
        node: &Node,
        mut read: impl FnMut(&mut Reader<'_>, &Node),
    ) {
        let count = self.counts.entry(path.to_owned()).or_insert(0);
        self.bases.push((path.to_owned(), *count));
        if node.len().is_none() {
            let hint = match self.syntax {
                Syntax::Toml => format!("write [[{path}]] for each {key}"),
                Syntax::Json => format!("write \"{key}\": [{{ ... }}], one object for each"),
            };
            reader.wrong_type(node, "an array of tables", Some(hint));
            reader.poison();
            // One by itself is read for its faults
            if node.entries().is_some() {
                reader.at(*count, |r| read(r, node));
            }
            return;
        }
        node.each(reader.text(), |_, element| {
            reader.at(*count, |r| read(r, element));
            *count += 1;
        });
    }
}

/// Reads `[group.NAME]`: tables of arrays of shapes.
pub(super) fn read_groups(
    reader: &mut Reader<'_>,
    file: usize,
    node: &Node,
    arrays: &mut Arrays<'_>,
    names: &mut HashMap<(&'static str, String), (usize, Span)>,
    groups: &mut Vec<(String, GroupDesc)>,
    incomplete: &mut bool,
) {
    let Some(entries) = node.entries() else {
        let hint = "write [[group.NAME.KIND]] for each shape of a group";
        reader.wrong_type(node, "a table of groups by name", Some(hint.into()));
        reader.poison();
        *incomplete = true;
        return;
    };
    for entry in entries {
        let name = &entry.key;
        reader.within(name, |r| {
            let span = entry.value.span;
            if let Some(other) = names.get(&("group", name.to_string())) {
                let message = format!("the name {} is taken", quoted(name));
                r.conflict(span, message, Some("each group is described in one place".into()), Some(*other));
                return;
            }
            names.insert(("group", name.to_string()), (file, span));
            let mut group = GroupDesc::default();
            match entry.value.entries() {
                None => {
                    let hint = format!("write [[group.{}.KIND]] for each shape of the group", key(name));
                    r.wrong_type(&entry.value, "a table of shapes by kind", Some(hint));
                    r.poison();
                }
                Some(kinds) => {
                    for of_kind in kinds {
                        let kind = ShapeDesc::KINDS.iter().position(|k| *k == &*of_kind.key);
                        r.within(&of_kind.key, |r| match kind {
                            Some(kind) => {
                                let path = format!("group.{}.{}", key(name), of_kind.key);
                                arrays.read(r, &path, &of_kind.key, &of_kind.value, |r, node| {
                                    group.shapes.push(ShapeDesc::read(kind, node, r));
                                });
                            }
                            None => {
                                let near = did_you_mean(&of_kind.key, ShapeDesc::KINDS);
                                let hint = format!("{near}a group takes {}", ShapeDesc::KINDS.join(", "));
                                r.error(of_kind.key_span, "unknown key", Some(hint));
                            }
                        });
                    }
                }
            }
            groups.push((name.to_string(), group));
        });
    }
}

/// The kinds in `[light]`, `[material]` or `[texture]`; `None` for one that is unknown, of named things only.
pub(super) fn kinds<'n, F: Family>(
    reader: &mut Reader<'_>,
    node: &'n Node,
    incomplete: &mut bool,
) -> Vec<(Option<usize>, &'n str, &'n Node)> {
    let Some(entries) = node.entries() else {
        reader.wrong_type(node, &format!("a table of the kinds of {}", F::WORD), None);
        reader.poison();
        *incomplete = true;
        return Vec::new();
    };
    let mut kinds = Vec::new();
    for entry in entries {
        let kind = F::KINDS.iter().position(|k| *k == &*entry.key);
        if kind.is_none() {
            let near = did_you_mean(&entry.key, F::KINDS);
            let hint = format!("{near}kinds of {} are {}", F::WORD, F::KINDS.join(", "));
            let message = format!("unknown kind of {}", F::WORD);
            reader.within(&node::shortened(&entry.key), |r| r.error(entry.key_span, message, Some(hint)));
        }
        if kind.is_some() || F::WORD != LightDesc::WORD {
            kinds.push((kind, &*entry.key, &entry.value));
        }
    }
    kinds
}

/// Reads `[material.KIND.NAME]` or `[texture.KIND.NAME]`.
pub(super) fn named<F: Family>(
    reader: &mut Reader<'_>,
    file: usize,
    node: &Node,
    names: &mut HashMap<(&'static str, String), (usize, Span)>,
    list: &mut Vec<(String, F)>,
    incomplete: &mut bool,
) {
    for (kind, kind_name, node) in kinds::<F>(reader, node, incomplete) {
        reader.within(kind_name, |r| {
            let Some(entries) = node.entries() else {
                let hint = format!("write [{}.{kind_name}.NAME]", F::WORD);
                // Of an unknown kind enough has been said
                if kind.is_some() {
                    r.wrong_type(node, &format!("a table of names, each with its {}", F::WORD), Some(hint));
                }
                r.poison();
                *incomplete = true;
                return;
            };
            for entry in entries {
                r.within(&entry.key, |r| {
                    let span = entry.value.span;
                    if let Some(other) = names.get(&(F::WORD, entry.key.to_string())) {
                        let message = format!("the name {} is taken", quoted(&entry.key));
                        let hint = format!("names are unique among all kinds of {}", F::WORD);
                        r.conflict(span, message, Some(hint), Some(*other));
                        return;
                    }
                    names.insert((F::WORD, entry.key.to_string()), (file, span));
                    match kind {
                        Some(kind) => {
                            // `diffuse = 1` directly in [material.phong]: a name was forgotten
                            if entry.value.entries().is_none() {
                                let hint = format!("write [{}.{kind_name}.NAME] with a name", F::WORD);
                                r.wrong_type(&entry.value, "a table", Some(hint));
                                r.poison();
                                return;
                            }
                            list.push((entry.key.to_string(), F::read(kind, &entry.value, r)));
                        }
                        // Those who use the name shall find something
                        None => {
                            r.poison();
                            list.push((entry.key.to_string(), F::read(0, &Node::empty(), r)));
                        }
                    }
                });
            }
        });
    }
}

/// Reads `[camera]`, or `[camera.NAME]`: a table with nothing but tables in it.
pub(super) fn cameras(
    reader: &mut Reader<'_>,
    file: usize,
    node: &mut Node,
    names: &mut HashMap<(&'static str, String), (usize, Span)>,
    list: &mut Vec<(String, CameraDesc)>,
) {
    let is_table = |node: &Node| matches!(node.data, Data::Table(_));
    let mut add = |r: &mut Reader<'_>, name: &str, node: &Node| {
        if let Some(other) = names.get(&("camera", name.to_owned())) {
            let message = match name {
                "" => "there is a camera without a name already".to_owned(),
                name => format!("the name {} is taken", quoted(name)),
            };
            r.conflict(node.span, message, Some("give each camera its own name".into()), Some(*other));
            return;
        }
        names.insert(("camera", name.to_owned()), (file, node.span));
        list.push((name.to_owned(), r.table::<CameraDesc>(node, "a camera")));
    };
    let several = node.entries().is_some_and(|e| !e.is_empty() && e.iter().all(|e| is_table(&e.value)));
    if several {
        for entry in node.entries().unwrap_or_default() {
            reader.within(&entry.key, |r| add(r, &entry.key, &entry.value));
        }
        return;
    }
    // Tables among values: two ways of saying cameras in one, but for those that a camera has of its own
    if let Data::Table(entries) = &mut node.data {
        let own = |entry: &node::Entry| {
            CameraDesc::info().iter().any(|field| field.name == &*entry.key && !field.tables.is_empty())
        };
        entries.retain(|entry| {
            if is_table(&entry.value) && own(entry) {
                return true;
            }
            if is_table(&entry.value) {
                let hint = "give the camera without a name one, as [camera.NAME]";
                reader.within(&entry.key, |r| {
                    r.error(entry.value.span, "a camera with a name beside one without", Some(hint.into()));
                    r.poison();
                });
            }
            !is_table(&entry.value)
        });
    }
    add(reader, "", node);
}

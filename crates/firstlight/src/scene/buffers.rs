//! What a scene asks for of each pixel: names of buffers become planes, lights and groups of lights.

use super::{Scene, SceneDesc};
use crate::context::CompileContext;
use crate::describe::node::quoted;
use crate::ids::{LightGroupId, LightId};
use crate::image::{Buffer, BufferDesc, LightChoice};
use crate::light::LightDesc;

/// Lights, or groups of them, that names of buffers choose from.
struct Chosen<'a> {
    /// What one of them is called in messages, and many.
    kinds: [&'a str; 2],
    /// What the names of its buffers begin with.
    prefix: &'a str,
    names: &'a [Option<String>],
}

/// So many lights are at most kept apart where all of them are asked for.
const MAX_APART: usize = 1000;

impl SceneDesc {
    /// The groups of its lights, by name, in the order of their first lights.
    pub(super) fn light_groups(&self) -> Vec<(String, Vec<u32>)> {
        let mut groups: Vec<(String, Vec<u32>)> = Vec::new();
        for (number, light) in (0..).zip(LightDesc::in_scene_order(&self.lights)) {
            let Some(group) = light.group() else { continue };
            match groups.iter_mut().find(|(name, _)| name == group) {
                Some((_, lights)) => lights.push(number),
                None => groups.push((group.to_owned(), vec![number])),
            }
        }
        groups
    }

    /// What `[render] buffers` asks for.
    pub(super) fn compile_buffers(&self, cx: &mut CompileContext, groups: &[(String, Vec<u32>)]) -> Vec<Buffer> {
        let names: Vec<Option<String>> = LightDesc::in_scene_order(&self.lights).map(LightDesc::name).collect();
        let groups: Vec<Option<String>> = groups.iter().map(|(name, _)| Some(name.clone())).collect();
        let of_lights = Chosen { kinds: ["light", "lights"], prefix: "light", names: &names };
        let of_groups = Chosen { kinds: ["group of lights", "groups of lights"], prefix: "group", names: &groups };
        let mut all = Vec::new();
        for (i, desc) in self.render.buffers.iter().enumerate() {
            let path = format!("render.buffers[{i}]");
            let found: Vec<Buffer> = match desc {
                BufferDesc::Plane(plane) => {
                    if plane.is_of_motion() && self.render.motion_to.is_none() {
                        let hint = "write motion_to = a time in seconds, \"next\", \"previous\" or the name of a \
                                    camera, as --motion-to does";
                        cx.error(
                            &path,
                            format!("{} leads nowhere without motion_to", quoted(plane.name())),
                            Some(hint),
                        );
                    }
                    vec![(*plane).into()]
                }
                BufferDesc::Light { light, part } => {
                    if *light == LightChoice::All && names.len() > MAX_APART {
                        let message = format!("all {} lights, each apart, are more than {MAX_APART}", names.len());
                        cx.error(&path, message, Some("name those that count, or give lights a group"));
                        continue;
                    }
                    let lights = of_lights.choose(cx, &path, light);
                    lights.into_iter().map(|light| Buffer::Light(LightId(light as u32), *part)).collect()
                }
                BufferDesc::Group { group, part } => {
                    let groups = of_groups.choose(cx, &path, group);
                    groups.into_iter().map(|group| Buffer::Group(LightGroupId(group as u32), *part)).collect()
                }
            };
            for buffer in found {
                if all.contains(&buffer) {
                    let message = format!("{} is given twice", quoted(&name_of(buffer, &names, &groups)));
                    cx.error(&path, message, Some("name each once; the picture is \"color\""));
                } else {
                    all.push(buffer);
                }
            }
        }
        if self.render.buffers.is_empty() {
            let hint = "name at least one, or leave it out for the picture alone";
            cx.error("render.buffers", "an empty list asks for nothing", Some(hint));
        }
        all
    }
}

impl Chosen<'_> {
    /// The numbers of those that are meant, from 0; none after a fault.
    fn choose(&self, cx: &mut CompileContext, path: &str, choice: &LightChoice) -> Vec<usize> {
        let Chosen { kinds: [kind, kinds], prefix, names } = self;
        match choice {
            LightChoice::All => (0..names.len()).collect(),
            LightChoice::Number(number) if (*number as usize) <= names.len() => vec![*number as usize - 1],
            LightChoice::Number(number) => {
                cx.error(path, format!("there is no {kind} #{number}: the scene has {}", names.len()), None);
                Vec::new()
            }
            LightChoice::Name(name) => {
                let called = |of: &usize| names[*of].as_ref() == Some(name);
                let same: Vec<usize> = (0..names.len()).filter(called).collect();
                match same.len() {
                    1 => return same,
                    0 => {
                        let known: Vec<&str> = names.iter().flatten().map(String::as_str).collect();
                        cx.unknown(path, kind, name, &known);
                    }
                    count => {
                        let message = format!("{count} {kinds} are called {}", quoted(name));
                        let numbers: Vec<String> = same.iter().map(|of| format!("{prefix}:#{}", of + 1)).collect();
                        cx.error(path, message, Some(&format!("they are {}; or rename them", numbers.join(", "))));
                    }
                }
                Vec::new()
            }
        }
    }
}

/// The name of a buffer, which no other has, and which can stand in any file: an archive says letters
/// beyond ASCII in ways that readers do not agree on. `lights` and `groups` are the names of those.
fn name_of(buffer: Buffer, lights: &[Option<String>], groups: &[Option<String>]) -> String {
    let choice = |number: usize, names: &[Option<String>]| {
        let own = names.get(number).and_then(Option::as_ref).filter(|name| {
            let is_alone = names.iter().flatten().filter(|other| other == name).count() == 1;
            is_alone && !name.is_empty() && name.chars().all(|c| matches!(c, ' '..='~') && !matches!(c, '/' | '\\'))
        });
        match own {
            Some(name) => LightChoice::Name(name.clone()),
            None => LightChoice::Number(number as u32 + 1),
        }
    };
    let desc = match buffer {
        Buffer::Plane(plane) => BufferDesc::Plane(plane),
        Buffer::Light(light, part) => BufferDesc::Light { light: choice(light.index(), lights), part },
        Buffer::Group(group, part) => BufferDesc::Group { group: choice(group.index(), groups), part },
    };
    desc.name()
}

impl Scene {
    /// What `[render] buffers` asks for, each light by itself.
    pub fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    /// The name of a buffer in files: that of the plane; `light:NAME` or, of a light without a name of its own,
    /// `light:#3`, with the part after it; and so for groups of lights.
    pub fn buffer_name(&self, buffer: Buffer) -> String {
        name_of(buffer, &self.light_names(), &self.group_names())
    }

    /// The names of the lights, in scene order.
    pub(crate) fn light_names(&self) -> Vec<Option<String>> {
        self.summary.lights.iter().map(|(_, name, _)| name.clone()).collect()
    }

    /// The names of their groups.
    pub(crate) fn group_names(&self) -> Vec<Option<String>> {
        self.light_groups.iter().map(|(name, _)| Some(name.clone())).collect()
    }

    /// The lights that a buffer is of, in scene order; none of a plane.
    pub(crate) fn lights_of(&self, buffer: Buffer) -> Vec<u32> {
        match buffer {
            Buffer::Plane(_) => Vec::new(),
            Buffer::Light(light, _) => vec![light.0],
            Buffer::Group(group, _) => self.light_groups[group.index()].1.clone(),
        }
    }

    /// What is wrong with a list of buffers.
    pub(crate) fn fault_of(&self, buffers: &[Buffer]) -> Option<String> {
        if buffers.is_empty() {
            return Some("an empty list asks for nothing".into());
        }
        let unknown = |buffer: &Buffer| match buffer {
            Buffer::Light(light, _) => (light.index() >= self.lights.len())
                .then(|| format!("there is no light #{}: the scene has {}", light.0 + 1, self.lights.len())),
            Buffer::Group(group, _) => (group.index() >= self.light_groups.len()).then(|| {
                format!("there is no group of lights #{}: the scene has {}", group.0 + 1, self.light_groups.len())
            }),
            Buffer::Plane(plane) => (plane.is_of_motion() && self.motion.is_none()).then(|| {
                format!("{} leads nowhere: [render] motion_to of the scene says whereto", quoted(plane.name()))
            }),
        };
        let twice = || {
            let twice = buffers.iter().enumerate().find(|(i, buffer)| buffers[..*i].contains(buffer));
            twice.map(|(_, buffer)| format!("{} is given twice", quoted(&self.buffer_name(*buffer))))
        };
        buffers.iter().find_map(unknown).or_else(twice)
    }
}

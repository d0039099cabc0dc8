//! What a scene asks for of each pixel: names of buffers become planes and lights.

use super::{Scene, SceneDesc};
use crate::context::CompileContext;
use crate::describe::node::quoted;
use crate::ids::LightId;
use crate::image::{Buffer, BufferDesc, LightChoice};
use crate::light::LightDesc;

impl SceneDesc {
    /// What `[render] buffers` asks for.
    pub(super) fn compile_buffers(&self, cx: &mut CompileContext) -> Vec<Buffer> {
        let names: Vec<Option<String>> = LightDesc::in_scene_order(&self.lights).map(LightDesc::name).collect();
        let mut all = Vec::new();
        for (i, desc) in self.render.buffers.iter().enumerate() {
            let path = format!("render.buffers[{i}]");
            let found: Vec<Buffer> = match desc {
                BufferDesc::Plane(plane) => vec![(*plane).into()],
                BufferDesc::Light { light, part } => {
                    let lights = choose(cx, &path, &names, light);
                    lights.into_iter().map(|light| Buffer::Light(LightId(light as u32), *part)).collect()
                }
            };
            for buffer in found {
                if all.contains(&buffer) {
                    let message = format!("{} is given twice", quoted(&name_of(buffer, &names)));
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

/// The numbers of the lights that are meant, from 0; none after a fault.
fn choose(cx: &mut CompileContext, path: &str, names: &[Option<String>], choice: &LightChoice) -> Vec<usize> {
    match choice {
        LightChoice::All => (0..names.len()).collect(),
        LightChoice::Number(number) if (*number as usize) <= names.len() => vec![*number as usize - 1],
        LightChoice::Number(number) => {
            cx.error(path, format!("there is no light #{number}: the scene has {}", names.len()), None);
            Vec::new()
        }
        LightChoice::Name(name) => {
            let called = |light: &usize| names[*light].as_ref() == Some(name);
            let same: Vec<usize> = (0..names.len()).filter(called).collect();
            match same.len() {
                1 => return same,
                0 => {
                    let known: Vec<&str> = names.iter().flatten().map(String::as_str).collect();
                    cx.unknown(path, "light", name, &known);
                }
                count => {
                    let message = format!("{count} lights are called {}", quoted(name));
                    let numbers: Vec<String> = same.iter().map(|light| format!("light:#{}", light + 1)).collect();
                    cx.error(path, message, Some(&format!("they are {}; or rename them", numbers.join(", "))));
                }
            }
            Vec::new()
        }
    }
}

/// The name of a buffer, which no other has, and which can stand in any file: an archive says letters
/// beyond ASCII in ways that readers do not agree on. `names` are those of the lights.
fn name_of(buffer: Buffer, names: &[Option<String>]) -> String {
    let (light, part) = match buffer {
        Buffer::Plane(plane) => return plane.name().to_owned(),
        Buffer::Light(light, part) => (light.index(), part),
    };
    let own = names.get(light).and_then(Option::as_ref).filter(|name| {
        let is_alone = names.iter().flatten().filter(|other| other == name).count() == 1;
        is_alone && !name.is_empty() && name.chars().all(|c| matches!(c, ' '..='~') && !matches!(c, '/' | '\\'))
    });
    let choice = match own {
        Some(name) => LightChoice::Name(name.clone()),
        None => LightChoice::Number(light as u32 + 1),
    };
    BufferDesc::Light { light: choice, part }.name()
}

impl Scene {
    /// What `[render] buffers` asks for, each light by itself.
    pub fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    /// The name of a buffer in files: that of the plane; `light:NAME` or, of a light without a name of its own,
    /// `light:#3`, with the part after it.
    pub fn buffer_name(&self, buffer: Buffer) -> String {
        name_of(buffer, &self.light_names())
    }

    /// The names of the lights, in scene order.
    pub(crate) fn light_names(&self) -> Vec<Option<String>> {
        self.summary.lights.iter().map(|(_, name, _)| name.clone()).collect()
    }

    /// What is wrong with a list of buffers.
    pub(crate) fn fault_of(&self, buffers: &[Buffer]) -> Option<String> {
        if buffers.is_empty() {
            return Some("an empty list asks for nothing".into());
        }
        let unknown =
            |buffer: &&Buffer| matches!(buffer, Buffer::Light(light, _) if light.index() >= self.lights.len());
        if let Some(Buffer::Light(light, _)) = buffers.iter().find(unknown) {
            return Some(format!("there is no light #{}: the scene has {}", light.index() + 1, self.lights.len()));
        }
        let twice = buffers.iter().enumerate().find(|(i, buffer)| buffers[..*i].contains(buffer));
        twice.map(|(_, buffer)| format!("{} is given twice", quoted(&self.buffer_name(*buffer))))
    }
}

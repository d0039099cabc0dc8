//! What a scene asks for of each pixel: names of buffers become planes, lights, groups of lights and objects.

use super::geometry::Geometry;
use super::{Scene, SceneDesc};
use crate::context::CompileContext;
use crate::describe::node::quoted;
use crate::error::Diagnostic;
use crate::ids::{LightGroupId, LightId, SurfaceId};
use crate::image::cryptomatte::Named;
use crate::image::{Buffer, BufferDesc, LightChoice, LightPart, Plane};
use crate::light::{Light, LightDesc};

/// The names of what has buffers of its own.
#[derive(Default)]
struct Names<'a> {
    lights: Vec<Option<&'a str>>,
    groups: Vec<Option<&'a str>>,
    objects: Vec<Option<&'a str>>,
}

/// Lights, groups of them, or objects, that names of buffers choose from.
struct Chosen<'a> {
    /// What one of them is called in messages, and many.
    kinds: [&'a str; 2],
    /// What the names of its buffers begin with.
    prefix: &'a str,
    names: &'a [Option<&'a str>],
}

/// Of many things of one name so many are said.
const SAID: usize = 8;

/// So many lights, or objects, are at most kept apart where all of them are asked for.
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
    pub(super) fn compile_buffers(
        &self,
        cx: &mut CompileContext,
        groups: &[(String, Vec<u32>)],
        geometry: Option<&Geometry>,
        lights: &[Light],
    ) -> Vec<Buffer> {
        let light_names: Vec<Option<String>> = LightDesc::in_scene_order(&self.lights).map(LightDesc::name).collect();
        let mut names = Names {
            lights: light_names.iter().map(Option::as_deref).collect(),
            groups: groups.iter().map(|(name, _)| Some(name.as_str())).collect(),
            objects: Vec::new(),
        };
        if self.render.buffers.iter().any(|desc| matches!(desc, BufferDesc::Coverage(_) | BufferDesc::Relight)) {
            // Without a geometry there is a fault already
            let Some(geometry) = geometry else { return Vec::new() };
            names.objects = geometry.surface_names().chain(names.lights.iter().copied()).collect();
        }
        let mut all = Vec::new();
        // What else is asked for may be among what a picture is lit again from
        let is_relight = |desc: &BufferDesc| *desc == BufferDesc::Relight;
        let (last, first): (Vec<_>, Vec<_>) =
            self.render.buffers.iter().enumerate().partition(|(_, desc)| is_relight(desc));
        for (i, desc) in first.into_iter().chain(last) {
            let path = format!("render.buffers[{i}]");
            if let BufferDesc::Plane(plane) = desc
                && plane.is_of_motion()
                && self.render.motion_to.is_none()
            {
                let hint = "write motion_to = a time in seconds, \"next\", \"previous\" or the name of a camera, as \
                            --motion-to does";
                cx.error(&path, format!("{} leads nowhere without motion_to", quoted(plane.name())), Some(hint));
            }
            for buffer in names
                .meant(cx, &path, desc, |object| geometry.is_some_and(|geometry| is_seen(object, geometry, lights)))
            {
                if all.contains(&buffer) && is_relight(desc) {
                    continue;
                }
                if all.contains(&buffer) {
                    let message = format!("{} is given twice", quoted(&names.of(buffer)));
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

/// Whether a camera can see an object.
fn is_seen(object: usize, geometry: &Geometry, lights: &[Light]) -> bool {
    match object.checked_sub(geometry.surfaces.len()) {
        None => geometry.surfaces[object].visible,
        Some(light) => lights.get(light).and_then(Light::area).is_some_and(|area| area.visible),
    }
}

impl Chosen<'_> {
    /// The numbers of those that are meant, from 0; none after a fault.
    fn choose(&self, cx: &mut CompileContext, path: &str, choice: &LightChoice) -> Vec<usize> {
        let Chosen { kinds: [kind, kinds], prefix, names } = self;
        match choice {
            LightChoice::All => (0..names.len()).collect(),
            LightChoice::Number(number) if (1..=names.len()).contains(&(*number as usize)) => {
                vec![*number as usize - 1]
            }
            LightChoice::Number(number) => {
                cx.error(path, format!("there is no {kind} #{number}: the scene has {}", names.len()), None);
                Vec::new()
            }
            LightChoice::Name(name) => {
                let called = |of: &usize| names[*of] == Some(name);
                let same: Vec<usize> = (0..names.len()).filter(called).collect();
                match same.len() {
                    1 => return same,
                    0 => {
                        let known: Vec<&str> = names.iter().flatten().copied().collect();
                        cx.unknown(path, kind, name, &known);
                    }
                    count => {
                        let message = format!("{count} {kinds} are called {}", quoted(name));
                        let numbers = same.iter().take(SAID).map(|of| format!("{prefix}:#{}", of + 1));
                        let more = if count > SAID { ", ..." } else { "" };
                        let numbers = numbers.collect::<Vec<_>>().join(", ") + more;
                        cx.error(path, message, Some(&format!("they are {numbers}; or rename them")));
                    }
                }
                Vec::new()
            }
        }
    }
}

impl Names<'_> {
    /// The buffers that a description means; none after a fault. `is_seen` says which objects a camera can see.
    fn meant(
        &self,
        cx: &mut CompileContext,
        path: &str,
        desc: &BufferDesc,
        is_seen: impl Fn(usize) -> bool,
    ) -> Vec<Buffer> {
        let of_lights = Chosen { kinds: ["light", "lights"], prefix: "light", names: &self.lights };
        let of_groups = Chosen { kinds: ["group of lights", "groups of lights"], prefix: "group", names: &self.groups };
        let of_objects = Chosen { kinds: ["object", "objects"], prefix: "coverage", names: &self.objects };
        match desc {
            BufferDesc::Plane(plane) => vec![(*plane).into()],
            BufferDesc::Light { light: LightChoice::All, .. } | BufferDesc::Relight
                if self.lights.len() > MAX_APART =>
            {
                let message = format!("all {} lights, each apart, are more than {MAX_APART}", self.lights.len());
                cx.error(path, message, Some("name those that count, or give lights a group"));
                Vec::new()
            }
            BufferDesc::Light { light, part } => {
                let lights = of_lights.choose(cx, path, light);
                lights.into_iter().map(|light| Buffer::Light(LightId(light as u32), *part)).collect()
            }
            BufferDesc::Group { group, part } => {
                let groups = of_groups.choose(cx, path, group);
                groups.into_iter().map(|group| Buffer::Group(LightGroupId(group as u32), *part)).collect()
            }
            BufferDesc::Relight => self.of_relight(is_seen),
            BufferDesc::Coverage(object) => {
                let mut objects = of_objects.choose(cx, path, object);
                if *object == LightChoice::All {
                    objects.retain(|object| is_seen(*object));
                }
                if objects.len() > MAX_APART {
                    let message = format!("all {} objects, each apart, are more than {MAX_APART}", objects.len());
                    cx.error(path, message, Some("name those that count, or ask for crypto-object"));
                    return Vec::new();
                }
                objects.into_iter().map(|object| Buffer::Coverage(SurfaceId(object as u32))).collect()
            }
        }
    }

    /// All that a picture is lit again from. The objects are shapes, then the lights.
    fn of_relight(&self, is_seen: impl Fn(usize) -> bool) -> Vec<Buffer> {
        let planes = [Plane::Alpha, Plane::Background, Plane::Emission, Plane::Ambient].map(Buffer::from);
        let parts = [LightPart::UnscaledDiffuse, LightPart::UnscaledSpecular];
        let sent =
            (0..self.lights.len() as u32).flat_map(|light| parts.map(|part| Buffer::Light(LightId(light), Some(part))));
        let seen = (self.objects.len() - self.lights.len()..self.objects.len()).filter(|object| is_seen(*object));
        let seen = seen.map(|object| Buffer::Coverage(SurfaceId(object as u32)));
        planes.into_iter().chain(sent).chain(seen).collect()
    }

    /// The name of a buffer, which no other has, and which can stand in any file: an archive says letters beyond ASCII
    /// in ways that readers do not agree on.
    fn of(&self, buffer: Buffer) -> String {
        let (names, number) = match buffer {
            Buffer::Plane(plane) => return plane.name().to_owned(),
            Buffer::Light(light, _) => (&self.lights, light.index()),
            Buffer::Group(group, _) => (&self.groups, group.index()),
            Buffer::Coverage(object) => (&self.objects, object.index()),
        };
        let desc = |choice: LightChoice| match buffer {
            Buffer::Plane(plane) => BufferDesc::Plane(plane),
            Buffer::Light(_, part) => BufferDesc::Light { light: choice, part },
            Buffer::Group(_, part) => BufferDesc::Group { group: choice, part },
            Buffer::Coverage(_) => BufferDesc::Coverage(choice),
        };
        let own = names.get(number).copied().flatten().filter(|name| {
            let is_alone = names.iter().flatten().filter(|other| *other == name).count() == 1;
            is_alone && !name.is_empty() && name.chars().all(|c| matches!(c, ' '..='~') && !matches!(c, '/' | '\\'))
        });
        // Some names mean something else: that of a number, or of the background
        let by_name = own.map(|name| desc(LightChoice::Name(name.to_owned())));
        let by_name = by_name.filter(|desc| BufferDesc::parse(&desc.name()).as_ref() == Ok(desc));
        by_name.unwrap_or_else(|| desc(LightChoice::Number(number as u32 + 1))).name()
    }
}

impl Scene {
    /// What `[render] buffers` asks for, each light by itself. A render makes what its settings say, so give it to
    /// [`RenderSettings::buffers`](crate::RenderSettings::buffers).
    pub fn buffers(&self) -> &[Buffer] {
        &self.buffers
    }

    /// The name of a buffer in files: that of the plane; `light:NAME` or, of a light without a name of its own,
    /// `light:#3`, with the part after it; and so for groups of lights, and for the coverage of objects.
    pub fn buffer_name(&self, buffer: Buffer) -> String {
        let names = match buffer {
            Buffer::Plane(_) => Names::default(),
            Buffer::Light(..) => Names { lights: self.light_names(), ..Names::default() },
            Buffer::Group(..) => Names { groups: self.said_groups(), ..Names::default() },
            Buffer::Coverage(_) => Names { objects: self.names_of(Named::Object), ..Names::default() },
        };
        names.of(buffer)
    }

    /// The buffers that a description means in this scene: one, or one for each light, group of lights or object.
    ///
    /// # Errors
    /// None is called so, in words that say which there are.
    pub fn buffers_of(&self, desc: &BufferDesc) -> Result<Vec<Buffer>, String> {
        let (mut cx, mut names) = (CompileContext::default(), Names::default());
        match desc {
            BufferDesc::Plane(_) => {}
            BufferDesc::Light { .. } => names.lights = self.light_names(),
            BufferDesc::Group { .. } => names.groups = self.said_groups(),
            BufferDesc::Coverage(_) => names.objects = self.names_of(Named::Object),
            BufferDesc::Relight => {
                (names.lights, names.objects) = (self.light_names(), self.names_of(Named::Object));
            }
        }
        let found = names.meant(&mut cx, "", desc, |object| is_seen(object, &self.geometry, &self.lights));
        match cx.take_faults().into_iter().next() {
            None => Ok(found),
            Some(Diagnostic { message, hint, .. }) => {
                Err(hint.map_or(message.clone(), |hint| format!("{message}; {hint}")))
            }
        }
    }

    fn said_groups(&self) -> Vec<Option<&str>> {
        self.light_groups.iter().map(|(name, _)| Some(name.as_str())).collect()
    }

    /// The names of what has ids, that of id 1 first.
    pub(crate) fn names_of(&self, named: Named) -> Vec<Option<&str>> {
        match named {
            Named::Object => self.geometry.surface_names().chain(self.light_names()).collect(),
            Named::Instance => self.geometry.instances.iter().map(Option::as_deref).collect(),
            // The last one is of shapes that name none
            Named::Material => {
                self.summary.materials.iter().map(|(name, _)| Some(name.as_str())).chain([None]).collect()
            }
        }
    }

    /// The names of all objects, that of id 1 first: shapes, then lights.
    pub fn object_names(&self) -> Vec<Option<&str>> {
        self.names_of(Named::Object)
    }

    /// The names of the lights, in scene order.
    pub(crate) fn light_names(&self) -> Vec<Option<&str>> {
        self.summary.lights.iter().map(|(_, name, _)| name.as_deref()).collect()
    }

    /// The lights that a buffer is of, in scene order; none of what is not sent by lights.
    pub(crate) fn lights_of(&self, buffer: Buffer) -> Vec<u32> {
        match buffer {
            Buffer::Plane(_) | Buffer::Coverage(_) => Vec::new(),
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
            Buffer::Coverage(object) => (object.index() >= self.surfaces())
                .then(|| format!("there is no object #{}: the scene has {}", object.0 + 1, self.surfaces())),
        };
        let twice = || {
            let twice = buffers.iter().enumerate().find(|(i, buffer)| buffers[..*i].contains(buffer));
            twice.map(|(_, buffer)| format!("{} is given twice", quoted(&self.buffer_name(*buffer))))
        };
        buffers.iter().find_map(unknown).or_else(twice)
    }
}

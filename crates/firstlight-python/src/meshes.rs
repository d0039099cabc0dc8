//! Meshes of arrays, in a group of their own with an instance, or joined with others.

use firstlight::{GroupDesc, InstanceDesc, MeshData, MeshDesc, SceneError as Faults, ShapeDesc};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value as Json};

use crate::error::scene_error;
use crate::item::{Item, item_table};
use crate::state::State;

/// A mesh that is to be added.
pub struct NewMesh {
    data: MeshData,
    own: MeshDesc,
    /// What places it; `None` where it is joined with others.
    placed: Option<InstanceDesc>,
}

impl NewMesh {
    /// Of some triangles, from the fields of its own and those of the thing that is placed.
    pub fn read(
        py: Python<'_>,
        data: MeshData,
        own: &Bound<'_, PyDict>,
        fields: &Bound<'_, PyDict>,
        is_static: bool,
    ) -> PyResult<Self> {
        let faults = data.faults();
        if !faults.is_empty() {
            // By the names that Python has for the lists
            let words = [("positions", "vertices"), ("triangles", "faces"), ("uvs", "uv")];
            let renamed = faults.into_iter().map(|mut fault| {
                for (from, to) in words {
                    if let Some(rest) = fault.path.strip_prefix(from) {
                        fault.path = format!("{to}{rest}");
                        break;
                    }
                }
                fault
            });
            return Err(scene_error(py, &Faults { faults: renamed.collect() }));
        }
        let (mut own, mut outer) = (item_table(own, "mesh")?, item_table(fields, "mesh")?);
        own.insert("file".into(), "memory:".into());
        if is_static {
            own.append(&mut outer);
        } else {
            outer.insert("of".into(), "".into());
        }
        let ShapeDesc::Mesh(own) = shape(py, "mesh", own)? else { unreachable!("it was read as a mesh") };
        let placed = if is_static { None } else { Some(shape(py, "instance", outer)?) };
        let placed = placed.map(|placed| match placed {
            ShapeDesc::Instance(instance) => instance,
            _ => unreachable!("it was read as an instance"),
        });
        Ok(NewMesh { data, own, placed })
    }

    /// Adds it; the answer is its number, or the name that is taken.
    pub fn add(self, state: &mut State) -> Result<usize, String> {
        let name = self.placed.as_ref().map_or(&self.own.name, |placed| &placed.name).clone();
        if let Some(name) = name.filter(|name| state.numbers.named("shape", name).is_some()) {
            return Err(name);
        }
        let file = Some(state.cache.give_mesh(self.data).into());
        let shape = ShapeDesc::Mesh(MeshDesc { file, ..self.own });
        let desc = &mut state.parsed.desc;
        let shape = match self.placed {
            Some(instance) => {
                // A group that nothing else is called like
                let mut number = desc.groups.len();
                let name = loop {
                    let name = format!("mesh-{number}");
                    if desc.groups.iter().all(|(other, _)| *other != name) {
                        break name;
                    }
                    number += 1;
                };
                desc.groups.push((name.clone(), GroupDesc { shapes: vec![shape] }));
                ShapeDesc::Instance(InstanceDesc { of: name, ..instance })
            }
            None => shape,
        };
        Ok(state.add(Item::Shape(shape)).expect("its name is not taken"))
    }
}

/// A shape from a table, with the paths of faults that `add_mesh` has.
fn shape(py: Python<'_>, kind: &str, table: Map<String, Json>) -> PyResult<ShapeDesc> {
    match Item::read("shape", kind, "", table) {
        Ok(Item::Shape(shape)) => Ok(shape),
        Ok(_) => unreachable!("it was read as a shape"),
        Err(mut faults) => {
            for fault in &mut faults.faults {
                if let Some(rest) = fault.path.strip_prefix(kind) {
                    fault.path = format!("mesh{rest}");
                }
            }
            Err(scene_error(py, &faults))
        }
    }
}

//! glTF 2.0 and GLB: the file, its buffers, its meshes as [`MeshData`], its nodes as they stand at a moment.
//!
//! The station before is whoever has the bytes; the stations after are `model`, which makes descriptions of materials,
//! nodes, lights and cameras, and `shape`, which asks for meshes by their address. Nothing here knows materials.
//!
//! - [`container`]: GLB or JSON, URIs;
//! - [`json`]: a value of the JSON with the pointer that messages call it by;
//! - [`accessor`]: buffer views and accessors, to plain numbers;
//! - [`mesh`]: the primitives of a mesh to one [`MeshData`], with morph targets and skins;
//! - [`files`]: the files of a scene, each opened once, and what they hold by its address;
//! - [`nodes`]: the tree of nodes, and where each stands;
//! - [`animation`]: what animations say at a moment.
//!
//! Our own reader on `serde_json`: every index is checked here anyway, and faults are to carry their place. Memory
//! follows the length of the file: each list that is made of it is counted, and held to a budget.
//!
//! Source: "glTF 2.0 specification", Khronos Group.

mod accessor;
mod animation;
mod container;
mod files;
mod json;
mod mesh;
mod nodes;
#[cfg(test)]
mod tests;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde_json::Value;

pub(crate) use container::Uri;
pub(crate) use files::{Contained, GltfFiles, OpenFault, WithContained};
pub(crate) use json::JsonPlace;
pub(crate) use mesh::MeshAddress;
pub(crate) use nodes::{GltfNode, Pose};

use super::error::{ImportError, MeshPlace};
use crate::context::AssetError;
use container::{Container, data_bytes};

/// What is wrong with a file, and where in its JSON.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GltfFault {
    /// A JSON pointer; empty for the file as a whole.
    pub pointer: String,
    pub message: String,
    pub hint: String,
}

impl GltfFault {
    /// As an error of the file that is called `file`.
    pub fn into_error(self, file: &str) -> ImportError {
        let GltfFault { pointer, message, hint } = self;
        ImportError::Damaged { file: file.to_owned(), place: MeshPlace::Json(pointer), message, hint }
    }
}

/// The largest buffer, in bytes.
const MAX_BUFFER: u64 = 1 << 34;
/// The lists that are made of a file may take so many bytes, and so many times its length besides.
const BUDGET: u64 = 256 << 20;
const BUDGET_TIMES: u64 = 64;

/// A file that was opened, with the bytes of its buffers.
#[derive(Debug)]
pub(crate) struct Gltf {
    json: Value,
    buffers: Vec<Result<Arc<Vec<u8>>, GltfFault>>,
    /// The folder of the file, as the scene names it: where its URIs start at.
    folder: String,
    /// BLAKE3 of the file and of all its buffers.
    pub hash: [u8; 32],
    /// Whether it is a binary container.
    pub is_binary: bool,
    /// Bytes of the file itself.
    pub length: u64,
    /// Bytes that may still be taken.
    budget: AtomicU64,
    /// The nodes of the last pose: each of many meshes with a skin asks for them.
    posed: Mutex<Option<PosedNodes>>,
}

/// A pose, and all nodes in it.
type PosedNodes = (Option<Pose>, Arc<Vec<GltfNode>>);

/// How a file is had: its path, as scenes name files, and the most bytes.
pub(crate) type ReadFile<'a> = dyn Fn(&str, u64) -> Result<Vec<u8>, AssetError> + 'a;

impl Gltf {
    /// Opens the file `file` with these bytes; its buffers are read by `read`.
    pub fn open(file: &str, bytes: &[u8], read: &ReadFile<'_>) -> Result<Gltf, GltfFault> {
        let Container { json, binary } = Container::open(bytes)?;
        check_version(&JsonPlace::root(&json))?;
        let folder = file.rsplit_once('/').map_or("", |(folder, _)| folder).to_owned();
        let mut hasher = blake3::Hasher::new();
        hasher.update(bytes);
        let (mut buffers, mut length) = (Vec::new(), bytes.len() as u64);
        for (i, at) in JsonPlace::root(&json).list("buffers")?.iter().enumerate() {
            let buffer = match (at.text_of("uri"), &binary) {
                (None, Some(binary)) if i == 0 => Ok(bytes[binary.clone()].to_vec()),
                // What stands in for what a codec holds has no bytes at all
                (None, _) => Err(at.fault("has no \"uri\", and the file has no binary chunk for it")),
                (Some(uri), _) => buffer_of(at, uri, &folder, read),
            };
            if let (Ok(buffer), Some(_)) = (&buffer, at.text_of("uri")) {
                length += buffer.len() as u64;
                hasher.update(buffer);
            }
            buffers.push(buffer.map(Arc::new));
        }
        let budget = AtomicU64::new(BUDGET.saturating_add(length.saturating_mul(BUDGET_TIMES)));
        Ok(Gltf {
            json,
            buffers,
            folder,
            hash: *hasher.finalize().as_bytes(),
            is_binary: bytes.starts_with(b"glTF"),
            length: bytes.len() as u64,
            budget,
            posed: Mutex::default(),
        })
    }

    /// Its JSON.
    pub fn root(&self) -> JsonPlace<'_> {
        JsonPlace::root(&self.json)
    }

    /// The files of its buffers, each with its length; `None` where it could not be read.
    pub fn buffer_files(&self) -> Vec<(String, Option<u64>)> {
        let places = self.root().list("buffers").unwrap_or_default();
        let file = |(at, buffer): (&JsonPlace<'_>, &Result<Arc<Vec<u8>>, GltfFault>)| match Uri::of(
            at.text_of("uri")?,
            &self.folder,
        ) {
            Uri::File(path) => Some((path, buffer.as_ref().ok().map(|bytes| bytes.len() as u64))),
            Uri::Data(_) | Uri::Scheme(_) => None,
        };
        places.iter().zip(&self.buffers).filter_map(file).collect()
    }

    /// What its materials are called.
    pub fn material_names(&self) -> Vec<String> {
        let materials = self.root().list("materials").unwrap_or_default();
        materials.iter().enumerate().map(|(index, material)| called(material, index)).collect()
    }

    /// As [`nodes`](Self::nodes), computed once for a pose.
    fn posed_nodes(&self, pose: Option<&Pose>) -> Result<Arc<Vec<GltfNode>>, GltfFault> {
        let mut posed = self.posed.lock().unwrap_or_else(PoisonError::into_inner);
        match &*posed {
            Some((known, nodes)) if known.as_ref() == pose => Ok(nodes.clone()),
            _ => {
                let nodes = Arc::new(self.nodes(pose)?);
                *posed = Some((pose.copied(), nodes.clone()));
                Ok(nodes)
            }
        }
    }

    /// The folder of the file, as the scene names it.
    pub fn folder(&self) -> &str {
        &self.folder
    }

    /// Sees that `bytes` more may be taken for what `at` says.
    pub fn take(&self, at: &JsonPlace<'_>, bytes: u64) -> Result<(), GltfFault> {
        let left = self.budget.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(bytes));
        match left {
            Ok(_) => Ok(()),
            Err(left) => {
                let message = format!(
                    "{} MiB more are needed, and {} MiB are left of {BUDGET_TIMES} times the length of the file and {} \
                     MiB",
                    bytes >> 20,
                    left >> 20,
                    BUDGET >> 20
                );
                let hint = "the file claims more than it holds; if it is right, split it".to_owned();
                Err(GltfFault { hint, ..at.fault(message) })
            }
        }
    }

    /// The bytes of the picture `index` that the file itself holds; `None` of one in a file of its own.
    pub fn image(&self, index: usize) -> Result<Option<Vec<u8>>, GltfFault> {
        let image = self.root().nth("images", index)?;
        if let Some(view) = image.get("bufferView") {
            return Ok(Some(self.view(&view)?.bytes.to_vec()));
        }
        match image.text_of("uri").map(|uri| Uri::of(uri, &self.folder)) {
            Some(Uri::Data(data)) => {
                let bytes = data_bytes(data);
                bytes.map(Some).ok_or_else(|| image.fault("its \"uri\" is no base64"))
            }
            Some(_) => Ok(None),
            None => Err(image.fault("has neither \"uri\" nor \"bufferView\"")),
        }
    }
}

/// What material number `index` is called: by its name, and without one `material 3`.
pub(crate) fn called(material: &JsonPlace<'_>, index: usize) -> String {
    let name = material.text_of("name").filter(|name| !name.is_empty());
    name.map_or_else(|| format!("material {index}"), str::to_owned)
}

/// The names of the animations of a glTF file, in its order; empty where an animation has none. Of what is no glTF file
/// there are none.
pub fn gltf_animations(bytes: &[u8]) -> Vec<String> {
    let Ok(Container { json, .. }) = Container::open(bytes) else { return Vec::new() };
    let animations = JsonPlace::root(&json).list("animations").unwrap_or_default();
    animations.iter().map(|animation| animation.text_of("name").unwrap_or_default().to_owned()).collect()
}

/// The bytes of a buffer with a URI.
fn buffer_of(at: &JsonPlace<'_>, uri: &str, folder: &str, read: &ReadFile<'_>) -> Result<Vec<u8>, GltfFault> {
    match Uri::of(uri, folder) {
        Uri::Data(data) => data_bytes(data).ok_or_else(|| at.fault("its \"uri\" is no base64")),
        Uri::File(path) => read(&path, MAX_BUFFER).map_err(|error| {
            let hint = match error {
                AssetError::NotFound => "a glTF file needs its .bin files beside it",
                AssetError::Outside => "copy it into the folder of the model, or allow its folder with --allow-dir",
                AssetError::TooLarge { .. } | AssetError::Io(_) => "a buffer is a plain file that can be read",
            };
            GltfFault { hint: hint.into(), ..at.fault(format!("{path:?}: {error}")) }
        }),
        Uri::Scheme(scheme) => {
            let hint = "fetch it, and name the file".to_owned();
            Err(GltfFault { hint, ..at.fault(format!("{scheme}: nothing is fetched from a network")) })
        }
    }
}

/// Refuses files that this reader does not understand.
fn check_version(root: &JsonPlace<'_>) -> Result<(), GltfFault> {
    let asset = root.get("asset");
    let said = |key: &str| asset.as_ref().and_then(|asset| asset.text_of(key));
    let needed = said("minVersion").or(said("version")).unwrap_or("2.0");
    let major = needed.split('.').next().and_then(|major| major.parse::<u32>().ok());
    let newer = said("minVersion").is_some() && needed != "2.0";
    if major != Some(2) || newer {
        let hint = "convert it to glTF 2.0".to_owned();
        return Err(GltfFault { hint, ..root.fault(format!("is glTF {needed:?}; 2.0 is read")) });
    }
    Ok(())
}

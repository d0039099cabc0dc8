//! What compiling keeps for the next time: whatever is dear to make, found again by the content it was made from.
//!
//! The station before is whoever compiles one description again and again with little of it changed: a light that
//! moves, a camera, a thing within a group. The key of everything is the BLAKE3 of all that it follows from, so nothing
//! stale can be found and nobody has to say what has changed.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::import::{GltfFiles, MeshData};

/// A key: the BLAKE3 of all that something follows from.
pub(crate) type ContentKey = [u8; 32];

/// What compiling makes of meshes, point sets and pictures, kept from one
/// [`compile`](crate::SceneDesc::compile) to the next: give the same to
/// [`CompileOptions::cache`](crate::CompileOptions::cache). Clones are the same cache.
///
/// Never changes a scene, only how long it takes to compile. What neither this compilation nor the one before has asked
/// for is dropped.
///
/// It also holds meshes that are in no file ([`give_mesh`](Self::give_mesh)); those stay as long as it does.
#[derive(Clone, Default)]
pub struct CompileCache(Arc<Mutex<Kept>>);

/// Everything that is kept.
#[derive(Default)]
struct Kept {
    /// Counts compilations.
    round: u64,
    /// What was made, and the last compilation that asked for it.
    made: HashMap<ContentKey, (u64, Arc<dyn Any + Send + Sync>)>,
    /// Meshes that are in no file, by the name that stands for one, with the BLAKE3 of their content.
    given: HashMap<String, (Arc<MeshData>, ContentKey)>,
}

/// What the names of meshes that are in no file begin with.
const GIVEN: &str = "memory:";

impl CompileCache {
    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps a mesh that is in no file. The answer is the name to write as [`MeshDesc::file`](crate::MeshDesc::file),
    /// `memory:` and the BLAKE3 of the mesh: the same mesh has the same name everywhere, and a description that holds
    /// it the same hash.
    ///
    /// The mesh has to be [without faults](MeshData::faults). As of a file, its normals become of length 1, and
    /// vertices of no triangle are left out.
    pub fn give_mesh(&self, mut mesh: MeshData) -> String {
        mesh.tidy();
        let key = mesh.content();
        let name = format!("{GIVEN}{}", blake3::Hash::from_bytes(key).to_hex());
        self.kept().given.entry(name.clone()).or_insert_with(|| (Arc::new(mesh), key));
        name
    }

    /// The mesh of that name, if it was given.
    pub fn given_mesh(&self, name: &str) -> Option<Arc<MeshData>> {
        self.given(name).map(|(mesh, _)| mesh)
    }

    /// Drops the meshes that were given, but for those of these names.
    pub fn retain_given(&self, names: &dyn Fn(&str) -> bool) {
        self.kept().given.retain(|name, _| names(name));
    }

    pub(crate) fn given(&self, name: &str) -> Option<(Arc<MeshData>, ContentKey)> {
        if name.starts_with(GIVEN) { self.kept().given.get(name).cloned() } else { None }
    }

    /// Begins a compilation.
    pub(crate) fn begin(&self) {
        let kept = &mut *self.kept();
        kept.round += 1;
        let oldest = kept.round.saturating_sub(2);
        kept.made.retain(|_, (asked, _)| *asked >= oldest);
    }

    /// What is kept at `key`.
    pub(crate) fn find<T: Any + Send + Sync>(&self, key: &ContentKey) -> Option<Arc<T>> {
        let kept = &mut *self.kept();
        let (asked, made) = kept.made.get_mut(key)?;
        *asked = kept.round;
        made.clone().downcast().ok()
    }

    /// Keeps something at `key`.
    pub(crate) fn keep<T: Any + Send + Sync>(&self, key: ContentKey, made: &Arc<T>) {
        let kept = &mut *self.kept();
        kept.made.insert(key, (kept.round, made.clone()));
    }
}

impl std::fmt::Debug for CompileCache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kept = self.kept();
        write!(f, "CompileCache({} kept, {} given)", kept.made.len(), kept.given.len())
    }
}

impl PartialEq for CompileCache {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// The mesh files of a scene while it is compiled.
#[derive(Default)]
pub(crate) struct MeshFiles<'a> {
    /// The names of those that were read, and the BLAKE3 of each: for the hash of the scene.
    pub read: Vec<(String, ContentKey)>,
    /// What was made of them before.
    pub cache: Option<&'a CompileCache>,
    /// Those that are open.
    pub open: Arc<OpenFiles>,
}

impl<'a> MeshFiles<'a> {
    /// The same files, for another moment.
    pub fn again(&self) -> MeshFiles<'a> {
        MeshFiles { read: Vec::new(), cache: self.cache, open: self.open.clone() }
    }
}

/// The model files of a scene while it is compiled, each read once.
#[derive(Debug, Default)]
pub(crate) struct OpenFiles {
    pub gltf: GltfFiles,
    /// With the BLAKE3 of each file.
    meshes: Mutex<HashMap<String, (LoadedMesh, ContentKey)>>,
}

/// A mesh of a file, and its key where something is kept.
pub(crate) type LoadedMesh = (Arc<MeshData>, Option<ContentKey>);

impl OpenFiles {
    /// The mesh of a file that was read before.
    pub fn mesh(&self, file: &str) -> Option<(LoadedMesh, ContentKey)> {
        self.meshes.lock().unwrap_or_else(PoisonError::into_inner).get(file).cloned()
    }

    /// Keeps the mesh of a file.
    pub fn keep(&self, file: &str, mesh: &LoadedMesh, hash: ContentKey) {
        self.meshes.lock().unwrap_or_else(PoisonError::into_inner).insert(file.to_owned(), (mesh.clone(), hash));
    }
}

/// The key of what follows from `parts` and is a `what`.
pub(crate) fn key_of<'b>(what: &'b str, parts: impl IntoIterator<Item = &'b [u8]>) -> ContentKey {
    let mut hasher = blake3::Hasher::new();
    // Each with its length, so that nothing can move from one to the next
    for part in std::iter::once(what.as_bytes()).chain(parts) {
        hasher.update(&(part.len() as u64).to_le_bytes()).update(part);
    }
    *hasher.finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_asked_for_twice_is_dropped() {
        let cache = CompileCache::default();
        let keys = [key_of("a", [&b"b"[..]]), key_of("ab", [&b""[..]])];
        assert_ne!(keys[0], keys[1]);
        cache.begin();
        cache.keep(keys[0], &Arc::new(1u8));
        cache.keep(keys[1], &Arc::new(2u8));
        for _ in 0..3 {
            cache.begin();
            assert_eq!(cache.find::<u8>(&keys[0]).as_deref(), Some(&1));
        }
        assert_eq!(cache.find::<u8>(&keys[1]), None);
        // Of another type there is nothing
        assert_eq!(cache.find::<u16>(&keys[0]), None);
    }
}

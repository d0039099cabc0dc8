//! The files of a scene: from a folder or from memory, kept once they were read, so that a scene stays what it was.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use firstlight::{AssetError, Assets, FolderAssets};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

/// What the names of files begin with that are in no folder, as those of meshes of arrays.
pub const IN_MEMORY: &str = "memory:";

/// Where the files of a scene come from.
pub enum Source {
    /// There are none.
    Nothing,
    /// A folder, and those that are allowed besides.
    Folder(FolderAssets),
}

/// The files of a scene.
pub struct SceneFiles {
    source: Source,
    /// Folders of models from elsewhere, each with what the names of its files begin with.
    others: Mutex<Vec<(String, FolderAssets)>>,
    /// The scene's own file.
    own: Option<PathBuf>,
    /// Those that were read, or came with the scene, by their names.
    known: Mutex<BTreeMap<String, Arc<[u8]>>>,
}

impl Source {
    /// A folder, and those that are allowed besides.
    pub fn folder(folder: &Path, allowed: &[PathBuf]) -> PyResult<Source> {
        let refused = |(folder, error): (PathBuf, _)| PyOSError::new_err(format!("{}: {error}", folder.display()));
        FolderAssets::new(folder, allowed).map(Source::Folder).map_err(refused)
    }
}

impl SceneFiles {
    /// Those of a folder, if one is given, and some by name.
    pub fn given(folder: Option<PathBuf>, files: Option<BTreeMap<String, Vec<u8>>>) -> PyResult<Self> {
        let source = folder.map_or(Ok(Source::Nothing), |folder| Source::folder(&folder, &[]))?;
        let known = files.unwrap_or_default().into_iter().map(|(name, bytes)| (name, bytes.into())).collect();
        Ok(SceneFiles::new(source, None, known))
    }

    /// From a source, and with files that are known already.
    pub fn new(source: Source, own: Option<PathBuf>, known: BTreeMap<String, Arc<[u8]>>) -> Self {
        SceneFiles { source, others: Mutex::default(), own, known: Mutex::new(known) }
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<String, Arc<[u8]>>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All that were read so far.
    pub fn all(&self) -> BTreeMap<String, Arc<[u8]>> {
        self.known().clone()
    }

    /// Keeps a file that is in no folder.
    pub fn give(&self, name: String, bytes: Vec<u8>) {
        self.known().insert(name, bytes.into());
    }

    /// What the scene calls the file of a model: of a scene without a folder, `path` leads there from the working
    /// folder, and the model may read the files of its own folder from then on.
    pub fn model(&self, path: &str) -> PyResult<String> {
        if !matches!(self.source, Source::Nothing) || self.known().contains_key(path) {
            return Ok(path.to_owned());
        }
        let file = Path::new(path).file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
        let prefix = path.strip_suffix(&*file).unwrap_or_default().to_owned();
        if let Source::Folder(folder) = Source::folder(Path::new(&prefix), &[])? {
            let mut others = self.others();
            if others.iter().all(|(other, _)| *other != prefix) {
                others.push((prefix, folder));
            }
        }
        Ok(path.to_owned())
    }

    fn others(&self) -> MutexGuard<'_, Vec<(String, FolderAssets)>> {
        self.others.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Drops those that are in no folder, but for those of these names.
    pub fn retain_in_memory(&self, names: &dyn Fn(&str) -> bool) {
        self.known().retain(|name, _| !name.starts_with(IN_MEMORY) || names(name));
    }

    /// Whether the scene was read from the file that `path` leads to.
    pub fn holds(&self, path: &Path) -> bool {
        let Ok(real) = path.canonicalize() else { return false };
        let mut read: Vec<PathBuf> = self.others().iter().flat_map(|(_, folder)| folder.files()).collect();
        if let Source::Folder(folder) = &self.source {
            read.extend(folder.files());
        }
        read.contains(&real) || self.own.as_ref().is_some_and(|own| *own == real)
    }
}

impl Assets for SceneFiles {
    fn read(&self, path: &str, limit: u64) -> Result<Vec<u8>, AssetError> {
        let fits = |bytes: &[u8]| {
            let size = bytes.len() as u64;
            if size > limit { Err(AssetError::TooLarge { size, limit }) } else { Ok(bytes.to_vec()) }
        };
        if let Some(bytes) = self.known().get(path) {
            return fits(bytes);
        }
        match &self.source {
            Source::Nothing => {
                let others = self.others();
                let within = others.iter().filter_map(|(prefix, folder)| Some((path.strip_prefix(prefix)?, folder)));
                let mut read = Err(AssetError::NotFound);
                for (rest, folder) in within {
                    read = folder.read(rest, limit);
                    if !matches!(read, Err(AssetError::NotFound)) {
                        break;
                    }
                }
                if let Ok(bytes) = &read {
                    self.known().insert(path.to_owned(), bytes.as_slice().into());
                }
                read
            }
            Source::Folder(folder) => {
                let bytes = folder.read(path, limit)?;
                self.known().insert(path.to_owned(), bytes.as_slice().into());
                Ok(bytes)
            }
        }
    }
}

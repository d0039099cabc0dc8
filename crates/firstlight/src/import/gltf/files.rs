//! The glTF files of a scene, and what lies in them by its address: `chair.glb#mesh/0`, `chair.glb#image/2`.
//!
//! A scene names meshes and pictures by files. What lies within a file has the name of that file, `#`, and where it is
//! in it; so a description of a model is a description like all others, can be written as text and read again.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use super::Gltf;
use super::mesh::MeshAddress;
use crate::context::{AssetError, Assets};
use crate::import::ImportError;

/// The largest file, in bytes.
const MAX_FILE: u64 = 1 << 34;

/// Why a file cannot be opened.
#[derive(Clone, Debug)]
pub(crate) enum OpenFault {
    /// It cannot be had.
    Read(AssetError),
    /// It is no glTF file, or a damaged one.
    Damaged(ImportError),
}

/// The glTF files of a scene while it is compiled, each opened once.
#[derive(Debug, Default)]
pub(crate) struct GltfFiles(Mutex<HashMap<String, Result<Arc<Gltf>, OpenFault>>>);

impl GltfFiles {
    /// The file of that name.
    pub fn open(&self, file: &str, assets: &dyn Assets) -> Result<Arc<Gltf>, OpenFault> {
        let mut files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let open = || {
            let bytes = assets.read(file, MAX_FILE).map_err(OpenFault::Read)?;
            let gltf = Gltf::open(file, &bytes, &|path, limit| assets.read(path, limit));
            gltf.map(Arc::new).map_err(|fault| OpenFault::Damaged(fault.into_error(file)))
        };
        files.entry(file.to_owned()).or_insert_with(open).clone()
    }
}

/// What lies in a file, by its address.
#[derive(Debug, PartialEq)]
pub(crate) enum Contained {
    Mesh(MeshAddress),
    Image(usize),
}

impl Contained {
    /// The file and what lies in it; `None` of the name of a file by itself.
    pub fn split(name: &str) -> Option<(&str, Contained)> {
        let (file, address) = name.rsplit_once('#')?;
        let contained = match address.strip_prefix("image/") {
            Some(index) => Contained::Image(index.parse().ok()?),
            None => Contained::Mesh(MeshAddress::parse(address)?),
        };
        Some((file, contained))
    }
}

/// Files, and the pictures within glTF files among them.
pub(crate) struct WithContained<'a> {
    pub assets: &'a dyn Assets,
    pub files: &'a GltfFiles,
}

impl Assets for WithContained<'_> {
    fn read(&self, path: &str, limit: u64) -> Result<Vec<u8>, AssetError> {
        let Some((file, Contained::Image(index))) = Contained::split(path) else {
            return self.assets.read(path, limit);
        };
        let gltf = self.files.open(file, self.assets).map_err(|fault| match fault {
            OpenFault::Read(error) => error,
            OpenFault::Damaged(error) => AssetError::Io(error.to_string()),
        })?;
        match gltf.image(index) {
            Ok(Some(bytes)) if bytes.len() as u64 > limit => {
                Err(AssetError::TooLarge { size: bytes.len() as u64, limit })
            }
            Ok(Some(bytes)) => Ok(bytes),
            Ok(None) => Err(AssetError::Io("the picture is in a file of its own".into())),
            Err(fault) => Err(AssetError::Io(fault.into_error(file).to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::Pose;

    #[test]
    fn addresses() {
        let mesh = |address| Some(("a/b.glb", Contained::Mesh(address)));
        assert_eq!(Contained::split("a/b.glb#mesh/12"), mesh(MeshAddress::Mesh(12)));
        assert_eq!(Contained::split("a/b.glb#node/3"), mesh(MeshAddress::Node(3, None)));
        let posed = MeshAddress::Node(3, Some(Pose { animation: 1, time: 0.1 }));
        assert_eq!(posed.to_string(), "node/3/animation/1/time/0.1");
        assert_eq!(Contained::split(&format!("a/b.glb#{posed}")), mesh(posed));
        assert_eq!(Contained::split("a#b.glb#image/0"), Some(("a#b.glb", Contained::Image(0))));
        for plain in ["a.glb", "a#b.png", "a.glb#", "a.glb#image/", "a.glb#mesh/x", "a.glb#node/1/time/2"] {
            assert_eq!(Contained::split(plain), None, "{plain}");
        }
    }
}

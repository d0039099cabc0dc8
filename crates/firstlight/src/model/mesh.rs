//! Models of one mesh or of points: PLY, STL and OBJ.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};

use super::{
    ModelParts, ModelShape, ModelWarning, MtlSettings, PictureFinder, UniqueNames, clay, material_name, read_mtl, shown,
};
use crate::context::{AssetError, Assets};
use crate::describe::FilePath;
use crate::describe::value::join_path;
use crate::image::read::{Limits, read_header};
use crate::import::MeshData;
use crate::math::DAffine3;
use crate::shape::{MeshDesc, PointSetDesc, ShapeDesc};
use crate::texture::TextureDesc;

/// Faces of files without normals that meet at up to this angle, in degrees, are parts of something round.
const SMOOTH_DEG: f64 = 30.0;
/// The height of white in a bump map of an MTL file with `-bm 1`, in sizes of the model: the file has no unit of it.
const BUMP_HEIGHT: f64 = 0.01;
/// All MTL files of a model together, in bytes.
const MAX_MTL: u64 = 64 << 20;
/// Names of MTL files that are looked for.
const MAX_MTL_FILES: usize = 1000;
/// The largest picture that is looked at for alpha, in bytes.
const MAX_PICTURE: u64 = 1 << 30;

/// What is shown of a file of one mesh.
pub(crate) struct ShownMesh<'a> {
    /// The file, as the scene names it.
    pub file: &'a str,
    pub smooth_deg: Option<f64>,
    /// Whether materials show their colours, whatever light there is.
    pub unlit: bool,
    /// The scene's own material for one of the file, by its name there.
    pub chosen: &'a dyn Fn(&str) -> Option<String>,
    /// Where files come from.
    pub assets: &'a dyn Assets,
}

/// What a file of one mesh describes.
pub(crate) fn describe_mesh(data: &MeshData, shown_mesh: &ShownMesh<'_>) -> ModelParts {
    let ShownMesh { file, smooth_deg, unlit, chosen, .. } = *shown_mesh;
    let mut parts = ModelParts::default();
    let mut names: UniqueNames = data.materials.iter().map(|own| material_name(file, own, unlit)).collect();
    let default = names.unique(material_name(file, "default", unlit));
    // Smoothing groups say themselves where edges are
    let of_file = if data.smoothing.iter().any(|group| *group != 0) { 180.0 } else { SMOOTH_DEG };
    let smooth_deg = smooth_deg.or(data.normals.is_empty().then_some(of_file));
    let mut mesh = MeshDesc { file: Some(FilePath(file.to_owned())), smooth_deg, ..MeshDesc::default() };
    let size = data.used_bounds().map_or(0.0, |[low, high]| (high - low).length());
    let described = add_mtl(&mut parts, data, shown_mesh, size);
    let of_name = |name: &String| match chosen(name) {
        Some(chosen) => chosen,
        None if described.contains(name) => material_name(file, name, unlit),
        None => default.clone(),
    };
    mesh.materials = data.materials.iter().map(of_name).collect();
    let missing = |name: &&String| !name.is_empty() && !described.contains(*name) && chosen(name).is_none();
    let missing: Vec<&String> = data.materials.iter().filter(missing).collect();
    if let (Some(first), false) = (missing.first(), data.material_files.is_empty()) {
        let message = format!("{} of its materials are described in no MTL file, {first:?} for one", missing.len());
        parts.warnings.push(ModelWarning { message, hint: "their faces are of a light gray".to_owned() });
    }
    mesh.material = Some(default.clone());
    parts.materials.push((default, shown(clay(has_colors(data)), unlit)));
    parts.shapes.push(ModelShape { shape: ShapeDesc::Mesh(mesh), model_from_shape: DAffine3::IDENTITY });
    parts
}

/// Whether vertices have colours: white is what those without have.
fn has_colors(data: &MeshData) -> bool {
    data.colors.iter().any(|[r, g, b, _]| [*r, *g, *b] != [1.0; 3])
}

/// Adds the materials of the MTL files that faces of the mesh have; the answer are their names in the file.
fn add_mtl(parts: &mut ModelParts, data: &MeshData, shown_mesh: &ShownMesh<'_>, size: f64) -> HashSet<String> {
    let ShownMesh { file, unlit, chosen, assets, .. } = *shown_mesh;
    let named: HashSet<&str> = data.materials.iter().map(String::as_str).collect();
    let mut described = HashSet::new();
    // Many materials may have the same picture
    let alphas: RefCell<HashMap<String, Option<bool>>> = RefCell::default();
    let pictures = RefCell::new(PictureFinder::new(assets));
    for (path, bytes) in mtl_files(parts, data, file, assets) {
        let inside = path.rsplit_once('/').map_or("", |(folder, _)| folder).to_owned();
        let has_alpha = |picture: &str| {
            let picture = pictures.borrow_mut().find(join_path(&inside, picture), &inside);
            if let Some(known) = alphas.borrow().get(&picture) {
                return *known;
            }
            let header = assets.read(&picture, MAX_PICTURE).ok().map(|bytes| read_header(&bytes, &Limits::default()));
            let has_alpha = header.and_then(Result::ok).map(|header| header.has_alpha());
            alphas.borrow_mut().insert(picture, has_alpha);
            has_alpha
        };
        let is_wanted = |name: &str| named.contains(name) && !described.contains(name) && chosen(name).is_none();
        let settings = MtlSettings {
            is_wanted: &is_wanted,
            texture_name: &|name| format!("{path}/{name}"),
            has_alpha: &has_alpha,
            bump_height: size * BUMP_HEIGHT,
        };
        let read = match read_mtl(&path, &bytes, &settings) {
            Ok(read) => read,
            Err(error) => {
                let hint = "its faces are of a light gray".to_owned();
                parts.warnings.push(ModelWarning { message: error.to_string(), hint });
                continue;
            }
        };
        for note in read.notes {
            let hint = note.hint.unwrap_or_default();
            parts.notes.push(ModelWarning { message: format!("{path}:{}: {}", note.line, note.message), hint });
        }
        parts.spare.materials.extend(read.unwanted.into_iter().filter(|name| !named.contains(name.as_str())));
        parts.spare.pictures.extend(read.unused_pictures.iter().map(|picture| join_path(&inside, picture)));
        for (name, mut texture) in read.textures {
            if let TextureDesc::Image(image) = &mut texture {
                image.file.0 = pictures.borrow_mut().find(join_path(&inside, &image.file.0), &inside);
            }
            parts.textures.push((name, texture));
        }
        for (name, material) in read.materials {
            parts.materials.push((material_name(file, &name, unlit), shown(material, unlit)));
            described.insert(name);
        }
    }
    parts.warnings.extend(pictures.into_inner().warnings);
    described
}

/// The MTL files that the OBJ file `file` names, each once, with their paths in the scene. What cannot be read is told.
fn mtl_files(parts: &mut ModelParts, data: &MeshData, file: &str, assets: &dyn Assets) -> Vec<(String, Vec<u8>)> {
    let folder = file.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut files = MtlFiles {
        folder,
        assets,
        left: MAX_MTL,
        asked: HashSet::new(),
        list: vec![],
        missing: vec![],
        warnings: vec![],
    };
    for line in &data.material_files {
        // A name may hold blanks; where there is no file of such a name, the line has several
        if files.is_new(line) && !files.read(line) {
            for word in &words_of(line) {
                if (word == line || files.is_new(word) && !files.read(word)) && !files.is_full() {
                    let message = format!("{word:?}: there is no such file of materials");
                    files.warn(message, "its faces are of a light gray; an OBJ file needs its MTL files beside it");
                    files.missing.push(join_path(folder, &word.replace('\\', "/")));
                }
            }
        }
        if files.is_full() {
            let message = format!("it names more than {MAX_MTL_FILES} files of materials: the others are not read");
            files.warn(message, "write the materials of a model into one file");
            break;
        }
    }
    // Programs leave the line out, or write an old name into it: the file beside has the model's own
    let is_named = data.materials.iter().any(|name| !name.is_empty());
    if files.list.is_empty() && is_named && !files.is_full() {
        let name = file.rsplit('/').next().unwrap_or_default();
        let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
        files.read(&format!("{stem}.mtl"));
    }
    parts.warnings.append(&mut files.warnings);
    let read = files.list.iter().map(|(path, bytes)| (path.clone(), Some(bytes.len() as u64)));
    parts.spare.files.extend(read.chain(files.missing.into_iter().map(|path| (path, None))));
    files.list
}

/// What stands between the blanks of a line, but for those after a backslash: `a\ b.mtl c.mtl` has two words.
fn words_of(line: &str) -> Vec<String> {
    let parted = line.replace("\\ ", "\0");
    parted.split_whitespace().map(|word| word.replace('\0', " ")).collect()
}

/// MTL files while they are read.
struct MtlFiles<'a> {
    /// That of the OBJ file.
    folder: &'a str,
    assets: &'a dyn Assets,
    /// Bytes that may still be read.
    left: u64,
    /// Names and paths that were asked for.
    asked: HashSet<String>,
    list: Vec<(String, Vec<u8>)>,
    /// What cannot be read.
    missing: Vec<String>,
    warnings: Vec<ModelWarning>,
}

impl MtlFiles<'_> {
    fn warn(&mut self, message: String, hint: &str) {
        self.warnings.push(ModelWarning { message, hint: hint.to_owned() });
    }

    fn is_full(&self) -> bool {
        self.asked.len() > MAX_MTL_FILES
    }

    /// Whether nobody asked for that name before.
    fn is_new(&mut self, written: &str) -> bool {
        !self.is_full() && self.asked.insert(written.to_owned())
    }

    /// Reads the file of that name, from the folder of the OBJ file; where its path leads nowhere, by its own name
    /// beside it. Answers whether there is one.
    fn read(&mut self, written: &str) -> bool {
        let unquoted = written.trim();
        let unquoted = unquoted.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(unquoted);
        let written = unquoted.replace('\\', "/");
        let alone = written.rsplit('/').next().unwrap_or_default();
        let mut refused = None;
        for path in [written.as_str(), alone].into_iter().filter(|path| !path.is_empty()) {
            let path = join_path(self.folder, path);
            if self.list.iter().any(|(known, _)| *known == path) {
                return true;
            }
            match self.assets.read(&path, self.left) {
                Err(AssetError::NotFound) => {}
                Err(error @ AssetError::Outside) => refused = Some((path, error)),
                Err(error) => {
                    self.warn(format!("{path:?}: {error}"), "its faces are of a light gray");
                    self.missing.push(path);
                    return true;
                }
                Ok(bytes) => {
                    self.left -= bytes.len() as u64;
                    self.list.push((path, bytes));
                    return true;
                }
            }
        }
        match refused {
            Some((path, error)) => {
                self.warn(format!("{path:?}: {error}"), "its faces are of a light gray");
                self.missing.push(path);
                true
            }
            None => false,
        }
    }
}

/// What a file of points describes.
pub(crate) fn describe_points(file: &str, is_unlit: bool) -> ModelParts {
    let mut parts = ModelParts::default();
    let default = material_name(file, "default", is_unlit);
    let points = PointSetDesc {
        file: Some(FilePath(file.to_owned())),
        material: Some(default.clone()),
        ..PointSetDesc::default()
    };
    parts.materials.push((default, shown(clay(true), is_unlit)));
    parts.shapes.push(ModelShape { shape: ShapeDesc::PointSet(points), model_from_shape: DAffine3::IDENTITY });
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::MemoryAssets;
    use crate::material::MaterialDesc;

    /// What `a.obj` with one face of each material describes, beside files of materials.
    fn described(names: &[&str], mtl_line: &str, files: &[(&str, &str)]) -> ModelParts {
        let mut assets = MemoryAssets::default();
        for (name, text) in files {
            assets.files.insert((*name).into(), text.as_bytes().into());
        }
        let data = MeshData {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]; names.len()],
            face_materials: (0..names.len() as u32).collect(),
            materials: names.iter().map(|name| (*name).to_owned()).collect(),
            material_files: vec![mtl_line.to_owned()],
            ..MeshData::default()
        };
        let chosen = |_: &str| None;
        let shown = ShownMesh { file: "m/a.obj", smooth_deg: None, unlit: false, chosen: &chosen, assets: &assets };
        describe_mesh(&data, &shown)
    }

    fn of_faces(parts: &ModelParts) -> &[String] {
        match &parts.shapes[0].shape {
            ShapeDesc::Mesh(mesh) => &mesh.materials,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_material_called_default_is_that_of_the_file() {
        let files = [("m/a.mtl", "newmtl default\nKd 1 0 0\n")];
        let parts = described(&["default", "other"], "a.mtl", &files);
        assert_eq!(of_faces(&parts), ["m/a.obj/default", "m/a.obj/default 2"]);
        let names: Vec<&str> = parts.materials.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["m/a.obj/default", "m/a.obj/default 2"]);
        assert!(matches!(parts.materials[0].1, MaterialDesc::Phong(_)));
        assert_eq!(parts.materials[1].1, clay(false));
        assert_eq!(parts.warnings[0].message, "1 of its materials are described in no MTL file, \"other\" for one");
    }

    #[test]
    fn what_no_face_has_is_told() {
        let text = "newmtl red\nKd 1 0 0\nmap_Kd wood.png\nillum 1\nmap_Ks shine.png\nnewmtl blue\nmap_Kd sky.png\n";
        let parts = described(&["red"], "sub/a.mtl none.mtl", &[("m/sub/a.mtl", text)]);
        let files = [("m/sub/a.mtl".to_owned(), Some(text.len() as u64)), ("m/none.mtl".to_owned(), None)];
        assert_eq!(parts.spare.files, files);
        assert_eq!(parts.spare.materials, ["blue"]);
        assert_eq!(parts.spare.pictures, ["m/sub/shine.png", "m/sub/sky.png"]);
    }

    #[test]
    fn a_file_of_materials_is_found_in_quotes_and_by_the_name_of_the_model() {
        let red = "newmtl red\nKd 1 0 0\n";
        for (line, files) in [
            ("\"my mat.mtl\"", &[("m/my mat.mtl", red)][..]),
            ("old.mtl", &[("m/a.mtl", red)]),
            ("", &[("m/a.mtl", red)]),
        ] {
            let parts = described(&["red"], line, files);
            assert_eq!(of_faces(&parts), ["m/a.obj/red"], "{line}");
        }
        // One that is named is there
        let parts = described(&["red"], "b.mtl", &[("m/b.mtl", "newmtl blue\n"), ("m/a.mtl", red)]);
        assert_eq!(of_faces(&parts), ["m/a.obj/default"]);
    }

    #[test]
    fn pictures_are_found_beside_the_file_that_names_them() {
        let files = [("m/a.mtl", "newmtl red\nmap_Kd maps/wood.png\nmap_Ks maps/none.png\n"), ("m/wood.png", "x")];
        let parts = described(&["red"], "a.mtl", &files);
        let pictures: Vec<&str> = parts
            .textures
            .iter()
            .map(|(_, texture)| match texture {
                TextureDesc::Image(image) => image.file.0.as_str(),
                _ => "",
            })
            .collect();
        assert_eq!(pictures, ["m/wood.png", "m/maps/none.png"]);
    }

    #[test]
    fn smoothing_groups_say_themselves_where_edges_are() {
        let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let of = |smoothing: Vec<u32>, asked| {
            let data =
                MeshData { positions: corners.clone(), triangles: vec![[0, 1, 2]], smoothing, ..MeshData::default() };
            let chosen = |_: &str| None;
            let assets = MemoryAssets::default();
            let shown =
                ShownMesh { file: "m/a.obj", smooth_deg: asked, unlit: false, chosen: &chosen, assets: &assets };
            match describe_mesh(&data, &shown).shapes.remove(0).shape {
                ShapeDesc::Mesh(mesh) => mesh.smooth_deg,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(of(vec![], None), Some(SMOOTH_DEG));
        assert_eq!(of(vec![0], None), Some(SMOOTH_DEG));
        assert_eq!((of(vec![3], None), of(vec![3], Some(20.0))), (Some(180.0), Some(20.0)));
    }

    #[test]
    fn a_line_names_one_file_with_blanks_or_several() {
        let red = "newmtl red\nKd 1 0 0\n";
        for (line, files) in [
            ("my mat.mtl", &[("m/my mat.mtl", red)][..]),
            ("none.mtl b.mtl", &[("m/b.mtl", red)]),
            ("C:\\work\\b.mtl", &[("m/b.mtl", red)]),
            ("my\\ mat.mtl", &[("m/my mat.mtl", red)]),
            ("none.mtl my\\ own\\ mat.mtl", &[("m/my own mat.mtl", red)]),
        ] {
            let parts = described(&["red"], line, files);
            assert_eq!(of_faces(&parts), ["m/a.obj/red"], "{line}");
            assert!(parts.materials.iter().any(|(name, _)| name == "m/a.obj/red"), "{line}");
        }
        let parts = described(&["red"], "none.mtl b.mtl", &[("m/b.mtl", red)]);
        assert_eq!(parts.warnings.len(), 1);
        assert_eq!(parts.warnings[0].message, "\"none.mtl\": there is no such file of materials");
    }

    /// Files, and which were asked for.
    struct Watched<'a>(&'a MemoryAssets, std::sync::Mutex<Vec<String>>);

    impl Assets for Watched<'_> {
        fn read(&self, path: &str, limit: u64) -> Result<Vec<u8>, AssetError> {
            self.1.lock().unwrap().push(path.to_owned());
            self.0.read(path, limit)
        }
    }

    #[test]
    fn files_that_are_named_again_and_again_are_read_once() {
        let mut assets = MemoryAssets::default();
        let names: Vec<String> = (0..5000).map(|i| format!("m{i}")).collect();
        let mtl: String = names.iter().map(|name| format!("newmtl {name}\nmap_d x.png\n")).collect();
        assets.files.insert("m/a.mtl".into(), mtl.into_bytes());
        let watched = Watched(&assets, std::sync::Mutex::default());
        let mut lines = vec!["a.mtl".to_owned(), "./a.mtl a.mtl .//a.mtl".to_owned(), "C:/x/a.mtl".to_owned()];
        lines.extend(std::iter::repeat_n("a.mtl".to_owned(), 5000));
        let mut data = MeshData {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]; names.len()],
            face_materials: (0..names.len() as u32).collect(),
            materials: names,
            material_files: lines,
            ..MeshData::default()
        };
        let chosen = |_: &str| None;
        let shown = ShownMesh { file: "m/a.obj", smooth_deg: None, unlit: false, chosen: &chosen, assets: &watched };
        assert_eq!(describe_mesh(&data, &shown).materials.len(), 5001);
        let of = |name: &str| watched.1.lock().unwrap().iter().filter(|path| *path == name).count();
        // A picture once for whether it is there, once beside it, and once for its alpha
        assert_eq!((of("m/a.mtl"), of("m/x.png")), (1, 3));
        // Names without end
        data.material_files = vec![(0..100_000).map(|i| format!("{i}.mtl ")).collect()];
        let warnings = describe_mesh(&data, &shown).warnings;
        assert!(warnings.len() <= MAX_MTL_FILES + 2 && watched.1.lock().unwrap().len() < 5000, "{}", warnings.len());
        assert!(warnings[warnings.len() - 2].message.contains("more than 1000 files"), "{:?}", warnings.last());
    }
}

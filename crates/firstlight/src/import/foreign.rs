//! What a file is that is neither a scene nor a mesh, by its content: so that one line can say it, instead of a line
//! for every word that no reader understands.

use super::{obj, ply, stl};

/// Whether these are the bytes of a glTF file, JSON or binary.
pub fn is_gltf(bytes: &[u8]) -> bool {
    bytes.starts_with(b"glTF") || foreign(bytes, WantedFile::Mesh).is_some_and(|kind| kind.family == FileFamily::Gltf)
}

/// A file of a kind that is not what was wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Foreign {
    /// With its article: "a PNG picture".
    pub kind: &'static str,
    family: FileFamily,
}

/// What is to be done about it goes by families.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FileFamily {
    /// A mesh that is read, where a scene is wanted.
    Mesh,
    /// glTF, which is a model by itself.
    Gltf,
    /// A model or scene of which only meshes could be used, once exported.
    Model,
    /// Numbered points.
    Cloud,
    /// A scene of another renderer.
    Scene,
    Picture,
    Archive,
    /// Text in an encoding that is not read.
    Encoding,
    /// The materials of an OBJ file.
    Materials,
    Other,
}

/// What a file was to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WantedFile {
    Scene,
    Mesh,
    /// A mesh, or a file with all that is shown of it.
    Model,
}

impl Foreign {
    /// `looks like a PNG picture, not like a firstlight scene`
    pub fn message(self, wanted: WantedFile) -> String {
        let wanted = match wanted {
            WantedFile::Scene => "a firstlight scene",
            WantedFile::Mesh => "a mesh",
            WantedFile::Model => "a model",
        };
        format!("looks like {}, not like {wanted}", self.kind)
    }

    /// What to do.
    pub fn hint(self, wanted: WantedFile) -> &'static str {
        match (self.family, wanted) {
            (FileFamily::Mesh, _) => "give it as a model, or name it as the file of a [[mesh]] or [[point_set]]",
            (FileFamily::Gltf, _) => "give it as a model (.glb, .gltf), or name it as the file of a [[model]]",
            (FileFamily::Model, _) => "that kind is not read yet; export it as glTF, OBJ, PLY or STL",
            (FileFamily::Cloud, _) => "that kind is not read yet; convert it to PLY",
            (FileFamily::Scene, _) => "scenes of other programs are not read; export their meshes as PLY or OBJ",
            (FileFamily::Picture, WantedFile::Scene) => {
                "a scene is TOML or JSON text; it names pictures in [texture.image.NAME]"
            }
            (FileFamily::Archive, _) => "unpack it first",
            (FileFamily::Encoding, _) => "save it as UTF-8",
            (FileFamily::Materials, _) => "give the OBJ file that belongs to it, which brings its materials",
            (FileFamily::Picture | FileFamily::Other, WantedFile::Mesh) => "a mesh is a PLY, STL or OBJ file",
            (FileFamily::Picture | FileFamily::Other, WantedFile::Model) => {
                "a model is a glTF, GLB, OBJ, PLY or STL file"
            }
            (FileFamily::Other, WantedFile::Scene) => {
                "a scene is TOML or JSON text, a model a glTF, OBJ, PLY or STL file"
            }
        }
    }
}

/// First bytes, and what they are the first bytes of.
const MAGIC: &[(&[u8], &str, FileFamily)] = &[
    (b"glTF", "a binary glTF model (GLB)", FileFamily::Gltf),
    (b"BLENDER", "a Blender file", FileFamily::Model),
    (b"Kaydara FBX Binary", "an FBX model", FileFamily::Model),
    (b"; FBX ", "an FBX model", FileFamily::Model),
    (b"PXR-USDC", "a USD scene", FileFamily::Model),
    (b"#usda", "a USD scene", FileFamily::Model),
    (b"#VRML", "a VRML scene", FileFamily::Model),
    (b"#X3D", "an X3D scene", FileFamily::Model),
    (b"Ogawa", "an Alembic scene", FileFamily::Model),
    (b"DRACO", "a Draco mesh", FileFamily::Model),
    (b"ISO-10303-21", "a STEP model", FileFamily::Model),
    (b"3D Geometry File Format", "a Rhino model", FileFamily::Model),
    (b"//Maya ASCII", "a Maya scene", FileFamily::Model),
    (b"OFF\n", "an OFF mesh", FileFamily::Model),
    (b"OFF\r", "an OFF mesh", FileFamily::Model),
    (b"OFF ", "an OFF mesh", FileFamily::Model),
    (b"COFF", "an OFF mesh", FileFamily::Model),
    (b"NOFF", "an OFF mesh", FileFamily::Model),
    (b"\x20BDV", "an OpenVDB volume", FileFamily::Model),
    (b"# .PCD", "a PCD point cloud", FileFamily::Cloud),
    (b"LASF", "a LAS point cloud", FileFamily::Cloud),
    (b"ASTM-E57", "an E57 point cloud", FileFamily::Cloud),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture", FileFamily::Picture),
    (b"\xff\xd8\xff", "a JPEG picture", FileFamily::Picture),
    (b"GIF8", "a GIF picture", FileFamily::Picture),
    (b"II*\0", "a TIFF picture", FileFamily::Picture),
    (b"MM\0*", "a TIFF picture", FileFamily::Picture),
    (b"\x76\x2f\x31\x01", "an OpenEXR picture", FileFamily::Picture),
    (b"#?RADIANCE", "a Radiance picture (HDR)", FileFamily::Picture),
    (b"#?RGBE", "a Radiance picture (HDR)", FileFamily::Picture),
    (b"8BPS", "a Photoshop picture", FileFamily::Picture),
    (b"DDS ", "a DDS picture", FileFamily::Picture),
    (b"qoif", "a QOI picture", FileFamily::Picture),
    (b"\xabKTX ", "a KTX texture", FileFamily::Picture),
    (b"PK\x05\x06", "an empty zip archive", FileFamily::Archive),
    (b"\x1f\x8b", "gzip-compressed data", FileFamily::Archive),
    (b"BZh", "bzip2-compressed data", FileFamily::Archive),
    (b"\xfd7zXZ\0", "xz-compressed data", FileFamily::Archive),
    (b"\x28\xb5\x2f\xfd", "zstd-compressed data (newer Blender files are)", FileFamily::Archive),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", FileFamily::Archive),
    (b"Rar!\x1a\x07", "a RAR archive", FileFamily::Archive),
    (b"%PDF", "a PDF document", FileFamily::Other),
    (b"%!PS", "a PostScript document", FileFamily::Other),
    (b"{\\rtf", "an RTF document", FileFamily::Other),
    (b"\x7fELF", "a program (ELF)", FileFamily::Other),
    (b"MZ\x90\0", "a program for Windows", FileFamily::Other),
    (b"\xcf\xfa\xed\xfe", "a program (Mach-O)", FileFamily::Other),
    (b"\xca\xfe\xba\xbe", "a program (Mach-O or Java)", FileFamily::Other),
    (b"\0asm", "a program (WebAssembly)", FileFamily::Other),
    (b"#!/", "a script", FileFamily::Other),
    (b"SQLite format 3\0", "a database (SQLite)", FileFamily::Other),
    (b"\x93NUMPY", "a NumPy array", FileFamily::Other),
    (b"\x89HDF", "an HDF5 file", FileFamily::Other),
    (b"\xff\xfe", "text in UTF-16", FileFamily::Encoding),
    (b"\xfe\xff", "text in UTF-16", FileFamily::Encoding),
];

/// Bytes that are looked at for words.
const HEAD: usize = 1 << 16;
/// Bytes at both ends of JSON that are looked at: `asset` may stand behind a buffer within the text.
const JSON_ENDS: usize = 1 << 20;

/// What `bytes` are, if they are nothing that could be a scene, nor a mesh if one is wanted. `None` where nothing
/// speaks against it.
pub(crate) fn foreign(bytes: &[u8], wanted: WantedFile) -> Option<Foreign> {
    let is = |kind, family| Some(Foreign { kind, family });
    let mesh = |kind| if wanted == WantedFile::Scene { is(kind, FileFamily::Mesh) } else { None };
    // Meshes first: the header of a binary STL file may begin with anything
    if ply::looks_like(bytes) {
        return mesh("a PLY model");
    }
    if stl::looks_like(bytes) {
        return mesh("an STL model");
    }
    if obj::looks_like(bytes) {
        return mesh("an OBJ model");
    }
    if let Some((_, kind, family)) = MAGIC.iter().find(|(magic, ..)| bytes.starts_with(magic)) {
        return is(kind, *family);
    }
    // Kinds that say what they are farther on
    let at = |start: usize, word: &[u8]| bytes.get(start..).is_some_and(|rest| rest.starts_with(word));
    let length =
        |start: usize| bytes.get(start..start + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    if at(0, b"PK\x03\x04") {
        return archive(bytes);
    }
    if at(0, b"RIFF") && at(8, b"WEBP") {
        return is("a WebP picture", FileFamily::Picture);
    }
    if at(4, b"ftypavif") || at(4, b"ftypheic") || at(4, b"ftypmif1") {
        return is("an AVIF or HEIC picture", FileFamily::Picture);
    }
    if at(4, b"ftyp") {
        return is("a film (MP4)", FileFamily::Other);
    }
    if at(0, b"BM") && matches!(length(14), Some(12 | 40 | 52 | 56 | 64 | 108 | 124)) {
        return is("a BMP picture", FileFamily::Picture);
    }
    if at(0, b"MM") && length(2) == Some(bytes.len()) {
        return is("a 3DS model", FileFamily::Model);
    }
    if at(257, b"ustar") {
        return is("a tar archive", FileFamily::Archive);
    }
    let head = &bytes[..bytes.len().min(HEAD)];
    // No text has such bytes. A mesh may well, and its reader says what is wrong with it
    if head.contains(&0) || !is_utf8(head) && head.iter().any(is_odd) {
        return if wanted == WantedFile::Scene {
            is("binary data of an unknown kind", FileFamily::Other)
        } else {
            None
        };
    }
    text(bytes, head, wanted)
}

/// Whether the bytes are UTF-8, as far as they go: the last character may be cut.
fn is_utf8(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).map_or_else(|error| error.error_len().is_none(), |_| true)
}

/// Whether a byte is a control character that no encoding of text has: not a blank, an end of a line or an escape.
fn is_odd(byte: &u8) -> bool {
    *byte < 0x20 && !matches!(byte, b'\t' | b'\n' | b'\x0b' | b'\x0c' | b'\r' | 0x1b) || *byte == 0x7f
}

/// A zip archive, by the names of its first files.
fn archive(bytes: &[u8]) -> Option<Foreign> {
    let head = &bytes[..bytes.len().min(4096)];
    let (kind, family) = if has(head, b"3D/3dmodel") || has(head, b"3dmodel.model") {
        ("a 3MF model", FileFamily::Model)
    } else if has(&head[..head.len().min(256)], b".usd") {
        ("a USD scene (USDZ)", FileFamily::Model)
    } else {
        ("a zip archive", FileFamily::Archive)
    };
    Some(Foreign { kind, family })
}

/// Text of another language.
fn text(bytes: &[u8], head: &[u8], wanted: WantedFile) -> Option<Foreign> {
    let is = |kind, family| Some(Foreign { kind, family });
    let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
    if head.starts_with(b"{") {
        let (first, last) = (&bytes[..bytes.len().min(JSON_ENDS)], &bytes[bytes.len().saturating_sub(JSON_ENDS)..]);
        let has = |word: &[u8]| has(first, word) || has(last, word);
        let parts: [&[u8]; 5] = [b"\"meshes\"", b"\"nodes\"", b"\"buffers\"", b"\"accessors\"", b"\"scenes\""];
        if has(b"\"asset\"") && parts.iter().any(|part| has(part)) {
            return is("a glTF model", FileFamily::Gltf);
        }
        return if wanted == WantedFile::Scene { None } else { is("JSON text", FileFamily::Other) };
    }
    if head.starts_with(b"<") {
        let low = head.to_ascii_lowercase();
        return if has(&low, b"<collada") {
            is("a COLLADA model", FileFamily::Model)
        } else if has(&low, b"<x3d") {
            is("an X3D scene", FileFamily::Model)
        } else if has(&low, b"<amf") {
            is("an AMF model", FileFamily::Model)
        } else if has(&low, b"<scene version") {
            is("a Mitsuba scene", FileFamily::Scene)
        } else if has(&low, b"<svg") {
            is("an SVG drawing", FileFamily::Picture)
        } else if has(&low, b"<!doctype html") || has(&low, b"<html") {
            is("a web page (HTML)", FileFamily::Other)
        } else {
            is("XML", FileFamily::Other)
        };
    }
    // The first words of lines; comments begin as those of TOML do
    for line in head.split(|b| *b == b'\n').take(200) {
        let line = line.trim_ascii();
        let word = line.split(|b| b.is_ascii_whitespace() || *b == b'{').next().unwrap_or_default();
        let braced = line[word.len()..].trim_ascii_start().starts_with(b"{");
        match word {
            b"newmtl" if line.len() > word.len() => {
                return is("the materials of an OBJ file (MTL)", FileFamily::Materials);
            }
            b"#version" | b"#include" | b"#declare" | b"#local" | b"global_settings" | b"light_source"
                if braced || line.starts_with(b"#") =>
            {
                return is("a POV-Ray scene", FileFamily::Scene);
            }
            b"camera" | b"sphere" | b"plane" | b"background" if braced => {
                return is("a POV-Ray scene", FileFamily::Scene);
            }
            b"WorldBegin" | b"LookAt" | b"Film" | b"Integrator" | b"Sampler" | b"Camera"
                if line == b"WorldBegin" || has(line, b"\"") || word == b"LookAt" && !has(line, b"=") =>
            {
                return is("a pbrt scene", FileFamily::Scene);
            }
            _ => {}
        }
    }
    None
}

/// Whether `word` is anywhere in `bytes`.
fn has(bytes: &[u8], word: &[u8]) -> bool {
    let Some(first) = word.first() else { return true };
    let mut rest = bytes;
    while let Some(at) = rest.iter().position(|b| b == first) {
        if rest[at..].starts_with(word) {
            return true;
        }
        rest = &rest[at + 1..];
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_their_content() {
        let mut stl = vec![0u8; 80];
        stl.extend(1u32.to_le_bytes());
        stl.extend([0u8; 50]);
        let mut tar = vec![b'a'; 257];
        tar.extend(b"ustar\0");
        let mut bmp = b"BM\0\0\0\0\0\0\0\0\0\0\0\0".to_vec();
        bmp.extend(40u32.to_le_bytes());
        let mut max = b"MM".to_vec();
        max.extend(8u32.to_le_bytes());
        max.extend([0, 0]);
        let gltf = format!("{{ \"buffers\": [\"{}\"], \"asset\": {{}} }}", "x".repeat(3 << 20));
        let usdz = b"PK\x03\x04\x0a\0\0\0\0\0\0\0\0\0\0\0\0\0model.usdc";
        let expected: &[(&[u8], &str)] = &[
            (b"ply\nformat ascii 1.0\n", "a PLY model"),
            (b"solid a\nfacet normal 0 0 1\n", "an STL model"),
            (&stl, "an STL model"),
            (b"# a\nmtllib a.mtl\nv 1 2 3\n", "an OBJ model"),
            (b"glTF\x02\0\0\0", "a binary glTF model (GLB)"),
            (b"{ \"asset\": { \"version\": \"2.0\" }, \"meshes\": [] }", "a glTF model"),
            (gltf.as_bytes(), "a glTF model"),
            (b"\x89PNG\r\n\x1a\n\0\0", "a PNG picture"),
            (b"\xff\xd8\xff\xe0", "a JPEG picture"),
            (b"\x76\x2f\x31\x01\x02", "an OpenEXR picture"),
            (b"RIFF\0\0\0\0WEBPVP8 ", "a WebP picture"),
            (&bmp, "a BMP picture"),
            (&max, "a 3DS model"),
            (b"BLENDER-v300", "a Blender file"),
            (b"Kaydara FBX Binary  \0", "an FBX model"),
            (b"PXR-USDC\0", "a USD scene"),
            (b"#usda 1.0\n", "a USD scene"),
            (b"PK\x03\x04\0\0", "a zip archive"),
            (usdz, "a USD scene (USDZ)"),
            (b"PK\x03\x04\x00\x003D/3dmodel.model", "a 3MF model"),
            (b"\x1f\x8b\x08", "gzip-compressed data"),
            (&tar, "a tar archive"),
            (b"%PDF-1.7", "a PDF document"),
            (b"\x7fELF\x02", "a program (ELF)"),
            (b"<!DOCTYPE html><p>", "a web page (HTML)"),
            (b"\n <?xml version=\"1.0\"?>\n<COLLADA>", "a COLLADA model"),
            (b"<scene version=\"3.0.0\">", "a Mitsuba scene"),
            (b"\xff\xfea\0", "text in UTF-16"),
            (b"a\0b", "binary data of an unknown kind"),
            (b"\x8b\x1c\xd0 \x05\xe9 = 3\n", "binary data of an unknown kind"),
            (b"// a\n#include \"colors.inc\"\n", "a POV-Ray scene"),
            (b"# x\ncamera {\n location <0, 0, 1>\n}\n", "a POV-Ray scene"),
            (b"LookAt 0 0 5  0 0 0  0 1 0\n", "a pbrt scene"),
            (b"# Blender\nnewmtl clay\nKd 1 1 1\n", "the materials of an OBJ file (MTL)"),
            (b"OFF\n8 6 0\n", "an OFF mesh"),
        ];
        for (bytes, kind) in expected {
            let found = foreign(bytes, WantedFile::Scene);
            let start = String::from_utf8_lossy(&bytes[..bytes.len().min(20)]).into_owned();
            assert_eq!(found.map(|found| found.kind), Some(*kind), "{start:?}");
            let as_mesh = foreign(bytes, WantedFile::Mesh);
            let is_mesh = ["a PLY model", "an STL model", "an OBJ model"].contains(kind);
            let is_unknown = *kind == "binary data of an unknown kind";
            assert_eq!(as_mesh.map(|found| found.kind), (!is_mesh && !is_unknown).then_some(*kind), "{start:?}");
        }
    }

    #[test]
    fn scenes_are_not_foreign() {
        let texts: &[&[u8]] = &[
            b"",
            b"\xef\xbb\xbf[render]\n",
            b"# a comment\n[camera]\nposition = [0, 0, 5]\n",
            b"camera = { position = [0, 0, 5] }\n",
            b"v = 1\n",
            b"s= 1\n",
            b"o.x = 1\n",
            b"{ \"camera\": { \"position\": [0, 0, 5] } }",
            b"output_resolution 30\noutput_file course.png\n",
            b"[[sphere]]\nname = \"camera { }\"\n",
            b"\xe4\xf6",
            b"# gr\xfc\xdfe\n[camera]\n",
            b"\x01 = 3\n",
        ];
        for text in texts {
            assert_eq!(foreign(text, WantedFile::Scene), None, "{:?}", String::from_utf8_lossy(text));
        }
    }
}

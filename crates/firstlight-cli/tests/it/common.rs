//! A folder to work in, the program, and what it left behind.

use std::ffi::OsStr;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// Options that make any scene quick.
pub const QUICK: [&str; 6] = ["--width", "24", "--aa", "1", "--samples", "4"];

/// A triangle with a second variant, an animation, a camera and a light.
pub const GLTF: &str = r#"{"asset":{"version":"2.0"},"buffers":[{"byteLength":68,
"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAEAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAA="}],
"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":8},{"buffer":0,
"byteOffset":44,"byteLength":24}],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":3},
{"bufferView":1,"componentType":5126,"type":"SCALAR","count":2},{"bufferView":2,"componentType":5126,
"type":"VEC3","count":2}],"materials":[{"name":"oak","doubleSided":true},{"name":"walnut","doubleSided":true}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0,
"extensions":{"KHR_materials_variants":{"mappings":[{"variants":[1],"material":1}]}}}]}],
"cameras":[{"type":"perspective","perspective":{"yfov":1}}],"nodes":[{"name":"seat","mesh":0},{"name":"entry",
"camera":0,"translation":[0.3,0.3,3]},{"name":"lamp","translation":[0,2,2],
"extensions":{"KHR_lights_punctual":{"light":0}}}],"animations":[{"name":"fold","channels":[{"sampler":0,
"target":{"node":0,"path":"translation"}}],"samplers":[{"input":1,"output":2}]}],
"extensions":{"KHR_materials_variants":{"variants":[{"name":"light"},{"name":"dark"}]},
"KHR_lights_punctual":{"lights":[{"type":"point","intensity":20}]}}}
"#;

/// A small scene with a little of everything that needs no file. 36 x 24 pixels.
pub const SCENE: &str = "\
[render]
width = 36
height = 24
antialiasing = 2
samples = 16
ambient = 0.05

[camera.front]
position = [0, 1, 8]
look_at = [0, 1, 0]

[camera.side]
position = [6, 3, 5]
look_at = [0, 1, 0]
fov_y_deg = 35

[texture.checkerboard.tiles]
counts = [8, 8]

[material.phong.floor]
diffuse = { texture = \"tiles\" }

[material.blinn-phong.ball]
diffuse = [0.8, 0.2, 0.1]
specular = 0.5

[[parallelogram]]
p = [-5, 0, 5]
e0 = [10, 0, 0]
e1 = [0, 0, -10]
material = \"floor\"

[[sphere]]
center = [0, 1, 0]
radius = 1
material = \"ball\"

[[light.point]]
position = [4, 6, 4]
strength = 30

[[light.rectangle]]
center = [-2, 5, 0]
e0 = [2, 0, 0]
e1 = [0, 0, 2]
falloff = \"constant\"
";

/// A course file for 30 x 30 pixels.
pub const COURSE: &str = "\
output_resolution 30
output_file course.png
camera_id 2

light_id 3
num_samples 1
area_light_resolution 2
num_threads 2
";

/// A folder of a test's own, which ends with it.
pub struct Folder(TempDir);

/// What the program did.
pub struct Ran {
    pub code: Option<i32>,
    pub stdout: Vec<u8>,
    pub stderr: String,
}

impl Folder {
    pub fn new() -> Self {
        Folder(tempfile::tempdir().unwrap())
    }

    /// With the scene of this module as `scene.toml`.
    pub fn with_scene() -> Self {
        let folder = Self::new();
        folder.put("scene.toml", SCENE);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn put(&self, name: &str, text: impl AsRef<[u8]>) {
        fs::write(self.path(name), text).unwrap();
    }

    pub fn get(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}; there are {:?}", self.names()))
    }

    /// The names in the folder, hidden ones too, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// The program, to be run in this folder.
    pub fn command(&self, args: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_firstlight"));
        command.args(args).current_dir(self.0.path()).stdin(Stdio::null()).env_remove("NO_COLOR");
        command
    }

    /// Runs the words of `line`.
    pub fn run(&self, line: &str) -> Ran {
        ran(self.command(line.split_whitespace()).output().unwrap())
    }

    /// Runs the words of `line` with `input` on standard input.
    pub fn run_with_input(&self, line: &str, input: &[u8]) -> Ran {
        let mut command = self.command(line.split_whitespace());
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(input).unwrap();
        ran(child.wait_with_output().unwrap())
    }

    /// Renders `scene.toml` with the words of `options` to a PNG file, and gives its bytes.
    pub fn png(&self, options: &str) -> Vec<u8> {
        self.run(&format!("render scene.toml {options} -o of-this-call.png")).done();
        let bytes = self.get("of-this-call.png");
        fs::remove_file(self.path("of-this-call.png")).unwrap();
        bytes
    }
}

pub fn ran(output: Output) -> Ran {
    Ran {
        code: output.status.code(),
        stdout: output.stdout,
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

impl Ran {
    /// Exit code 0.
    #[track_caller]
    pub fn done(self) -> Self {
        self.exits(0)
    }

    /// This exit code, and no panic.
    #[track_caller]
    pub fn exits(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "{}", self.stderr);
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        self
    }

    /// Standard error says each of `parts`.
    #[track_caller]
    pub fn says(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.stderr.contains(part), "{part:?} is not in:\n{}", self.stderr);
        }
        self
    }

    pub fn text(&self) -> String {
        String::from_utf8(self.stdout.clone()).unwrap()
    }
}

/// A decoded PNG.
#[derive(PartialEq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub bits: u8,
    /// Of each pixel.
    pub bytes: usize,
    pub data: Vec<u8>,
}

impl Picture {
    pub fn decode(png: &[u8]) -> Self {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut data).unwrap();
        data.truncate(frame.buffer_size());
        Self {
            width: frame.width as usize,
            height: frame.height as usize,
            bits: frame.bit_depth as u8,
            bytes: frame.color_type.samples() * frame.bit_depth as usize / 8,
            data,
        }
    }

    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The bytes of a part, row by row.
    pub fn part(&self, x: usize, y: usize, width: usize, height: usize) -> Vec<u8> {
        let row = |y: usize| &self.data[(y * self.width + x) * self.bytes..][..width * self.bytes];
        (y..y + height).flat_map(row).copied().collect()
    }
}

/// The size of a PNG file.
pub fn size_of(path: &Path) -> (usize, usize) {
    Picture::decode(&fs::read(path).unwrap()).size()
}

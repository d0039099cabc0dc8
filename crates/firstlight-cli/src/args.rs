//! The command line as it is written. What it means, together with a scene, is decided in each command's own file.

mod display;
mod values;
mod words;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueHint};
use firstlight::{
    BufferDesc, ColorDesc, Flip, LightChange, MotionTo, SamplesDesc, SimdLevel, View, VisibilityMode, Window,
};

pub use display::DisplayArgs;
use values::*;
pub use values::{Frames, NamedView, Shard, Size, color};
pub use words::*;

/// The version and, where it is known, the commit: `0.1.0 (0123456789)`.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), env!("FIRSTLIGHT_COMMIT"));

/// Renders the direct light of a scene: camera ray, first surface, every light. No noise, the same bits every time
#[derive(Debug, Parser)]
#[command(name = "firstlight", version = VERSION, arg_required_else_help = true, max_term_width = 100)]
#[command(after_help = EXIT_CODES)]
#[command(args_override_self = false)]
pub struct Cli {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "\
Exit codes:
  0    done
  1    could not be done: the scene, a file or the disk
  2    wrong usage
  3    differs: diff, verify
  130  interrupted; no output is left, but the frames that were done

Environment:
  NO_COLOR  when set and not empty: no colours on the terminal";

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Renders a scene to picture files
    #[command(after_help = RENDER_EXAMPLES)]
    Render(Box<RenderArgs>),
    /// Reads and compiles a scene and says `ok`, or every fault in it
    Check(CheckArgs),
    /// Says what a scene or a model holds; of a picture its receipt
    #[command(after_help = INFO_EXAMPLES)]
    Info(InfoArgs),
    /// Lists the scenes that are built in, or prints the text of one
    Scenes(ScenesArgs),
    /// Lists what .exr and .npz files can hold of each pixel: see `render --buffers`
    Buffers,
    /// Says how two pictures differ, buffer by buffer: bits, largest difference, FLIP
    #[command(after_help = DIFF_EXAMPLES)]
    Diff(DiffArgs),
    /// Renders a picture again from its receipt, and says whether it has the same bits
    #[command(after_help = VERIFY_EXAMPLES)]
    Verify(VerifyArgs),
    /// Lights a picture again that was rendered with --buffers relight: other strengths and colours, without a render
    #[command(after_help = RELIGHT_EXAMPLES)]
    Relight(RelightArgs),
    /// Makes a picture to look at of a buffer of a file: depth in false colours with a legend, ids in colours, motion
    /// as a colour wheel
    #[command(after_help = VIEW_EXAMPLES)]
    ViewBuffer(ViewBufferArgs),
    /// Prints the JSON Schema of scene files, for completion in editors
    Schema,
    /// Prints a completion script for a shell
    Completions(CompletionsArgs),
    /// Prints the manual as roff, one page for each command: `firstlight man | man -l -`
    Man,
}

const RENDER_EXAMPLES: &str = "\
Examples:
  firstlight render
      the built-in scene config11, to config11.png
  firstlight render room.toml -o room.png -o room.exr
      one rendering, two files
  firstlight render bunny.ply --smooth 40
      a model by itself: a camera and a light are found for it
  firstlight render bunny.ply --view left --transparent --size 256
      from another side, for a page of any colour
  firstlight render models/*.ply plan.toml -o 'out/{stem}.png' --size 256
      many pictures in one call
  firstlight render models/ -o 'out/{parent}-{name}.png' --size 128,512 --summary out/log.jsonl
      all models of a folder and of those below, in two sizes, with a line of JSON for each picture
  firstlight render bunny.ply --views front,side,top,iso -o 'bunny-{view}.png'
      from four sides
  firstlight render bunny.ply --turntable 36 -o 'turn_##.png'
      from all around
  firstlight render bunny.ply --print-scene > bunny.toml
      the same as a scene, to go on from
  firstlight render room.toml --width 320 --aa 1 --samples 16
      a quick look, in the scene's own aspect ratio
  firstlight render room.toml --crop 400,300,64,64 -o detail.png
      the same pixels as in the whole picture, only fewer of them
  firstlight render room.toml --buffers color,depth,object-id -o room.npz
      what is seen, how far away and which object, as arrays for numpy
  firstlight render room.toml --frames 0..46 --buffers color,motion --motion-to next -o room.exr
      frames with the optical flow from each to the next
  firstlight render room.toml -o room.png -o depth=depth.png -o object-id=ids.png
      the same as pictures: depth in millimetres, ids as they are, both of 16 bits
  firstlight render room.toml --frames 0..47 -o train/turn_###.png --coco train.json
      pictures with masks and boxes of all objects, for training
  firstlight render config23 -o - | magick - config23.jpg
      to another program
  generate-scene | firstlight render - -o scene.png
      from another program
  firstlight render room.toml --frames 0..47 -o turn_###.exr
      two seconds at 24 frames in each, turn_000.exr to turn_047.exr
  firstlight render room.toml --stats=room.json --quiet
      what it took, for another program to read";

const DIFF_EXAMPLES: &str = "\
Exit codes: 0 the same, 3 different, 1 cannot be compared

Examples:
  firstlight diff before.png after.png
      whether they have the same bits, and if not, where and by how much
  firstlight diff before.exr after.exr --flip 0.01 -o difference.png
      as much alike as somebody sees who flips between them, with a picture of where they are not
  firstlight diff a.npz b.npz --buffers depth --max 1e-4
      depth to a tenth of a millimetre
  firstlight diff film.exr picture.png
      whether the film gives that picture";

const VERIFY_EXAMPLES: &str = "\
Exit codes: 0 the same bits, or of another version within the tolerance; 3 others; 1 cannot be rendered again, for
one because the scene is another

Examples:
  firstlight verify config11.png
      of a built-in scene
  firstlight verify out/room.exr --scene room.toml
      of a scene of one's own
  firstlight verify out/frame.0007.png --scene scenes
      of one of the scenes of a folder";

const RELIGHT_EXAMPLES: &str = "\
Examples:
  firstlight render room.toml --buffers color,relight -o room.exr
      keeps what each light sends
  firstlight relight room.exr --light key=x1.5 --light fill=#ffd0a0 -o warm.png
      one light half as strong again, another in a warmer colour";

/// Where a scene comes from.
#[derive(Args, Debug)]
pub struct SceneArgs {
    /// A scene file (.toml, .json, or a course file .txt), a model (.glb, .gltf, .obj, .ply, .stl), the name of a
    /// built-in scene such as config23 (see `firstlight scenes`; a file of such a name is ./config23), or - for
    /// standard input, a scene or a model
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub scene: PathBuf,
    #[command(flatten)]
    pub reading: ReadingArgs,
}

/// How a scene is read.
#[derive(Args, Debug)]
pub struct ReadingArgs {
    /// Makes warnings errors: a missing or damaged texture, for one [default: a warning and a placeholder]
    #[arg(long)]
    pub strict: bool,
    /// Lets the scene read files of this folder and below, besides its own folder; may be given several times [default:
    /// none]
    #[arg(long = "allow-dir", value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub allow_dir: Vec<PathBuf>,
    /// Lets the pictures of textures take up to MIB mebibytes, with their smaller copies; more is an error [default:
    /// 2048]
    #[arg(long = "texture-memory", value_name = "MIB")]
    pub texture_memory: Option<u32>,
    #[command(flatten)]
    pub model: ModelArgs,
}

/// How a model by itself is shown.
#[derive(Args, Debug, Default)]
#[command(next_help_heading = "Models (.glb, .gltf, .obj, .ply, .stl)")]
pub struct ModelArgs {
    /// What a model is lit by [default: soft]
    #[arg(long, value_name = "STUDIO")]
    pub studio: Option<StudioName>,
    /// Whether a model stands on a ground that takes its shadow [default: on in the studios soft and clay]
    #[arg(long, value_name = "ON")]
    pub ground: Option<Switch>,
    /// Which lights shine on a model: those of the studio, or those of the file, which is --studio none [default:
    /// studio]
    #[arg(long, value_name = "WHICH", conflicts_with = "studio")]
    pub lights: Option<LightSource>,
    /// The axis of a model that points upwards [default: y; z for .stl]
    #[arg(long, value_name = "AXIS")]
    pub up: Option<Axis>,
    /// Makes the normals of a model smooth where its faces meet at less than DEGREES, 0 to 180; not of glTF [default:
    /// its own normals; 30 if it has none]
    #[arg(long, value_name = "DEGREES", value_parser = angle)]
    pub smooth: Option<f64>,
    /// The variant of a glTF model, by its name [default: none]
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// The animation of a glTF model, by its name or its number from 0 on; it plays with --time and --frames [default:
    /// the first one with --time or --frames, else the model is at rest]
    #[arg(long, value_name = "NAME")]
    pub animation: Option<String>,
    /// The scene of a glTF model, by its number from 0 on [default: the one that the file shows]
    #[arg(long, value_name = "NUMBER")]
    pub gltf_scene: Option<u32>,
}

/// `firstlight render`
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// A scene file (.toml, .json, or a course file .txt), a model (.glb, .gltf, .obj, .ply, .stl), the name of a
    /// built-in scene such as config23 (see `firstlight scenes`; a file of such a name is ./config23), or - for
    /// standard input, a scene or a model. A folder stands for the models in it and in the folders below, sorted by
    /// their paths, without hidden ones and what lies behind links to folders. Several are rendered one after the
    /// other, also after one that failed
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath, default_value = "config11")]
    pub scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub reading: ReadingArgs,

    /// A picture to write: its ending, .png, .jpg, .exr, .npz, .npy or .hdr, says the format; - is standard output.
    /// With NAME= before it, one buffer by itself, as in depth=depth.png (`firstlight buffers` lists them all),
    /// rendered whatever --buffers says; a file whose own name has a = is written as ./a=b.png. {stem} in it is the
    /// scene's file name without its ending, {name} the whole of it, {parent} the name of its folder, {folder} the path
    /// of its folder below the one that was given; with several scenes one of them is needed, in --heat and --stats
    /// too. {view} and {size} are those of several views and sizes. Folders are there already, but for those that a
    /// placeholder names. May be given several times [default: the scene's name with .png, or with .render.png where
    /// that is a file not written by firstlight; a course file's output_file; in the working folder]
    #[arg(short, long = "output", value_name = "[NAME=]FILE", value_hint = ValueHint::FilePath)]
    #[arg(help_heading = "Output")]
    pub output: Vec<PathBuf>,
    /// What .exr and .npz files hold of each pixel, with commas between: color,depth,normal,object-id; `firstlight
    /// buffers` lists them all. Without color, and no other picture, no light is asked [default: the scene's, which is
    /// color unless it says otherwise]
    #[arg(long, value_name = "NAMES", value_parser = buffer, value_delimiter = ',', help_heading = "Output")]
    #[arg(hide_possible_values = true)]
    pub buffers: Option<Vec<BufferDesc>>,
    /// Whereto the buffers motion and motion-backward lead: another moment, in seconds; next or previous, the frame
    /// after or before this one; or another camera of the scene, by its name [default: the scene's]
    #[arg(long, value_name = "TIME|CAMERA", value_parser = motion_to, help_heading = "Output")]
    #[arg(allow_hyphen_values = true)]
    pub motion_to: Option<MotionTo>,
    /// Bits of each channel of PNG files: 8 or 16; depth, distance and ids always have 16 [default: 8]
    #[arg(long, value_name = "BITS", help_heading = "Output")]
    pub bits: Option<Bits>,
    /// The format of -o - and of names without an ending, such as /dev/null [default: png for -]
    #[arg(long, value_name = "FORMAT", help_heading = "Output")]
    pub format: Option<NamedFormat>,
    /// The quality of JPEG files, 1 to 100: the more, the longer they are and the less is lost. They have no alpha:
    /// what lets light through lies on black [default: 90]
    #[arg(long, value_name = "N", value_parser = quality, help_heading = "Output")]
    pub quality: Option<u8>,
    /// Units per metre of depth and distance in PNG files, 0.001 to 1000000: 1000 are millimetres, as in ScanNet and
    /// BOP; the data sets of TUM have 5000. 0 is where nothing is, and where something is farther than 65535 units:
    /// that is a warning, and an error under --strict [default: 1000]
    #[arg(long, value_name = "N", value_parser = depth_scale, help_heading = "Output")]
    pub depth_scale: Option<f64>,
    /// Store colours and shares of the pixel in EXR files in 16-bit floats, which are half as long and end at 65504.
    /// Depth, positions, normals and all else keep their 32 bits
    #[arg(long, help_heading = "Output")]
    pub half: bool,
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Pixels across, 1 to 65536; without --height, the height follows in the scene's aspect ratio [default: the
    /// scene's]
    #[arg(long, value_name = "PIXELS", value_parser = whole::<u32>(1, 65536), help_heading = "Picture")]
    pub width: Option<u32>,
    /// Pixels down, 1 to 65536; without --width, the width follows in the scene's aspect ratio [default: the scene's]
    #[arg(long, value_name = "PIXELS", value_parser = whole::<u32>(1, 65536), help_heading = "Picture")]
    pub height: Option<u32>,
    /// Pixels along the longer side, in the scene's aspect ratio (a model by itself is square), or WIDTHxHEIGHT; 1 to
    /// 65536 each. Several, with commas between, are pictures of their own: {size} in a name says which, without it
    /// a.png becomes a.512.png [default: the scene's]
    #[arg(long, value_name = "PIXELS", value_parser = size, value_delimiter = ',', help_heading = "Picture")]
    #[arg(conflicts_with_all = ["width", "height"])]
    pub size: Vec<Size>,
    /// Leaves what no surface covers transparent [default: as the scene has it]
    #[arg(long, conflicts_with = "background", help_heading = "Picture")]
    pub transparent: bool,
    /// The colour of what no surface covers: '#rrggbb', '#rgb' or a name of CSS such as orange (sRGB), or R,G,B
    /// (linear, 0 to 1e6, as in scene text) [default: the scene's]
    #[arg(long, value_name = "COLOR", value_parser = color, allow_hyphen_values = true, help_heading = "Picture")]
    pub background: Option<ColorDesc>,
    /// Where the camera of a model, or of a scene without a camera, looks from: front, back, left, right or side, top,
    /// bottom, iso, three-quarter, or AZIMUTH,ELEVATION in degrees; 0,0 is in front, on the side of +z, 90,0 on the
    /// right, on that of +x [default: three-quarter, which is 25,18]
    #[arg(long, value_name = "VIEW", value_parser = view, allow_hyphen_values = true, help_heading = "Picture")]
    pub view: Option<View>,
    /// Several such views by their names, with commas between, each a picture of its own: {view} in a name says which,
    /// without it a.png becomes a.front.png [default: one picture]
    #[arg(long, value_name = "NAMES", value_parser = named_view, value_delimiter = ',', help_heading = "Picture")]
    #[arg(conflicts_with_all = ["view", "turntable"])]
    pub views: Vec<NamedView>,
    /// N such views, 1 to 10000, around the y axis, from --view on towards the right, all from one distance: N pictures
    /// of their own, with numbers from 0 on. {view} in a name is the number, or the last row of #; without them a.png
    /// becomes a.0000.png [default: one picture]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1, 10_000), help_heading = "Picture")]
    #[arg(conflicts_with = "frames")]
    pub turntable: Option<u32>,
    /// What such a camera leaves free at least on each side of the picture, as a part of its shorter side, 0 to 0.45
    /// [default: 0.04]
    #[arg(long, value_name = "PART", value_parser = margin, help_heading = "Picture")]
    pub margin: Option<f64>,
    /// Renders only this part of the picture, in pixels from its top left corner: the same pixels as in the whole. At
    /// most 134217728 at once; larger pictures are made in parts [default: all of it]
    #[arg(long, value_name = "X,Y,WIDTH,HEIGHT", value_parser = crop, help_heading = "Picture")]
    #[arg(allow_hyphen_values = true)]
    pub crop: Option<Window>,
    /// The camera to render from, where the scene names several [default: the scene's]
    #[arg(long, value_name = "NAME", value_parser = camera, help_heading = "Picture")]
    pub camera: Option<String>,

    /// The moment to render, in seconds, where the scene has keys [default: 0]
    #[arg(long, value_name = "SECONDS", value_parser = time, allow_negative_numbers = true, help_heading = "Time")]
    pub time: Option<f64>,
    /// Renders every frame from A to B, both included; frame n is the moment n / fps, with the scene's fps. Each is a
    /// file of its own: name.png becomes name.0001.png, and the last row of # in a name says where the number stands
    /// and with how many digits at least [default: one picture, of the moment that --time says]
    #[arg(long, value_name = "A..B", value_parser = frames, conflicts_with = "time", help_heading = "Time")]
    pub frames: Option<Frames>,

    /// Renders every N-th of the pictures only, from the I-th on, for job arrays: of all frames, views and sizes of all
    /// scenes, in their order. All of 1/N to N/N write what one run without it does, under the same names; where there
    /// are fewer than N pictures, some have nothing to do, which is no error [default: 1/1]
    #[arg(long, value_name = "I/N", value_parser = shard, help_heading = "Output")]
    pub shard: Option<Shard>,

    /// Antialiasing by N x N camera rays in each pixel, 1 to 64; 4 is "4X" [default: the scene's]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1, 64), help_heading = "Quality")]
    pub aa: Option<u32>,
    /// What is done with every area light: exact, it is integrated, or the number of points that it is sampled at, 1 to
    /// 1048576 [default: the scene's, which is exact unless it says otherwise]
    #[arg(long, value_name = "N|exact", value_parser = samples, help_heading = "Quality")]
    pub samples: Option<SamplesDesc>,
    /// How edges are smoothed: full lights every camera ray, adaptive lights each surface in a pixel once where that is
    /// enough, multisample always [default: adaptive; multisample of models]
    #[arg(long, value_name = "MODE", help_heading = "Quality")]
    pub aa_mode: Option<AntialiasingMode>,
    /// How far a pixel may be off the converged picture, 0.25 to 16, in steps of an 8-bit picture: 4 is a faster
    /// preview [default: the scene's, which is 1 unless it says otherwise]
    #[arg(long, value_name = "T", value_parser = tolerance, help_heading = "Quality")]
    pub tolerance: Option<f64>,
    /// What is made of the border of light and dark on meshes with smooth normals [default: the scene's]
    #[arg(long, value_name = "WORD", help_heading = "Quality")]
    pub shadow_terminator: Option<Terminator>,
    /// Renders by the plainest code there is, slowly: every camera ray, every point of every light. The bytes are those
    /// of --aa-mode full where lights are sampled; lights that are integrated are sampled at 400 points,
    /// or at as many as --samples says
    #[arg(long, help_heading = "Quality")]
    pub reference: bool,

    /// How shadows of sampled lights are found: by shafts, which leave out all that is proved not to matter, or by
    /// tracing every sample at every camera ray, which gives the bytes of --reference, faster [default: shafts]
    #[arg(long, value_name = "HOW", value_parser = visibility(), help_heading = "Work")]
    pub visibility: Option<VisibilityMode>,
    /// Threads to render with, 1 to 1024; the picture is the same for any number [default: one for each processor, or a
    /// course file's num_threads]
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1, 1024), help_heading = "Work")]
    pub threads: Option<u16>,
    /// Pixels along a tile's edge, 8 to 64; the picture is the same for any number [default: 16]
    #[arg(long, value_name = "PIXELS", value_parser = whole::<u32>(8, 64), help_heading = "Work")]
    pub tile_size: Option<u32>,
    /// The processor's vector instructions to use; the picture is the same for any of them [default: auto]
    #[arg(long, value_name = "LEVEL", value_parser = SimdParser, help_heading = "Work")]
    pub simd: Option<SimdLevel>,

    /// Ends a picture that is not done after so many seconds, 0.001 to 1e9, with an error, and writes nothing of it:
    /// with its scene where that is read for it. A file that is being read and a tree that is being built are not
    /// stopped in the middle [default: no limit]
    #[arg(long = "max-time", value_name = "SECONDS", value_parser = limit_of_time, help_heading = "Work")]
    pub max_time: Option<f64>,
    /// Refuses a scene that takes more than so many mebibytes of memory, 1 to 16777216, before they are taken: by the
    /// sizes of its files, its triangles and points, its textures, and the pixels and buffers of the picture. The
    /// program itself takes some 20 of its own [default: no limit]
    #[arg(long = "max-memory", value_name = "MIB", value_parser = whole::<u32>(1, 1 << 24), help_heading = "Work")]
    pub max_memory: Option<u32>,

    /// Says at the end what each stage took, in seconds, rays and bytes: a table on standard error, or JSON in a file
    /// (- is standard output)
    #[arg(long, value_name = "FILE.json", require_equals = true, value_hint = ValueHint::FilePath)]
    #[arg(help_heading = "Messages")]
    pub stats: Option<Option<PathBuf>>,
    /// Writes an annotation of each object that is seen, as JSON in COCO's format: its mask and its box, where it is
    /// seen and where it would be if it were alone (amodal), its category, which is its name, and its object-id. All
    /// frames are in one file [default: none]
    #[arg(long, value_name = "FILE.json", value_hint = ValueHint::FilePath, help_heading = "Output")]
    pub coco: Option<PathBuf>,
    /// Writes a second picture that shows where the work went: from black over violet, red and orange to pale yellow,
    /// each doubling of what a pixel took a step of the same length [default: none]
    #[arg(long, value_name = "FILE.png", value_hint = ValueHint::FilePath, help_heading = "Messages")]
    pub heat: Option<PathBuf>,
    /// Writes a line of JSON for each picture as soon as it is done or has failed: input, output (a list), seconds,
    /// warnings (a list) and error (null for none). It is the log of a run, which can be read while it goes on and is
    /// left by one that is interrupted; - is standard output [default: none]
    #[arg(long, value_name = "FILE.jsonl", value_hint = ValueHint::FilePath, help_heading = "Messages")]
    pub summary: Option<PathBuf>,
    /// Renders nothing, and writes the scene as TOML: with what the options say in place of it, with the camera and the
    /// light that were found for it, all in one text. To FILE, or to standard output; the files it names are seen from
    /// there [default: renders]
    #[arg(long, value_name = "FILE.toml", require_equals = true, help_heading = "Output")]
    #[arg(value_hint = ValueHint::FilePath)]
    #[arg(conflicts_with_all = ["output", "bits", "format", "quality", "depth_scale", "half", "display", "exposure"])]
    #[arg(conflicts_with_all = ["crop", "time", "frames", "shard", "aa_mode", "reference", "visibility"])]
    #[arg(conflicts_with_all = ["threads", "tile_size", "simd", "stats", "coco", "heat"])]
    #[arg(conflicts_with_all = ["views", "turntable", "summary"])]
    pub print_scene: Option<Option<PathBuf>>,
    /// Says nothing but errors, warnings (no notes), and --stats where asked for
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

/// `firstlight check`
#[derive(Args, Debug)]
pub struct CheckArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// As JSON, for another program to read: whether it is ok, and all errors, warnings and notes
    #[arg(long)]
    pub json: bool,
}

const INFO_EXAMPLES: &str = "\
Examples:
  firstlight info room.toml
      its camera, shapes, lights, materials, textures
  firstlight info bunny.ply
      its triangles, whether its surface is closed, and what else is odd; of glTF files also
      materials, pictures, extensions, animations, variants and cameras
  firstlight info room.exr --json
      the receipt of a picture (.png, .exr, .npz, .npy, .hdr): what made it, and its buffers";

/// `firstlight info`
#[derive(Args, Debug)]
pub struct InfoArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The moment to look at, in seconds, where the scene has keys [default: 0]
    #[arg(long, value_name = "SECONDS", value_parser = time, allow_negative_numbers = true)]
    pub time: Option<f64>,
    /// As JSON, for another program to read
    #[arg(long)]
    pub json: bool,
}

/// `firstlight diff`
#[derive(Args, Debug)]
pub struct DiffArgs {
    /// A picture: .png, .jpg, .exr, .npz or .hdr; of FLIP the reference
    #[arg(value_name = "A", value_hint = ValueHint::FilePath)]
    pub a: PathBuf,
    /// Another, of the same size. Of a PNG file and one of linear light the picture is compared in the bits of the PNG
    /// file, with the exposure and the encoding that it was written with
    #[arg(value_name = "B", value_hint = ValueHint::FilePath)]
    pub b: PathBuf,
    /// The buffers to compare, with commas between [default: all that both have; one that only one has is a difference,
    /// where both files can hold buffers]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub buffers: Option<Vec<String>>,
    /// The largest difference that is allowed of a number, in the buffer's unit, of PNG files in steps of theirs; ids
    /// have to be the same [default: the bits have to be the same]
    #[arg(long, value_name = "X", value_parser = limit)]
    pub max: Option<f64>,
    /// The largest mean of FLIP that is allowed of colours, 0 to 1 [default: the bits have to be the same]
    #[arg(long, value_name = "X", value_parser = part)]
    pub flip: Option<f64>,
    /// Pixels in a degree of what an observer of FLIP sees, 1 to 1000: the distance of the eye times the pixels in a
    /// metre, over 57.3 [default: 67.02, a screen of 3840 pixels in 0.7 m, seen from 0.7 m]
    #[arg(long, value_name = "PIXELS", value_parser = pixels_per_degree, hide_default_value = true)]
    #[arg(default_value_t = Flip::PIXELS_PER_DEGREE)]
    pub ppd: f64,
    /// Stops of exposure at which FLIP sees two pictures of linear light, -64 to 64 [default: 0]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    pub exposure: Option<f64>,
    /// A picture of the difference to write: FLIP of the picture, from black, nothing is seen, to pale yellow; without
    /// a picture to compare the first buffer that differs, over its largest difference [default: none]
    #[arg(short, long = "output", value_name = "FILE.png", value_hint = ValueHint::FilePath)]
    pub output: Option<PathBuf>,
    /// As JSON, for another program to read
    #[arg(long)]
    pub json: bool,
    /// Says nothing but errors: the exit code tells
    #[arg(short, long)]
    pub quiet: bool,
}

const VIEW_EXAMPLES: &str = "\
Examples:
  firstlight view-buffer room.exr depth
      room.depth.png, with a legend in metres
  firstlight view-buffer room.npz object-id -o ids.png
      each object in a colour of its own
  firstlight view-buffer depth.npy depth --range 0,10
      an array by itself; what it is, the name says";

/// `firstlight view-buffer`
#[derive(Args, Debug)]
pub struct ViewBufferArgs {
    /// A file with buffers: .exr, .npz, .npy, .png, .jpg or .hdr
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub file: PathBuf,
    /// The buffer to look at, as `firstlight buffers` lists them; of another program's .npy file what its array is
    #[arg(value_name = "NAME")]
    pub name: String,
    /// The picture to write; - is standard output [default: FILE.NAME.png, without the ending of FILE, in the working
    /// folder]
    #[arg(short, long = "output", value_name = "FILE.png", value_hint = ValueHint::FilePath)]
    pub output: Option<PathBuf>,
    /// The numbers at the ends of the legend, in the buffer's unit; of motion B is the radius of the wheel [default:
    /// the least and the greatest finite number]
    #[arg(long, value_name = "A,B", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<[f64; 2]>,
    /// Stops of exposure of colours, -64 to 64 [default: 0]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    pub exposure: Option<f64>,
    /// Says nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// `firstlight verify`
#[derive(Args, Debug)]
pub struct VerifyArgs {
    /// A picture that firstlight wrote: .png, .jpg, .exr, .npz, .npy or .hdr
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub file: PathBuf,
    /// Its scene, or a folder that has it among its scenes and models; which one it is, the hash tells [default: a
    /// built-in scene]
    #[arg(long, value_name = "FILE_OR_DIR", value_hint = ValueHint::AnyPath)]
    pub scene: Option<PathBuf>,
    /// Lets the scene read files of this folder and below, besides its own folder; may be given several times [default:
    /// none]
    #[arg(long = "allow-dir", value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub allow_dir: Vec<PathBuf>,
    /// As JSON, for another program to read
    #[arg(long)]
    pub json: bool,
    /// Says nothing but errors: the exit code tells
    #[arg(short, long)]
    pub quiet: bool,
}

/// `firstlight relight`
#[derive(Args, Debug)]
pub struct RelightArgs {
    /// A file that was rendered with --buffers relight: .exr or .npz
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub file: PathBuf,
    /// A light and what becomes of it: NAME=x1.5 multiplies its strength, NAME=1.5 sets it, NAME=#ffd0a0 or
    /// NAME=orange (a name of CSS; sRGB) or NAME=R,G,B (linear) sets its colour. NAME may be #3, the third in scene
    /// order. May be given several times, in effect in that order
    #[arg(long, value_name = "NAME=CHANGE", value_parser = crate::relight::change, required = true)]
    pub light: Vec<(String, LightChange)>,
    /// A picture to write: its ending, .png, .jpg, .exr, .npz, .npy or .hdr, says the format. May be given several
    /// times
    #[arg(short, long = "output", value_name = "FILE", value_hint = ValueHint::FilePath, required = true)]
    pub output: Vec<PathBuf>,
    /// Bits in each channel of PNG files [default: 8]
    #[arg(long, value_name = "8|16")]
    pub bits: Option<Bits>,
    /// The quality of JPEG files, 1 to 100 [default: 90]
    #[arg(long, value_name = "N", value_parser = quality)]
    pub quality: Option<u8>,
    #[command(flatten)]
    pub display: DisplayArgs,
    /// Says nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// `firstlight scenes`
#[derive(Args, Debug)]
pub struct ScenesArgs {
    /// The scene whose text to print [default: the list of all]
    pub name: Option<String>,
}

/// `firstlight completions`
#[derive(Args, Debug)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}

//! The command line as it is written. What it means, together with a scene, is decided in each command's own file.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use firstlight::{
    BufferDesc, ColorDesc, Flip, Framing, LightChange, MotionTo, SamplesDesc, SimdLevel, View, VisibilityMode, Window,
};

/// The version and, where it is known, the commit: `0.1.0 (0123456789)`.
const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), env!("FIRSTLIGHT_COMMIT"));

/// Renders the direct light of a scene: camera ray, first surface, every light. No noise, the same bits every time
#[derive(Debug, Parser)]
#[command(name = "firstlight", version = VERSION, arg_required_else_help = true, max_term_width = 100)]
#[command(after_help = EXIT_CODES)]
#[command(disable_help_subcommand = true, args_override_self = false)]
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
    /// Says what a scene holds
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
    /// A scene file (.toml, .json, or a course file .txt), a model (.ply, .stl, .obj), the name of a built-in scene
    /// such as config23 (see `firstlight scenes`; a file of such a name is ./config23), or - for standard input, a
    /// scene or a model
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
    /// Makes the normals of a model smooth where its faces meet at less than DEGREES, 0 to 180 [default: its own
    /// normals; flat if it has none]
    #[arg(long, value_name = "DEGREES", value_parser = angle, help_heading = "Models (.ply, .stl, .obj)")]
    pub smooth: Option<f64>,
    /// The axis of a model that points upwards [default: y]
    #[arg(long, value_name = "AXIS", help_heading = "Models (.ply, .stl, .obj)")]
    pub up: Option<Axis>,
}

/// `--aa-mode`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AntialiasingMode {
    /// each surface in a pixel is lit once where its light bends little
    Adaptive,
    /// every camera ray is lit by itself
    Full,
}

/// An axis of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    /// as in glTF and most models for the screen
    Y,
    /// as in most scans and CAD programs
    Z,
}

/// The border of light and dark on smooth meshes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Terminator {
    /// as the round surface that the normals speak of would have it
    Smooth,
    /// as the facets have it
    Hard,
}

/// Reads an angle in degrees.
fn angle(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(angle) if (0.0..=180.0).contains(&angle) => Ok(angle),
        _ => Err("an angle is a number of degrees, 0 to 180".into()),
    }
}

/// `firstlight render`
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// A scene file (.toml, .json, or a course file .txt), a model (.ply, .stl, .obj), the name of a built-in scene
    /// such as config23 (see `firstlight scenes`; a file of such a name is ./config23), or - for standard input, a
    /// scene or a model. Several are rendered one after the other, also after one that failed
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath, default_value = "config11")]
    pub scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub reading: ReadingArgs,

    /// A picture to write: its ending, .png, .exr, .npz, .npy or .hdr, says the format; - is standard output. With
    /// NAME= before it, one buffer by itself, as in depth=depth.png (`firstlight buffers` lists them all), rendered
    /// whatever --buffers says; a file whose own name has a = is written as ./a=b.png. {stem} in it is the scene's file
    /// name without its ending, {name} the whole of it; with several scenes one of them is needed, in --heat and
    /// --stats too. May be given several times [default: the scene's name with .png, or with .render.png
    /// where that is a file not written by firstlight; a course file's output_file; in the working folder]
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
    /// Units per metre of depth and distance in PNG files, 0.001 to 1000000: 1000 are millimetres, as in ScanNet and
    /// BOP; the data sets of TUM have 5000. 0 is where nothing is, and where something is farther than 65535 units:
    /// that is a warning, and an error under --strict [default: 1000]
    #[arg(long, value_name = "N", value_parser = depth_scale, help_heading = "Output")]
    pub depth_scale: Option<f64>,
    /// Stops of exposure of 8- and 16-bit pictures, -64 to 64: they are multiplied by 2^EV; other files are the same
    /// with it [default: the scene's]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure, help_heading = "Output")]
    pub exposure: Option<f64>,

    /// Pixels across, 1 to 65536; without --height, the height follows in the scene's aspect ratio [default: the
    /// scene's]
    #[arg(long, value_name = "PIXELS", value_parser = whole::<u32>(1, 65536), help_heading = "Picture")]
    pub width: Option<u32>,
    /// Pixels down, 1 to 65536; without --width, the width follows in the scene's aspect ratio [default: the scene's]
    #[arg(long, value_name = "PIXELS", value_parser = whole::<u32>(1, 65536), help_heading = "Picture")]
    pub height: Option<u32>,
    /// Pixels along the longer side, in the scene's aspect ratio (a model by itself is square), or WIDTHxHEIGHT; 1 to
    /// 65536 each [default: the scene's]
    #[arg(long, value_name = "PIXELS", value_parser = size, help_heading = "Picture")]
    #[arg(conflicts_with_all = ["width", "height"])]
    pub size: Option<Size>,
    /// Leaves what no surface covers transparent [default: as the scene has it]
    #[arg(long, conflicts_with = "background", help_heading = "Picture")]
    pub transparent: bool,
    /// The colour of what no surface covers: '#rrggbb' (sRGB), or R,G,B (linear, 0 to 1e6, as in scene text) [default:
    /// the scene's]
    #[arg(long, value_name = "COLOR", value_parser = color, allow_hyphen_values = true, help_heading = "Picture")]
    pub background: Option<ColorDesc>,
    /// Where the camera of a model, or of a scene without a camera, looks from: front, back, left, right, top, bottom,
    /// iso, or AZIMUTH,ELEVATION in degrees; 0,0 is in front, on the side of +z, 90,0 on the right, on that of +x
    /// [default: 25,18]
    #[arg(long, value_name = "VIEW", value_parser = view, allow_hyphen_values = true, help_heading = "Picture")]
    pub view: Option<View>,
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

    /// Renders every N-th of the pictures only, from the I-th on, for job arrays: of all frames of all scenes, in their
    /// order. All of 1/N to N/N write what one run without it does, under the same names; where there are fewer than N
    /// pictures, some have nothing to do, which is no error [default: 1/1]
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
    /// enough [default: adaptive]
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
    /// Renders nothing, and writes the scene as TOML: with what the options say in place of it, with the camera and the
    /// light that were found for it, all in one text. To FILE, or to standard output; the files it names are seen from
    /// there [default: renders]
    #[arg(long, value_name = "FILE.toml", require_equals = true, help_heading = "Output")]
    #[arg(value_hint = ValueHint::FilePath)]
    #[arg(conflicts_with_all = ["output", "bits", "format", "depth_scale", "exposure", "crop"])]
    #[arg(conflicts_with_all = ["time", "frames", "shard", "aa_mode", "reference", "visibility"])]
    #[arg(conflicts_with_all = ["threads", "tile_size", "simd", "stats", "coco", "heat"])]
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
}

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
    /// A picture: .png, .exr, .npz or .hdr; of FLIP the reference
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
    /// A file with buffers: .exr, .npz, .npy, .png or .hdr
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub file: PathBuf,
    /// The buffer to look at, as `firstlight buffers` lists them; of an .npy file what its array is
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
    /// A picture that firstlight wrote: .png, .exr, .npz or .hdr
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
    /// A light and what becomes of it: NAME=x1.5 multiplies its strength, NAME=1.5 sets it, NAME=#ffd0a0 (sRGB) or
    /// NAME=R,G,B (linear) sets its colour. NAME may be #3, the third in scene order. May be given several times, in
    /// effect in that order
    #[arg(long, value_name = "NAME=CHANGE", value_parser = crate::relight::change, required = true)]
    pub light: Vec<(String, LightChange)>,
    /// A picture to write: its ending, .png, .exr, .npz or .hdr, says the format. May be given several times
    #[arg(short, long = "output", value_name = "FILE", value_hint = ValueHint::FilePath, required = true)]
    pub output: Vec<PathBuf>,
    /// Bits in each channel of PNG files [default: 8]
    #[arg(long, value_name = "8|16")]
    pub bits: Option<Bits>,
    /// Stops of exposure of 8- and 16-bit pictures, -64 to 64 [default: the scene's]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    pub exposure: Option<f64>,
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

/// Bits of a PNG channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Bits {
    /// 256 steps
    #[value(name = "8")]
    Eight,
    /// 65536 steps
    #[value(name = "16")]
    Sixteen,
}

/// A format by its name, where no ending says it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NamedFormat {
    /// 8 or 16 bits, display-encoded
    Png,
    /// The film itself, in 32-bit floats
    Exr,
    /// The film itself, as arrays for numpy
    Npz,
    /// One buffer, as an array for numpy
    Npy,
    /// The film itself, in Radiance's shared exponents
    Hdr,
}

/// Reads whole numbers from `least` to `most`.
fn whole<T>(least: T, most: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: std::str::FromStr + PartialOrd + std::fmt::Display + Copy + Send + Sync + 'static,
{
    move |text| match text.parse::<T>() {
        Ok(n) if least <= n && n <= most => Ok(n),
        _ => Err(format!("a whole number from {least} to {most} is needed")),
    }
}

/// Reads how shadows are found.
fn visibility() -> impl TypedValueParser<Value = VisibilityMode> {
    PossibleValuesParser::new(VisibilityMode::ALL.iter().map(|mode| mode.name()))
        .map(|name| VisibilityMode::from_name(&name).unwrap_or(VisibilityMode::Shafts))
}

/// Reads the name of a buffer.
fn buffer(name: &str) -> Result<BufferDesc, String> {
    BufferDesc::parse(name).map_err(|(fault, hint)| hint.map_or(fault.clone(), |hint| format!("{fault}; {hint}")))
}

/// Reads whereto motion leads: what reads as a number is a time.
fn motion_to(text: &str) -> Result<MotionTo, String> {
    if text.parse::<f64>().is_ok() {
        return time(text).map(MotionTo::Time);
    }
    MotionTo::from_name(text).ok_or("a time in seconds, next, previous, or the name of a camera is needed".into())
}

/// Reads the number of samples, or the word for none.
fn samples(text: &str) -> Result<SamplesDesc, String> {
    if text == "exact" {
        return Ok(SamplesDesc::Exact);
    }
    whole(1, 1_048_576)(text).map(SamplesDesc::Count).map_err(|needed| format!("{needed}, or the word exact"))
}

/// Reads the name of a camera; one without a name cannot be asked for.
fn camera(name: &str) -> Result<String, String> {
    if name.is_empty() { Err("the name of a camera of the scene is needed".into()) } else { Ok(name.to_owned()) }
}

/// Reads an exposure in stops.
fn exposure(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ev) if (-64.0..=64.0).contains(&ev) => Ok(ev),
        _ => Err("a number of stops from -64 to 64 is needed".into()),
    }
}

/// Reads the ends of a legend.
fn range(text: &str) -> Result<[f64; 2], String> {
    let range = numbers::<2>(text).filter(|[low, high]| low < high);
    range.ok_or_else(|| "two numbers A,B are needed, the lower one first, as 0,10".into())
}

/// Reads a scale of depth in units per metre.
fn depth_scale(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(scale) if (1e-3..=1e6).contains(&scale) => Ok(scale),
        _ => Err("a number of units per metre from 0.001 to 1000000 is needed; 1000 are millimetres".into()),
    }
}

/// Reads a tolerance in display steps.
fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(steps) if (0.25..=16.0).contains(&steps) => Ok(steps),
        _ => Err("a number of display steps from 0.25 to 16 is needed".into()),
    }
}

/// Reads a moment in seconds.
fn time(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(time) if (-1e9..=1e9).contains(&time) => Ok(time),
        _ => Err("a number of seconds from -1e9 to 1e9 is needed".into()),
    }
}

/// The numbers of frames, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    /// The first.
    pub first: u32,
    /// The last, not before the first.
    pub last: u32,
}

/// No frame has a larger number.
const MAX_FRAME: u32 = 9_999_999;
/// Nor are there more in one run.
const MAX_FRAMES: u32 = 100_000;

/// Reads `A..B`, or one number alone.
fn frames(text: &str) -> Result<Frames, String> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    let number = |part: &str| part.trim().parse::<u32>().ok().filter(|n| *n <= MAX_FRAME);
    match (number(first), number(last)) {
        (Some(first), Some(last)) if first <= last && last - first >= MAX_FRAMES => {
            Err(format!("at most {MAX_FRAMES} frames can be rendered in one run"))
        }
        (Some(first), Some(last)) if first <= last => Ok(Frames { first, last }),
        (Some(first), Some(last)) => Err(format!("the last frame, {last}, comes before the first, {first}")),
        _ => Err(format!("two whole numbers A..B from 0 to {MAX_FRAME} are needed, as 0..47; both are rendered")),
    }
}

/// A part of the pictures of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which, from 1 on.
    pub index: u64,
    /// Of how many.
    pub count: u64,
}

impl Shard {
    /// Whether the picture of that number, counted from 0, is one of its.
    pub fn has(self, picture: u64) -> bool {
        picture % self.count == self.index - 1
    }
}

/// Reads `I/N`.
fn shard(text: &str) -> Result<Shard, String> {
    let number = |part: &str| part.trim().parse::<u64>().ok();
    match text.split_once('/').and_then(|(index, count)| number(index).zip(number(count))) {
        Some((index, count)) if (1..=count).contains(&index) => Ok(Shard { index, count }),
        Some((0, 1..)) => Err("shards count from 1: the first of four is 1/4".into()),
        Some((index, count)) if count > 0 => {
            Err(format!("there is no shard {index} of {count}: they are 1 to {count}"))
        }
        _ => Err("two whole numbers I/N are needed, as 1/4 for the first of four".into()),
    }
}

/// Reads the largest difference that is allowed.
fn limit(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(limit) if limit >= 0.0 && limit.is_finite() => Ok(limit),
        _ => Err("a number of at least 0 is needed".into()),
    }
}

/// Reads a number from 0 to 1.
fn part(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(part) if (0.0..=1.0).contains(&part) => Ok(part),
        _ => Err("a number from 0 to 1 is needed".into()),
    }
}

/// Reads how many pixels there are in a degree.
fn pixels_per_degree(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(pixels) if (1.0..=1000.0).contains(&pixels) => Ok(pixels),
        _ => Err("a number of pixels from 1 to 1000 is needed".into()),
    }
}

/// Reads `X,Y,WIDTH,HEIGHT`. Whether the film is that large is seen once the scene is known.
fn crop(text: &str) -> Result<Window, String> {
    let wanted = "four whole numbers X,Y,WIDTH,HEIGHT are needed, in pixels, WIDTH and HEIGHT at least 1";
    let numbers: Vec<u32> = text.split(',').map(|n| n.trim().parse()).collect::<Result<_, _>>().map_err(|_| wanted)?;
    match numbers[..] {
        [x, y, width, height] if width > 0 && height > 0 => Ok(Window { x, y, width, height }),
        _ => Err(wanted.into()),
    }
}

/// `--size`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Pixels along the longer side.
    Longer(u32),
    /// Pixels across and down.
    Both(u32, u32),
}

/// Reads `PIXELS`, or `WIDTHxHEIGHT`.
fn size(text: &str) -> Result<Size, String> {
    let side = |text: &str| whole::<u32>(1, 65536)(text).ok();
    let read = match text.split_once(['x', 'X']) {
        Some((width, height)) => side(width).zip(side(height)).map(|(width, height)| Size::Both(width, height)),
        None => side(text).map(Size::Longer),
    };
    read.ok_or_else(|| "one whole number, as 256, or two, as 256x512, are needed, from 1 to 65536".into())
}

/// Reads numbers with commas between, all of them finite.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Vec<f64> = text.split(',').map(|n| n.trim().parse()).collect::<Result<_, _>>().ok()?;
    <[f64; N]>::try_from(numbers).ok().filter(|numbers| numbers.iter().all(|n| n.is_finite()))
}

/// Reads a colour.
pub fn color(text: &str) -> Result<ColorDesc, String> {
    let linear = || numbers::<3>(text).filter(|rgb| rgb.iter().all(|c| (0.0..=1e6).contains(c))).map(ColorDesc::from);
    let wanted =
        "a colour is '#' and 6 hexadecimal digits (sRGB), as '#336699', or three numbers R,G,B from 0 to 1e6 (linear)";
    ColorDesc::from_hex(text).or_else(linear).ok_or_else(|| wanted.into())
}

/// Reads where an automatic camera looks from.
fn view(text: &str) -> Result<View, String> {
    let angles = || numbers::<2>(text).filter(|[azimuth, elevation]| azimuth.abs() <= 360.0 && elevation.abs() <= 90.0);
    View::from_name(text).or_else(|| angles().map(|[azimuth, elevation]| View::new(azimuth, elevation))).ok_or_else(
        || {
            let names: Vec<&str> = View::NAMED.iter().map(|(name, _)| *name).collect();
            format!(
                "one of {}, or two angles AZIMUTH,ELEVATION from -360 to 360 and from -90 to 90 degrees are needed",
                names.join(", ")
            )
        },
    )
}

/// Reads a part of the picture's shorter side.
fn margin(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(margin) if (0.0..=Framing::MAX_MARGIN).contains(&margin) => Ok(margin),
        _ => Err("a part of the picture's shorter side is needed, from 0 to 0.45".into()),
    }
}

/// Reads the name of a SIMD level; completions and help list them all, whatever this machine has.
#[derive(Clone)]
struct SimdParser;

impl clap::builder::TypedValueParser for SimdParser {
    type Value = SimdLevel;

    fn parse_ref(
        &self,
        cmd: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<SimdLevel, clap::Error> {
        let names = clap::builder::PossibleValuesParser::new(SimdLevel::ALL.iter().map(|level| level.name()));
        let name = names.parse_ref(cmd, arg, value)?;
        SimdLevel::from_name(&name).ok_or_else(|| clap::Error::new(clap::error::ErrorKind::InvalidValue))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = clap::builder::PossibleValue> + '_>> {
        Some(Box::new(SimdLevel::ALL.iter().map(|level| clap::builder::PossibleValue::new(level.name()))))
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_crop_is_four_numbers_with_some_pixels() {
        assert_eq!(crop("1,2,3,4"), Ok(Window { x: 1, y: 2, width: 3, height: 4 }));
        for bad in ["", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,0", "-1,2,3,4", "1,2,3,x", "1.5,0,1,1"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn frames_are_two_numbers_in_their_order() {
        assert_eq!(frames("0..47"), Ok(Frames { first: 0, last: 47 }));
        assert_eq!(frames("7..7"), frames("7"));
        for bad in [
            "",
            "..",
            "1..",
            "..2",
            "2..1",
            "-1..2",
            "1..2..3",
            "1...2",
            "1..=2",
            "0..10000000",
            "0..100000",
            "a..b",
            "1.5..2",
        ] {
            assert!(frames(bad).is_err(), "{bad}");
        }
        assert!(time("-0.5").is_ok() && time("inf").is_err() && time("nan").is_err() && time("2e9").is_err());
    }

    #[test]
    fn shards_are_parts_of_a_whole() {
        assert_eq!(shard("2/3"), Ok(Shard { index: 2, count: 3 }));
        for bad in ["", "1", "/", "1/", "/2", "0/2", "3/2", "0/0", "1/0", "-1/2", "1/2/3", "a/b", "1.5/2"] {
            assert!(shard(bad).is_err(), "{bad}");
        }
        // Every picture is in one of them
        for picture in 0..10 {
            assert_eq!((1..=4).filter(|index| Shard { index: *index, count: 4 }.has(picture)).count(), 1);
        }
        assert!(limit("0").is_ok() && limit("-1").is_err() && limit("nan").is_err() && limit("inf").is_err());
        assert!(part("1").is_ok() && part("1.1").is_err() && part("nan").is_err());
        assert!(pixels_per_degree("67").is_ok() && pixels_per_degree("0.5").is_err());
    }

    #[test]
    fn a_size_is_one_side_or_both() {
        assert_eq!((size("256"), size("256x512")), (Ok(Size::Longer(256)), Ok(Size::Both(256, 512))));
        for bad in ["", "0", "65537", "x", "1x", "x1", "1x2x3", "1x0", "-1", "1.5", "256 512"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_colour_is_srgb_or_linear() {
        assert_eq!((color("#ffffff"), color("0, 0.5,2")), (Ok(ColorDesc::WHITE), Ok(ColorDesc::linear(0.0, 0.5, 2.0))));
        for bad in ["", "white", "#fff", "ffffff", "#gggggg", "1,2", "1,2,3,4", "-1,0,0", "nan,0,0", "1e7,0,0", "0.5"] {
            assert!(color(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_view_is_a_name_or_two_angles() {
        assert_eq!((view("left"), view("-30,15.5")), (Ok(View::new(-90.0, 0.0)), Ok(View::new(-30.0, 15.5))));
        for bad in ["", "Left", "above", "30", "1,2,3", "0,91", "361,0", "nan,0", "inf,0"] {
            assert!(view(bad).is_err(), "{bad}");
        }
        assert!(margin("0").is_ok() && margin("0.45").is_ok() && margin("0.5").is_err() && margin("-0.1").is_err());
    }

    #[test]
    fn an_exposure_is_finite_and_in_range() {
        assert_eq!(exposure("-1.5"), Ok(-1.5));
        for bad in ["", "nan", "inf", "65", "-64.1", "1,5"] {
            assert!(exposure(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_tolerance_is_in_range() {
        assert_eq!((tolerance("4"), tolerance("0.25")), (Ok(4.0), Ok(0.25)));
        for bad in ["", "nan", "inf", "0", "0.2", "16.1", "-1", "1/4"] {
            assert!(tolerance(bad).is_err(), "{bad}");
        }
    }
}

//! Options whose values are words: each is an enum, and the comment of a word is what `--help` says of it.

use clap::ValueEnum;

/// `--studio`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StudioName {
    /// three area lights, and a ground that takes their shadow
    Soft,
    /// two directional lights, of which one casts shadows: the quickest
    Hard,
    /// no light: every material shows its colour
    Flat,
    /// as soft, with every material a light warm gray
    Clay,
    /// the lights of the file, and nothing else
    None,
}

/// Something that is or is not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// it is there
    On,
    /// it is not
    Off,
}

/// `--lights`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LightSource {
    /// the lights of the studio
    Studio,
    /// the lights of the file
    File,
}

/// `--aa-mode`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AntialiasingMode {
    /// each surface in a pixel is lit once where its light bends little
    Adaptive,
    /// every camera ray is lit by itself
    Full,
    /// each smooth part of a surface in a pixel is lit once, as graphics processors do
    Multisample,
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
    /// 8 bits with losses, display-encoded
    #[value(alias = "jpg")]
    Jpeg,
}

//! Which kind of picture file.

use std::path::Path;

use super::ImageError;

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG, 8 bits a channel, display-encoded, straight alpha.
    Png8,
    /// PNG, 16 bits a channel, display-encoded, straight alpha.
    Png16,
    /// OpenEXR, 32-bit floats, the film as it is: linear Rec. 709, alpha premultiplied.
    Exr,
    /// Arrays for numpy, 32-bit floats: as EXR.
    Npz,
    /// One array for numpy, 32-bit floats or whole numbers; behind it a second, the receipt.
    Npy,
    /// Radiance RGBE: linear Rec. 709 with a shared exponent; alpha is left out.
    Hdr,
}

impl Format {
    /// By the ending of a file's name, in capitals or not: `.png` (8 bits), `.exr`, `.npz`, `.npy`, `.hdr`.
    ///
    /// # Errors
    /// [`ImageError::UnknownEnding`] for any other; [`ImageError::WithoutExr`] for `.exr` in a build without it.
    pub fn from_path(path: &Path) -> Result<Format, ImageError> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        match ending.as_str() {
            "png" => Ok(Format::Png8),
            "exr" if cfg!(feature = "exr") => Ok(Format::Exr),
            "exr" => Err(ImageError::WithoutExr),
            "npz" => Ok(Format::Npz),
            "npy" => Ok(Format::Npy),
            "hdr" => Ok(Format::Hdr),
            _ => Err(ImageError::UnknownEnding { path: path.to_path_buf() }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings() {
        let of = |p: &str| Format::from_path(Path::new(p));
        assert_eq!(of("a/b.png").unwrap(), Format::Png8);
        assert_eq!(of("b.tar.HDR").unwrap(), Format::Hdr);
        #[cfg(feature = "exr")]
        assert_eq!(of("B.ExR").unwrap(), Format::Exr);
        #[cfg(not(feature = "exr"))]
        assert!(of("b.exr").unwrap_err().to_string().contains("feature `exr`"));
        let words = |p: &str| of(p).unwrap_err().to_string();
        assert_eq!(
            words("out/b.jpg"),
            "out/b.jpg: \".jpg\" is not the ending of a picture; use .png, .exr, .npz, .npy or .hdr"
        );
        assert_eq!(
            words(".png"),
            ".png: has no ending that says which kind of picture to write; use .png, .exr, .npz, .npy or .hdr"
        );
    }
}

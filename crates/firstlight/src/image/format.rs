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
    /// JPEG, 8 bits a channel, display-encoded, with losses; alpha is left out.
    Jpeg,
}

impl Format {
    /// By the ending of a file's name, in capitals or not: `.png` (8 bits), `.exr`, `.npz`, `.npy`, `.hdr`,
    /// `.jpg` or `.jpeg`.
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
            "jpg" | "jpeg" => Ok(Format::Jpeg),
            _ => Err(ImageError::UnknownEnding { path: path.to_path_buf() }),
        }
    }

    /// Whether its files show colours as a display does, in 8 or 16 bits, and not as the film holds them.
    pub fn is_display_encoded(self) -> bool {
        matches!(self, Format::Png8 | Format::Png16 | Format::Jpeg)
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
        assert_eq!((of("b.jpg").unwrap(), of("b.JPEG").unwrap()), (Format::Jpeg, Format::Jpeg));
        #[cfg(feature = "exr")]
        assert_eq!(of("B.ExR").unwrap(), Format::Exr);
        #[cfg(not(feature = "exr"))]
        assert!(of("b.exr").unwrap_err().to_string().contains("feature `exr`"));
        let words = |p: &str| of(p).unwrap_err().to_string();
        assert_eq!(
            words("out/b.gif"),
            "out/b.gif: \".gif\" is not the ending of a picture; use .png, .jpg, .exr, .npz, .npy or .hdr"
        );
        assert_eq!(
            words(".png"),
            ".png: has no ending that says which kind of picture to write; use .png, .jpg, .exr, .npz, .npy or .hdr"
        );
    }
}

//! Planes of numbers by themselves, apart from a film: given away by one, or brought by somebody else.

use super::{FileSettings, Format, Image, ImageError, NamedPlane, PlaneFile, PlaneNumbers, Receipt, Window};

/// The numbers of a plane as [`Film::into_planes`](crate::Film::into_planes) gives them away: the window's rows from
/// the top, each from the left, the channels of a pixel side by side.
#[derive(Clone, Debug, PartialEq)]
pub enum PlaneVec {
    /// 32-bit floats.
    Floats(Vec<f32>),
    /// 32-bit whole numbers: ids.
    Wholes(Vec<u32>),
}

impl PlaneVec {
    /// The numbers, lent.
    pub fn numbers(&self) -> PlaneNumbers<'_> {
        match self {
            PlaneVec::Floats(numbers) => PlaneNumbers::Floats(numbers),
            PlaneVec::Wholes(numbers) => PlaneNumbers::Wholes(numbers),
        }
    }
}

/// The bytes of a file that holds planes of `window`, a part of a film of `film` pixels. As
/// [`Film::encode`](crate::Film::encode), for numbers that are no film's any more.
///
/// # Errors
/// A plane that does not fill the window or has numbers of another kind; a window outside the film; a format that holds
/// one buffer alone, or not such numbers; a receipt outside what it may be.
pub fn encode_planes(
    film: [u32; 2],
    window: Window,
    planes: &[NamedPlane<'_>],
    format: Format,
    settings: &FileSettings,
    receipt: &Receipt,
) -> Result<Vec<u8>, ImageError> {
    let pixels = u64::from(window.width) * u64::from(window.height);
    for NamedPlane { name, plane, numbers } in planes {
        let (length, is_whole) = (numbers.count(), matches!(numbers, PlaneNumbers::Wholes(_)));
        if is_whole != plane.is_whole() || length as u64 != pixels * plane.channels().len() as u64 {
            let kind = plane.number_type();
            let fault = format!("{length} numbers do not fill the plane {name}, {kind}, of {pixels} pixels");
            return Err(ImageError::Picture(fault));
        }
    }
    let twice =
        planes.iter().enumerate().find(|(i, named)| planes[..*i].iter().any(|before| before.name == named.name));
    if let Some((_, NamedPlane { name, .. })) = twice {
        return Err(ImageError::Picture(format!("two planes are called {name}")));
    }
    if planes.is_empty() {
        return Err(ImageError::Picture("there are no planes".into()));
    }
    Image::check_window(film, window)?;
    PlaneFile { film, window, planes }.encode(format, settings, receipt)
}

#[cfg(test)]
mod tests {
    use super::super::Plane;
    use super::*;

    #[test]
    fn planes_are_whole_or_refused() {
        let window = Window { x: 1, y: 0, width: 2, height: 3 };
        let (depth, ids) = (vec![1.0; 6], vec![7; 6]);
        let encode = |planes: &[NamedPlane<'_>], window: Window| {
            encode_planes([4, 4], window, planes, Format::Npz, &FileSettings::default(), &Receipt::default())
        };
        let (floats, wholes) = (PlaneNumbers::Floats(&depth), PlaneNumbers::Wholes(&ids));
        assert!(
            encode(&[NamedPlane::new(Plane::Depth, floats), NamedPlane::new(Plane::ObjectId, wholes)], window).is_ok()
        );
        for planes in [
            &[NamedPlane::new(Plane::Depth, wholes)][..],
            &[NamedPlane::new(Plane::Uv, floats)],
            &[NamedPlane::new(Plane::Depth, floats), NamedPlane::new(Plane::Depth, floats)],
            &[],
        ] {
            assert!(matches!(encode(planes, window), Err(ImageError::Picture(_))), "{planes:?}");
        }
        let outside = Window { x: 3, ..window };
        assert!(matches!(encode(&[NamedPlane::new(Plane::Depth, floats)], outside), Err(ImageError::Picture(_))));
        assert_eq!(PlaneVec::Wholes(ids.clone()).numbers(), wholes);
    }
}

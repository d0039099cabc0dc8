//! Where a panic of a decoder ends.
//!
//! The decoders of PNG, JPEG, HDR and EXR belong to others, and some of them panic on some damaged files. What is known
//! to do so is refused before they see it (`damage.rs`); what is left ends here, as a damaged picture. All decoding of
//! pictures goes through [`contained`].

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::ImageError;

thread_local! {
    static DECODING: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread is decoding a picture, so that a panic would be caught and become [`ImageError::Damaged`].
///
/// The library sets no panic hook, and the hook that is there speaks of every panic, of those that are caught as well.
/// A program that does not want to hear of them asks here:
///
/// ```
/// let hook = std::panic::take_hook();
/// std::panic::set_hook(Box::new(move |panic| {
///     if !firstlight::is_decoding() {
///         hook(panic);
///     }
/// }));
/// ```
pub fn is_decoding() -> bool {
    DECODING.get()
}

/// Runs a decoder; a panic of it is a damaged picture. The decoder owns all that it changes, and none of it is seen
/// after a panic.
pub(super) fn contained<T>(
    format: &'static str,
    decode: impl FnOnce() -> Result<T, ImageError>,
) -> Result<T, ImageError> {
    let outer = DECODING.replace(true);
    let result = catch_unwind(AssertUnwindSafe(decode));
    DECODING.set(outer);
    result.unwrap_or_else(|_| Err(ImageError::Damaged { format, reason: "its decoder failed on it".into() }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_inside_is_a_damaged_picture() {
        let seen = Cell::new(false);
        let result: Result<(), ImageError> = contained("PNG", || {
            seen.set(is_decoding());
            // As the decoders of others have it
            std::panic::resume_unwind(Box::new("index out of bounds"));
        });
        let words = result.unwrap_err().to_string();
        assert_eq!(words, "is a damaged PNG file: its decoder failed on it; write or fetch it anew");
        assert!(seen.get() && !is_decoding());
        assert_eq!(contained("PNG", || Ok(7)).unwrap(), 7);
        assert!(!is_decoding());
    }

    #[test]
    fn other_threads_are_not_inside() {
        let other = || std::thread::spawn(is_decoding).join().unwrap_or(true);
        assert!(!contained("PNG", || Ok(other())).unwrap());
    }
}

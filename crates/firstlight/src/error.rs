//! What can go wrong, as data: the library never prints and never exits.

use std::fmt;

/// Where in a text something stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file, as the user named it or relative to the scene's folder.
    pub file: String,
    /// 1-based.
    pub line: u32,
    /// 1-based, in characters.
    pub column: u32,
    /// The whole line, without its end; shortened around the column when very long.
    pub excerpt: String,
    /// Characters of the excerpt before the fault (differs from `column - 1` only in a shortened excerpt).
    pub offset: u32,
    /// Characters the fault spans on that line, at least 1.
    pub width: u32,
}

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Nothing can be rendered.
    Error,
    /// Rendering goes on; an error under `strict`.
    Warning,
}

/// One fault, with its place, the value, what is allowed, and what to do.
///
/// Displays as `scene.toml:14:9: light.spot[2].cone_deg: 190 is outside (0, 180]; the cone is the full angle, not half`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Error or warning.
    pub severity: Severity,
    /// Where, when the description came from a text.
    pub place: Option<Place>,
    /// The path of the value in the description, `light.spot[2].cone_deg`; empty for the file as a whole.
    pub path: String,
    /// The fault with the value and what is allowed, without a full stop.
    pub message: String,
    /// What to do.
    pub hint: Option<String>,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{}:{}:{}: ", place.file, place.line, place.column)?;
        }
        if !self.path.is_empty() {
            write!(f, "{}: ", self.path)?;
        }
        f.write_str(&self.message)?;
        if let Some(hint) = &self.hint {
            write!(f, "; {hint}")?;
        }
        Ok(())
    }
}

/// A scene cannot be rendered: every fault found, in the order of the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneError {
    /// All of them; never empty.
    pub faults: Vec<Diagnostic>,
}

impl std::error::Error for SceneError {}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, fault) in self.faults.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            fault.fmt(f)?;
        }
        Ok(())
    }
}

//! What can go wrong, as data: the library never prints and never exits.

use std::borrow::Cow;
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
    /// Nothing is wrong for certain, but the picture may surprise; never an error.
    Advice,
}

/// One fault, with its place, the value, what is allowed, and what to do.
///
/// Displays as `scene.toml:14:9: light.spot[2].cone_deg: 190 is outside (0, 180]; the cone is the full angle, not
/// half`.
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

/// Control characters, and those that change the direction of text or cannot be seen, are escaped.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{}:{}:{}: ", printable(&place.file), place.line, place.column)?;
        }
        if !self.path.is_empty() {
            write!(f, "{}: ", printable(&self.path))?;
        }
        f.write_str(&printable(&self.message))?;
        if let Some(hint) = &self.hint {
            write!(f, "; {}", printable(hint))?;
        }
        Ok(())
    }
}

/// Text of others as it can be shown on a terminal, on one line: control characters, and those that change the
/// direction of text or cannot be seen, are escaped as in Rust, `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    let hidden = |c: char| {
        c.is_control()
            || matches!(c, '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{feff}')
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}')
            || matches!(c, '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
    };
    if !text.chars().any(hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if hidden(c) {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_could_disturb_a_terminal_is_escaped() {
        assert!(matches!(printable("a \u{e4} \u{1f600}"), Cow::Borrowed(_)));
        assert_eq!(printable("a\u{1b}[2J\u{7}\n\tb"), "a\\u{1b}[2J\\u{7}\\n\\tb");
        assert_eq!(printable("\u{202e}a\u{9b}\u{200b}"), "\\u{202e}a\\u{9b}\\u{200b}");
        let diagnostic = Diagnostic {
            severity: Severity::Error,
            place: None,
            path: "a\u{1b}".into(),
            message: "b\u{1b}".into(),
            hint: Some("c\u{1b}".into()),
        };
        assert_eq!(diagnostic.to_string(), "a\\u{1b}: b\\u{1b}; c\\u{1b}");
    }
}

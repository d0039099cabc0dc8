//! The picture with its legend beside it, and the letters for that.

use super::Rgb8;
use super::colors::flow;
use super::scale::Scale;

/// What the colours of a picture stand for.
pub(super) enum Legend {
    /// Numbers along a colour map.
    Bar { scale: Scale, unit: &'static str },
    /// Ways on the colour wheel, up to so many pixels.
    Wheel { radius: f64 },
}

/// Pixels to draw on.
pub(super) struct Canvas {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<Rgb8>,
}

const PAPER: Rgb8 = [255; 3];
const INK: Rgb8 = [40; 3];

/// Letters of 5 x 7 pixels, each row in five bits, the left one highest.
const LETTERS: [(char, [u8; 7]); 23] = [
    ('0', [14, 17, 19, 21, 25, 17, 14]),
    ('1', [4, 12, 4, 4, 4, 4, 14]),
    ('2', [14, 17, 1, 2, 4, 8, 31]),
    ('3', [31, 2, 4, 2, 1, 17, 14]),
    ('4', [2, 6, 10, 18, 31, 2, 2]),
    ('5', [31, 16, 30, 1, 1, 17, 14]),
    ('6', [6, 8, 16, 30, 17, 17, 14]),
    ('7', [31, 1, 2, 4, 8, 8, 8]),
    ('8', [14, 17, 17, 14, 17, 17, 14]),
    ('9', [14, 17, 17, 15, 1, 2, 12]),
    ('.', [0, 0, 0, 0, 0, 12, 12]),
    ('-', [0, 0, 0, 31, 0, 0, 0]),
    ('+', [0, 4, 4, 31, 4, 4, 0]),
    (' ', [0; 7]),
    ('a', [0, 0, 14, 1, 15, 17, 15]),
    ('e', [0, 0, 14, 17, 31, 16, 14]),
    ('m', [0, 0, 26, 21, 21, 17, 17]),
    ('p', [0, 0, 30, 17, 30, 16, 16]),
    ('r', [0, 0, 22, 25, 16, 16, 16]),
    ('s', [0, 0, 14, 16, 14, 1, 30]),
    ('x', [0, 0, 17, 10, 4, 10, 17]),
    ('y', [0, 0, 17, 17, 15, 1, 14]),
    ('?', [14, 17, 1, 2, 4, 0, 4]),
];
/// From one letter to the next.
const ADVANCE: u32 = 6;
const LETTER_HEIGHT: u32 = 7;

impl Canvas {
    /// A picture whose pixels are squares of `larger` x `larger`.
    pub fn enlarged(picture: &[Rgb8], [width, height]: [u32; 2], larger: u32) -> Canvas {
        let (across, down) = (width * larger, height * larger);
        let at = |x: u32, y: u32| picture[(y / larger) as usize * width as usize + (x / larger) as usize];
        let pixels = (0..down).flat_map(|y| (0..across).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect();
        Canvas { width: across, height: down, pixels }
    }

    /// With a legend on its right, if it has one.
    pub fn with_legend(self, legend: Option<&Legend>) -> Canvas {
        let Some(legend) = legend else { return self };
        // Letters grow with the picture
        let unit = (self.height.min(4 * self.width) / 360).max(1);
        let extra = match legend {
            Legend::Bar { .. } => (16 + 12 + 9 * ADVANCE + 6) * unit,
            Legend::Wheel { .. } => 92 * unit,
        };
        let (left, height) = (self.width, self.height.max(110 * unit));
        let mut canvas = Canvas { width: left + extra, height, pixels: Vec::new() };
        canvas.pixels = vec![PAPER; canvas.width as usize * height as usize];
        let rows = canvas.pixels.chunks_exact_mut(canvas.width as usize);
        for (to, from) in rows.zip(self.pixels.chunks_exact(left as usize)) {
            to[..left as usize].copy_from_slice(from);
        }
        match legend {
            Legend::Bar { scale, unit: word } => canvas.bar(left, unit, scale, word),
            Legend::Wheel { radius } => canvas.wheel(left, unit, *radius),
        }
        canvas
    }

    fn set(&mut self, x: u32, y: u32, color: Rgb8) {
        if x < self.width && y < self.height {
            self.pixels[y as usize * self.width as usize + x as usize] = color;
        }
    }

    fn fill(&mut self, [x, y, width, height]: [u32; 4], color: Rgb8) {
        for (row, column) in (y..y + height).flat_map(|row| (x..x + width).map(move |column| (row, column))) {
            self.set(column, row, color);
        }
    }

    /// Letters from a top left corner on, each pixel a square of `unit` x `unit`.
    fn write(&mut self, x: u32, y: u32, unit: u32, text: &str) {
        for (number, wanted) in (0..).zip(text.chars()) {
            let letter = LETTERS.iter().find(|(letter, _)| *letter == wanted).unwrap_or(&LETTERS[LETTERS.len() - 1]);
            for (row, bits) in (0..).zip(letter.1) {
                for column in (0..5).filter(|column| bits >> (4 - column) & 1 == 1) {
                    self.fill([x + (number * ADVANCE + column) * unit, y + row * unit, unit, unit], INK);
                }
            }
        }
    }

    /// The colour map, the lowest number at the bottom, with numbers beside it and their unit above.
    fn bar(&mut self, left: u32, unit: u32, scale: &Scale, word: &str) {
        let (bar, top) = (left + 8 * unit, 20 * unit);
        let length = self.height - top - 10 * unit;
        for row in 0..length {
            let place = 1.0 - (f64::from(row) + 0.5) / f64::from(length);
            self.fill([bar, top + row, 12 * unit, 1], scale.color(place));
        }
        self.write(bar, 6 * unit, unit, word);
        let count = (length / (26 * unit)).clamp(2, 10) as usize;
        for (tick, text) in scale.ticks(count) {
            let Some(place) = scale.place(tick) else { continue };
            let row = top + ((1.0 - place) * f64::from(length - 1)).round() as u32;
            self.fill([bar + 12 * unit, row, 4 * unit, unit], INK);
            self.write(bar + 19 * unit, row.saturating_sub(LETTER_HEIGHT * unit / 2), unit, &text);
        }
    }

    /// The colour wheel, with the way at its rim below.
    fn wheel(&mut self, left: u32, unit: u32, radius: f64) {
        let (size, x, y) = (76 * unit, left + 8 * unit, 8 * unit);
        for (row, column) in (0..size).flat_map(|row| (0..size).map(move |column| (row, column))) {
            let [h, v] = [column, row].map(|at| (f64::from(at) + 0.5) / f64::from(size) * 2.0 - 1.0);
            if h * h + v * v <= 1.0 {
                self.set(x + column, y + row, flow(h, v));
            }
        }
        let number = match radius {
            radius if (0.01..1e5).contains(&radius) => {
                format!("{radius:.prec$}", prec = if radius < 10.0 { 2 } else { 1 })
            }
            radius => format!("{radius:.1e}"),
        };
        let text = format!("{number} px");
        let width = text.chars().count() as u32 * ADVANCE * unit;
        self.write(x + (size.saturating_sub(width)) / 2, y + size + 8 * unit, unit, &text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_letter_for_all_that_is_written() {
        for text in ["0123456789.-+e", "m", "px", "rays", " "] {
            assert!(text.chars().all(|c| LETTERS.iter().any(|(letter, _)| *letter == c)), "{text}");
        }
        let rows = LETTERS.iter().flat_map(|(_, rows)| rows);
        assert!(rows.into_iter().all(|row| *row < 32));
    }
}

//! Small plots for the book: SVG with logarithmic axes, dark on light paper, so that every page can show the file.

use std::fmt::Write as _;

/// Points that belong together.
pub(crate) struct Line {
    pub name: &'static str,
    pub dashed: bool,
    /// Both numbers above 0, from left to right.
    pub points: Vec<[f64; 2]>,
}

/// What is drawn.
pub(crate) struct Plot<'a> {
    pub across: &'a str,
    pub up: &'a str,
    pub lines: &'a [Line],
}

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 340.0;
/// Left, right, top, bottom: the rectangle of the axes.
const FRAME: [f64; 4] = [64.0, 470.0, 16.0, 290.0];

/// Powers of ten below and above all numbers.
fn decades(numbers: impl Iterator<Item = f64>) -> [i32; 2] {
    let (least, most) = numbers.fold((f64::MAX, f64::MIN_POSITIVE), |(a, b), x| (a.min(x), b.max(x)));
    // Within a hundredth: 999 698 triangles are a million
    let low = pxfm::f_log10(least * 1.01).floor() as i32;
    [low, (pxfm::f_log10(most * 0.99).ceil() as i32).max(low + 1)]
}

/// A power of ten as people write it.
fn label(power: i32) -> String {
    match power {
        6.. => format!("{} M", 10u64.pow(power as u32 - 6)),
        3..6 => format!("{} k", 10u64.pow(power as u32 - 3)),
        0..3 => format!("{}", 10u64.pow(power as u32)),
        _ => format!("{:.*}", power.unsigned_abs() as usize, pxfm::f_exp10(f64::from(power))),
    }
}

impl Plot<'_> {
    /// As SVG.
    pub fn svg(&self) -> String {
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let [x, y] = [decades(points().map(|p| p[0])), decades(points().map(|p| p[1]))];
        let [left, right, top, bottom] = FRAME;
        let place = |value: f64, [low, high]: [i32; 2], from: f64, to: f64| {
            from + (pxfm::f_log10(value) - f64::from(low)) / f64::from(high - low) * (to - from)
        };
        let across = |value| place(value, x, left, right);
        let up = |value| place(value, y, bottom, top);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" role=\"img\" \
             fill=\"currentColor\" font-family=\"sans-serif\" font-size=\"12\" color=\"#26292e\">\n<title>{} against \
             {}</title>\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fbfaf7\" stroke=\"none\"/>\n",
            self.up, self.across
        );
        // Axes, with a line for each power of ten
        let ruled = |svg: &mut String, [x0, y0]: [f64; 2], [x1, y1]: [f64; 2]| {
            let _ = writeln!(
                svg,
                "<line x1=\"{x0:.1}\" y1=\"{y0:.1}\" x2=\"{x1:.1}\" y2=\"{y1:.1}\" stroke=\"currentColor\" \
                 stroke-opacity=\"0.25\"/>"
            );
        };
        let text = |svg: &mut String, [x, y]: [f64; 2], more: &str, words: &str| {
            let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\"{more}>{words}</text>");
        };
        for power in x[0]..=x[1] {
            let at = across(pxfm::f_exp10(f64::from(power)));
            ruled(&mut svg, [at, top], [at, bottom]);
            text(&mut svg, [at, bottom + 18.0], " text-anchor=\"middle\"", &label(power));
        }
        for power in y[0]..=y[1] {
            let at = up(pxfm::f_exp10(f64::from(power)));
            ruled(&mut svg, [left, at], [right, at]);
            text(&mut svg, [left - 8.0, at + 4.0], " text-anchor=\"end\"", &label(power));
        }
        text(&mut svg, [(left + right) * 0.5, bottom + 40.0], " text-anchor=\"middle\"", self.across);
        let middle = (top + bottom) * 0.5;
        let turned = format!(" text-anchor=\"middle\" transform=\"rotate(-90 16 {middle:.1})\"");
        text(&mut svg, [16.0, middle], &turned, self.up);
        // The lines, each with its name at its right end; names that would meet are moved apart
        let mut named: Vec<(f64, &str)> = Vec::new();
        for line in self.lines {
            let path: Vec<_> = line.points.iter().map(|p| format!("{:.1},{:.1}", across(p[0]), up(p[1]))).collect();
            let dashes = if line.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"currentColor\" stroke-width=\"2\"{dashes}/>",
                path.join(" ")
            );
            if !line.dashed {
                for p in &line.points {
                    let _ = writeln!(svg, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\"/>", across(p[0]), up(p[1]));
                }
            }
            if let Some(end) = line.points.last() {
                named.push((up(end[1]) + 4.0, line.name));
            }
        }
        named.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut above = f64::MIN;
        for (at, name) in named {
            let at = at.max(above + 15.0);
            text(&mut svg, [right + 8.0, at], "", name);
            above = at;
        }
        svg.push_str("</svg>\n");
        svg
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_all_points() {
        assert_eq!(decades([968.0, 999_698.0].into_iter()), [2, 6]);
        assert_eq!(decades([0.1, 0.1].into_iter()), [-1, 0]);
        let labels: Vec<_> = [-2, 0, 3, 5, 6].into_iter().map(label).collect();
        assert_eq!(labels, ["0.01", "1", "1 k", "100 k", "1 M"]);
        let lines = [Line { name: "line", dashed: false, points: vec![[10.0, 1.0], [100.0, 10.0]] }];
        let svg = Plot { across: "x", up: "y", lines: &lines }.svg();
        assert!(svg.contains("points=\"64.0,290.0 470.0,16.0\""), "{svg}");
    }
}

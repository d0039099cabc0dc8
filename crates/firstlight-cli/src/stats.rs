//! What a render took: a table for people, JSON for programs.

use std::time::Duration;

use firstlight::RenderStats;
use serde_json::json;

/// The numbers of one run of `firstlight render`.
pub struct Stats {
    /// What messages call the scene.
    pub scene: String,
    /// Pixels across and down, of what was rendered; `None` for pictures of several sizes.
    pub size: Option<[u32; 2]>,
    /// How many pictures.
    pub pictures: usize,
    /// The same in words: `3 frames of 8 x 6 pixels`.
    pub what: String,
    /// Reading the scene's text.
    pub parse: Duration,
    /// Checking it, reading its textures, building what rays need.
    pub compile: Duration,
    /// Rays and shading.
    pub render: Duration,
    /// Encoding and writing the pictures.
    pub write: Duration,
    /// What the renderer counted.
    pub rays: RenderStats,
}

impl Stats {
    /// Millions of camera and shadow rays settled in each second of rendering, those without tracing included; 0 where
    /// no time passed.
    fn mrays_per_s(&self) -> f64 {
        let seconds = self.render.as_secs_f64();
        let rays = self.rays.camera_rays as f64 + self.rays.shadow_rays as f64;
        if seconds > 0.0 { rays / seconds / 1e6 } else { 0.0 }
    }

    /// Pretty-printed, with a newline at the end. Times in seconds.
    pub fn to_json(&self) -> String {
        let value = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "scene": self.scene,
            "width": self.size.map(|[width, _]| width),
            "height": self.size.map(|[_, height]| height),
            "frames": self.pictures,
            "parse_s": self.parse.as_secs_f64(),
            "compile_s": self.compile.as_secs_f64(),
            "render_s": self.render.as_secs_f64(),
            "write_s": self.write.as_secs_f64(),
            "camera_rays": self.rays.camera_rays,
            "shadow_rays": self.rays.shadow_rays,
            "shadow_rays_skipped": self.rays.shadow_rays_skipped,
            "lights_lit": self.rays.visibility[0],
            "lights_hidden": self.rays.visibility[1],
            "lights_below_horizon": self.rays.visibility[2],
            "lights_by_mask": self.rays.visibility[3],
            "lights_in_closed_form": self.rays.closed_form,
            "batches": self.rays.batches,
            "batched_points": self.rays.batched_points,
            "shafts": self.rays.shafts,
            "occluders": self.rays.occluders,
            "shadow_rays_traced": self.rays.traced,
            "lights_and_places": self.rays.lights.pairs,
            "lights_singly": self.rays.lights.singly,
            "lights_together": self.rays.lights.together,
            "lights_left_out": self.left_out(),
            "light_clusters": self.rays.lights.nodes,
            "mrays_per_s": self.mrays_per_s(),
            "peak_memory_bytes": peak_memory(),
            "simd": self.rays.simd.name(),
            "threads": self.rays.threads,
        });
        format!("{value:#}\n")
    }

    /// Pairs of a place and a light that were left out, within the stated bound.
    fn left_out(&self) -> u64 {
        let lights = &self.rays.lights;
        lights.pairs.saturating_sub(lights.singly + lights.together)
    }

    /// What was done with many lights, in words.
    fn many(&self) -> String {
        let lights = &self.rays.lights;
        let percent = |count: u64| 100.0 * count as f64 / lights.pairs.max(1) as f64;
        format!(
            "{:.1} % by themselves, {:.1} % in {} clusters, {:.1} % left out",
            percent(lights.singly),
            percent(lights.together),
            lights.nodes,
            percent(self.left_out())
        )
    }

    /// How much of the lights was found to reach the points, in words.
    fn visibility(&self) -> String {
        let all = self.rays.visibility.iter().sum::<u64>() + self.rays.closed_form;
        if all == 0 {
            return String::new();
        }
        let percent = |count: u64| 100.0 * count as f64 / all as f64;
        let [lit, hidden, below, mask] = self.rays.visibility.map(percent);
        let closed = percent(self.rays.closed_form);
        format!(
            "{lit:.0} % lit, {hidden:.0} % hidden, {below:.0} % below the horizon, {closed:.0} % in closed form, \
             {mask:.0} % by mask"
        )
    }

    /// One line for each stage and number, without a newline at the end.
    pub fn to_table(&self) -> String {
        let seconds = |time: Duration| format!("{:.3} s", time.as_secs_f64());
        let how = format!("{}, {} thread{}", self.rays.simd.name(), self.rays.threads, plural(self.rays.threads));
        let all = self.rays.visibility.iter().sum::<u64>() + self.rays.closed_form;
        let each = self.rays.occluders as f64 / self.rays.shafts.max(1) as f64;
        let mut rows = vec![
            ("parse", seconds(self.parse), String::new()),
            ("compile", seconds(self.compile), String::new()),
            ("render", seconds(self.render), format!("{}, {how}", self.what)),
            ("write", seconds(self.write), String::new()),
            ("camera rays", self.rays.camera_rays.to_string(), String::new()),
            (
                "shadow rays",
                self.rays.shadow_rays.to_string(),
                format!("{} of them settled without tracing", self.rays.shadow_rays_skipped),
            ),
            ("points and lights", all.to_string(), self.visibility()),
            ("shafts", self.rays.shafts.to_string(), format!("{each:.1} things in each that may be in the way")),
            ("rays a second", format!("{:.1} million", self.mrays_per_s()), String::new()),
        ];
        if self.rays.batches > 0 {
            let filled = 100.0 * self.rays.batched_points as f64 / (16 * self.rays.batches) as f64;
            rows.push((
                "batches of 16 points",
                self.rays.batches.to_string(),
                format!("{filled:.0} % of lanes filled"),
            ));
        }
        if self.rays.lights.pairs > 0 {
            rows.push(("places and many lights", self.rays.lights.pairs.to_string(), self.many()));
        }
        if let Some(bytes) = peak_memory() {
            rows.push(("memory, at most", format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20)), String::new()));
        }
        let (names, values) = (width(rows.iter().map(|r| r.0)), width(rows.iter().map(|r| r.1.as_str())));
        let line = |(name, value, note): &(&str, String, String)| {
            format!("{name:names$}  {value:>values$}  {note}").trim_end().to_owned()
        };
        rows.iter().map(line).collect::<Vec<_>>().join("\n")
    }
}

fn plural(n: usize) -> &'static str {
    if n == 1 { "" } else { "s" }
}

fn width<'a>(texts: impl Iterator<Item = &'a str>) -> usize {
    texts.map(str::len).max().unwrap_or(0)
}

/// The most memory this process has held so far, in bytes. `None` where the system does not say (it does on Linux).
fn peak_memory() -> Option<u64> {
    if !cfg!(target_os = "linux") {
        return None;
    }
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    #[test]
    #[cfg(target_os = "linux")]
    fn memory_is_known_on_linux() {
        assert!(super::peak_memory().is_some_and(|bytes| bytes > 100_000));
    }
}

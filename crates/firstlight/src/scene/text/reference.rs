//! The reference of the scene format, made from the comments of the fields themselves.

use crate::camera::CameraDesc;
use crate::describe::info::sentence;
use crate::describe::value::COLOR_FORMS;
use crate::describe::{Family, TableInfo};
use crate::describe::{FieldInfo, TextValue};
use crate::light::LightDesc;
use crate::material::MaterialDesc;
use crate::scene::description::RenderDesc;
use crate::shape::ShapeDesc;
use crate::texture::TextureDesc;

const HEAD: &str = r##"# The scene format

A scene is a text in TOML, or the same in JSON (a file whose name ends in `.json`). This page lists every table and
every field; it is made from the program's own definitions.

- Units: metres and degrees. Right-handed, y up.
- A **colour** is `[r, g, b]` (linear Rec. 709); `"#rrggbb"`, `"#rgb"` or one of the 148 names of
  [CSS](https://www.w3.org/TR/css-color-4/#named-colors) such as `"orange"` (sRGB); or one number (linear gray).
- Where a value can be **textured**, it is a constant, or `{ texture = "NAME", factor = ... }`: the texture, times the
  factor, which is 1 unless said.
- **Whole numbers** are welcome wherever a number is.
- **Files** are relative to the text that names them, with `/` between folders, and lie in the folder of the scene.
- A key that is not listed here is an error. All errors of a scene are told at once.
- Names of cameras, of materials and of textures are unique, whatever the kind.
- Shapes and lights have ids in scene order: kinds in the order of this page, then the order of the text, included texts
  first.

## Several texts: `include`

`include = ["room.toml", "lights.json"]`, before the first table, reads other texts as part of the scene; they come
before the text that includes them. File names are relative to the text that includes them. Every text is included once;
`[render]`, `[camera]` and every name can be said in one text only. In JSON a top-level `"$schema"` is allowed, and not
read.

Limits: 64 MiB for all texts of a scene together, 1024 texts, includes 32 deep, tables and arrays 64 deep; in one text
2097152 tables, 262144 of them in one value, and 16777216 words, numbers and marks, not counting lists of 64 numbers or
more.
"##;

const GROUPS: &str = r#"
## Groups: `[[group.NAME.KIND]]`

`[[group.tree.cone]]` describes a cone that belongs to the group `tree`; every shape can be in a group, instances of
other groups too. A group by itself is not seen: `[[instance]]` places it, as often as wanted. A group is described
in one text, its name is unique, and no group may hold an instance of itself, not by way of others either.

Limits: 4194304 shapes and instances, counted wherever they are placed; groups 32 deep.
"#;

const COURSE: &str = r#"
## Files of the course

A text whose name ends in `.txt`, or whose first line is `key value` with a key of this list, is a configuration of the
rendering course. It means one of the nine built-in scenes, changed by what it says. Blank lines are skipped; any other
key, a missing value, a second value, or a key said twice is an error.

| key | value | without it |
|---|---|---|
| `output_resolution` | pixels across and down, 1 to 65536: one number, the picture is square | 1024 |
| `output_file` | the picture, relative to the working folder; a name without blanks | chosen by the program |
| `camera_id` | 1, 2 or 3 | 1 |
| `light_id` | 1, 2 or 3 | 1 |
| `num_samples` | n of the n x n camera rays in each pixel, 1 to 64 | 4 |
| `area_light_resolution` | m of the m x m points of the light, laid out as a grid, 1 to 1024 | as the built-in scene |
| `num_threads` | threads, 1 or more; never changes a picture | all processors |
"#;

/// The reference of the scene format as a page of Markdown.
pub fn reference() -> String {
    let mut page = HEAD.to_owned();
    let mut inner: Vec<TableInfo> = Vec::new();
    let mut section = |title: String, info: TableInfo| {
        let mut text = String::new();
        table(&mut text, &title, &info);
        for table in info.fields.into_iter().flat_map(|field| field.tables) {
            if !inner.iter().any(|known| known.kind == table.kind) {
                inner.push(table);
            }
        }
        text
    };
    page += &section("Picture: `[render]`".into(), TableInfo::of::<RenderDesc>("render"));
    page += &section("Camera: `[camera]` or `[camera.NAME]`".into(), TableInfo::of::<CameraDesc>("camera"));
    for info in ShapeDesc::tables() {
        page += &section(format!("Shape: `[[{}]]`", info.kind), info);
    }
    page += GROUPS;
    for info in LightDesc::tables() {
        page += &section(format!("Light: `[[light.{}]]`", info.kind), info);
    }
    for info in MaterialDesc::tables() {
        page += &section(format!("Material: `[material.{}.NAME]`", info.kind), info);
    }
    for info in TextureDesc::tables() {
        page += &section(format!("Texture: `[texture.{}.NAME]`", info.kind), info);
    }
    // What fields of several tables hold is explained once
    for info in &inner {
        table(&mut page, &format!("Table: {}", info.kind.replace('_', " ")), info);
    }
    page.push_str(COURSE);
    page
}

fn table(page: &mut String, title: &str, info: &TableInfo) {
    page.push_str(&format!("\n## {title}\n\n"));
    for line in info.doc {
        page.push_str(line.strip_prefix(' ').unwrap_or(line));
        page.push('\n');
    }
    page.push_str("\n| field | takes | default | meaning |\n|---|---|---|---|\n");
    for field in &info.fields {
        let cell = |text: &str| text.replace('|', "\\|");
        let default = match &field.default {
            None => "required".to_owned(),
            Some(TextValue::Absent) => "none".to_owned(),
            Some(value) => format!("`{}`", value.to_toml()),
        };
        let meaning = cell(&sentence(field.doc));
        page.push_str(&format!("| `{}` | {} | {} | {meaning} |\n", field.name, cell(&takes(field)), cell(&default)));
    }
    for field in info.fields.iter().filter(|f| !f.choices.is_empty()) {
        page.push_str(&format!("\nFor `{}`:\n\n", field.name));
        for choice in field.choices {
            page.push_str(&format!("- `\"{}\"`: {}\n", choice.word, sentence(choice.doc)));
        }
    }
}

/// What a field takes; the forms of colours and textured values are explained once, at the head of the page.
fn takes(field: &FieldInfo) -> String {
    if let Some(table) = field.tables.first() {
        // To its heading, by the name that the book gives it
        let anchor = format!("#table-{}", table.kind.replace('_', "-"));
        return format!("[{}]({anchor})", field.words);
    }
    let words = field.words.replace(COLOR_FORMS, "");
    match words.split_once(" or { texture") {
        Some((value, _)) => format!("{value}, textured"),
        None => words,
    }
}

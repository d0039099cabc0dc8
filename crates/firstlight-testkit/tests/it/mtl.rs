//! Files of materials from outside: Wavefront MTL, as materials of scenes.

use std::path::Path;

use firstlight::{CompileOptions, MemoryAssets, MtlMaterials, MtlSettings, NoAssets, SceneDesc, read_mtl};
use firstlight_testkit::Random;

fn read(name: &str, bytes: &[u8]) -> MtlMaterials {
    let settings = MtlSettings {
        is_wanted: &|_| true,
        texture_name: &|name| name.to_owned(),
        has_alpha: &|_| None,
        bump_height: 0.01,
    };
    read_mtl(name, bytes, &settings).unwrap_or_else(|error| panic!("{error}"))
}

/// A scene of these materials has no faults; that its pictures are not there is none.
fn compiles(all: &MtlMaterials, about: &str) {
    let text = "[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\n[[light.point]]\nposition = [0, 5, 0]\n\
                [[sphere]]\ncenter = [0, 0, 0]\nradius = 1\n";
    let mut scene = SceneDesc::parse("a.toml", text.as_bytes(), &NoAssets).desc;
    scene.materials = all.materials.clone();
    scene.textures = all.textures.clone();
    let compiled = scene.compile(&MemoryAssets::default(), &CompileOptions::default());
    assert!(compiled.is_ok(), "{about}: {}", compiled.err().unwrap());
}

/// The number of materials, textures and notes.
#[test]
fn files_of_others_are_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firstlight/tests/models/obj");
    for (path, counts) in [
        ("cube.mtl", [5, 0, 1]),
        ("cornell_box.mtl", [5, 0, 1]),
        ("pbr-mat-ext.mtl", [1, 4, 4]),
        ("texture-options-issue-85.mtl", [3, 11, 8]),
        ("box-textured/box-textured.mtl", [1, 1, 0]),
        ("box-negative-indices/box-negative-indices.mtl", [1, 0, 0]),
        ("box-objects-groups-materials/box-objects-groups-materials.mtl", [3, 0, 0]),
    ] {
        let all = read(path, &std::fs::read(folder.join(path)).unwrap());
        let found = [all.materials.len(), all.textures.len(), all.notes.len()];
        assert_eq!(found, counts, "{path}: {:#?} {:#?}", all.textures, all.notes);
        compiles(&all, path);
    }
}

#[test]
fn no_number_makes_a_scene_fail() {
    let mut random = Random::new(3);
    let words = ["0", "1", "-1", "0.5", "1e300", "-1e300", "1e-300", "nan", "1e7", "3", "1e5"];
    let terms = ["Ka", "Kd", "Ks", "Ke", "Ns", "d", "Tr", "Ni", "Pr", "Pm", "Pc", "Pcr", "illum", "Ps", "Tf"];
    let maps = ["map_Ka", "map_Kd", "map_Ks", "map_Ke", "map_Ns", "map_d", "map_Pr", "map_Pm", "bump", "norm"];
    for _ in 0..300 {
        let mut word = || words[random.below(words.len() as u32) as usize];
        let mut text = String::from("newmtl a\n");
        for term in terms {
            text.push_str(&format!("{term} {} {} {}\n", word(), word(), word()));
        }
        for map in maps {
            let options = ["-mm", "-s", "-o"].map(|option| format!("{option} {} {}", word(), word())).join(" ");
            text.push_str(&format!("{map} {options} -bm {} a.png\n", word()));
        }
        // Without some of the lines
        let kept: Vec<&str> =
            text.lines().enumerate().filter(|(i, _)| *i == 0 || random.below(2) == 0).map(|(_, line)| line).collect();
        let text = kept.join("\n");
        compiles(&read("a.mtl", text.as_bytes()), &text);
    }
}

//! What files hold beside the picture, and what is said of those that cannot.

use crate::common::{Folder, SCENE};

/// Whether an archive of arrays holds one: its name stands in it as it is.
fn holds(file: &[u8], array: &str) -> bool {
    let name = format!("{array}.npy");
    file.windows(name.len()).any(|part| part == name.as_bytes())
}

#[test]
fn files_hold_what_is_asked_for() {
    let folder = Folder::with_scene();
    let plain = folder.png("");
    folder.run("render scene.toml --buffers depth,object-id -o a.npz -o a.png -o a.exr").done();
    let (arrays, exr) = (folder.get("a.npz"), folder.get("a.exr"));
    assert!(holds(&arrays, "depth") && holds(&arrays, "object-id") && holds(&arrays, "receipt"));
    assert!(!holds(&arrays, "color") && !holds(&arrays, "normal"));
    let says = |word: &str| exr.windows(word.len()).any(|part| part == word.as_bytes());
    assert!(
        says("depth.Z") && says("object-id.ID") && says("firstlight:intrinsics") && says("firstlight:buffer.depth")
    );
    // The picture beside them is as ever
    assert!(folder.get("a.png") == plain);
    // Without --buffers it is the picture alone, and a picture says nothing of buffers
    folder.run("render scene.toml -o b.npz -o b.exr").done();
    let (arrays, exr) = (folder.get("b.npz"), folder.get("b.exr"));
    assert!(holds(&arrays, "color") && !holds(&arrays, "depth"));
    // Nor does it list them
    assert!(!exr.windows(18).any(|part| part == b"firstlight:buffers"));
    let same = folder.run("render scene.toml --buffers color -o - --format npz").done().stdout;
    assert!(same == arrays);
}

#[test]
fn names_too_long_for_a_file_are_told_before_anything_is_rendered() {
    let folder = Folder::new();
    let scene = |length: usize| {
        let name = format!("[[light.rectangle]]\nname = \"{}\"", "l".repeat(length));
        SCENE.replace("[[light.rectangle]]", &name)
    };
    // `light:` and the name, with room for `firstlight:buffer.` before them in 255 bytes
    folder.put("long.toml", scene(232));
    let line = "render long.toml --buffers color,light:* --size 2000 --aa 64 --samples 1000000";
    folder.run(&format!("{line} -o a.exr")).exits(1).says(&[
        "a.exr: the buffer \"light:lllll",
        "has a name of 238 bytes, and at most 237 are possible; give the light",
    ]);
    assert_eq!(folder.names(), ["long.toml"]);
    folder.put("scene.toml", scene(231));
    folder.run("render scene.toml --buffers color,light:* -o a.exr -q").done();
    folder.run("verify a.exr --scene scene.toml").done();
    // Arrays have room for it
    folder.run("render long.toml --buffers color,light:* -o a.npz -q").done();
}

#[test]
fn lights_are_kept_apart() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --buffers color,ambient,light:*,light:#1:specular -o a.npz -o a.exr").done();
    let (arrays, exr) = (folder.get("a.npz"), folder.get("a.exr"));
    let says = |word: &str| exr.windows(word.len()).any(|part| part == word.as_bytes());
    for name in ["color", "ambient", "light:#1", "light:#1:specular"] {
        assert!(holds(&arrays, name), "{name}");
        assert!(name == "color" || says(&format!("{name}.R")), "{name}");
    }
    assert!(says("firstlight:light_names") && says("firstlight:buffer.light:#1"));
    let scene = folder.run("render scene.toml --print-scene --buffers light:*:diffuse,light:#1").done().stdout;
    assert!(String::from_utf8(scene).unwrap().contains("buffers = [\"light:*:diffuse\", \"light:#1\"]"));
}

#[test]
fn masks_are_what_compositing_programs_read() {
    let folder = Folder::with_scene();
    let asked = "coverage:background,coverage:#1,crypto-object,crypto-material,depth:filtered";
    folder.run(&format!("render scene.toml --buffers {asked} -o a.npz -o a.exr -o b.exr")).done();
    let (arrays, exr) = (folder.get("a.npz"), folder.get("a.exr"));
    assert!(exr == folder.get("b.exr"), "the order of attributes is always the same");
    for name in ["coverage:background", "crypto-object", "crypto-material", "depth:filtered", "receipt"] {
        assert!(holds(&arrays, name), "{name}");
    }
    let says = |word: &str| exr.windows(word.len()).any(|part| part == word.as_bytes());
    for word in [
        "coverage:background.A\0",
        "CryptoObject00.R\0",
        "CryptoMaterial02.A\0",
        "depth:filtered.Z\0",
        "cryptomatte/3ae39a5/name\0string\0",
        "cryptomatte/3ae39a5/manifest\0string\0",
        "MurmurHash3_32",
        "uint32_to_float32",
        "firstlight:object_manifest",
    ] {
        assert!(says(word), "{word}");
    }
    assert!(!says("CryptoInstance"));
}

#[test]
fn the_scene_may_ask_for_them() {
    let folder = Folder::new();
    folder.put("scene.toml", SCENE.replace("[render]\n", "[render]\nbuffers = [\"color\", \"normal\"]\n"));
    folder.run("render scene.toml -o a.npz").done();
    assert!(holds(&folder.get("a.npz"), "normal") && holds(&folder.get("a.npz"), "color"));
    folder.run("render scene.toml -o b.npz --buffers depth").done();
    assert!(holds(&folder.get("b.npz"), "depth") && !holds(&folder.get("b.npz"), "normal"));
    folder.run("render scene.toml -o a.png").done().says(&["buffers", ".exr and .npz files do"]);
    let scene = folder.run("render scene.toml --print-scene --buffers depth,rays").done().stdout;
    assert!(String::from_utf8(scene).unwrap().contains("buffers = [\"depth\", \"rays\"]"));
}

#[test]
fn a_file_may_hold_one_by_itself() {
    let folder = Folder::with_scene();
    let picture = folder.png("");
    let files = "-o a.png -o depth=d.png -o object-id=i.png -o depth=d.npy -o c.npy -o light:#1=l.png -o depth=d.exr";
    folder.run(&format!("render scene.toml {files} -o light:*=l.npz")).done();
    assert!(folder.get("a.png") == picture);
    let gray = |name: &str| {
        let file = folder.get(name);
        // Bits of a sample, and the kind of colour
        assert_eq!(file[24..26], [16, 0], "{name}");
        assert!(file.windows(17).any(|part| part == b"firstlight:stored"), "{name}");
    };
    gray("d.png");
    gray("i.png");
    assert_eq!(folder.get("l.png")[24..26], [8, 2]);
    assert!(folder.get("d.npy").starts_with(b"\x93NUMPY") && folder.get("c.npy").starts_with(b"\x93NUMPY"));
    assert!(holds(&folder.get("l.npz"), "light:#1") && !holds(&folder.get("l.npz"), "color"));
    let exr = folder.get("d.exr");
    let says = |word: &str| exr.windows(word.len()).any(|part| part == word.as_bytes());
    assert!(says("depth.Z") && says("firstlight:buffer.depth"));
    // What files of all buffers take does not grow by it
    folder.run("render scene.toml -o b.npz -o depth=- --format npy").done();
    assert!(!holds(&folder.get("b.npz"), "depth"));
    folder.run("render scene.toml -o ./a=b.png").done();
    assert!(folder.get("a=b.png") == picture);
}

#[test]
fn colors_of_exr_files_can_have_16_bits() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --buffers color,depth,alpha -o a.exr").done();
    folder.run("render scene.toml --buffers color,depth,alpha -o h.exr --half -o depth=d.npy").done();
    assert!(folder.get("h.exr").len() < folder.get("a.exr").len());
    folder.run("diff a.exr h.exr --buffers depth,alpha").done();
    // 11 bits of numbers below 1
    folder.run("diff a.exr h.exr --buffers color").exits(3);
    folder.run("diff a.exr h.exr --buffers color --max 0.0005").done();
    for file in ["h.exr", "d.npy"] {
        folder.run(&format!("verify {file} --scene scene.toml")).done();
    }
    folder.run("render scene.toml -o a.png --half").exits(2).says(&["--half is for EXR files"]);
}

#[test]
fn a_scale_of_depth_says_what_it_cannot_tell() {
    let folder = Folder::with_scene();
    assert!(!folder.run("render scene.toml -o depth=mm.png").done().text().contains("warning"));
    folder
        .run("render scene.toml -o depth=d.png --depth-scale 1e6")
        .done()
        .says(&["warning", "farther than 0.065535 m"]);
    folder.run("render scene.toml -o depth=s.png --depth-scale 1e6 --strict").exits(1).says(&["are farther than"]);
    folder.run("render scene.toml -o depth=d.npy --depth-scale 1e6").exits(2).says(&["--depth-scale is for depth"]);
    folder.run("render scene.toml -o depth=d.png --depth-scale 0").exits(2).says(&["from 0.001 to 1000000"]);
    assert_eq!(folder.names(), ["d.png", "mm.png", "scene.toml"]);
}

#[test]
fn what_cannot_be_is_said() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --buffers dept -o a.npz").exits(2).says(&["dept", "\"depth\""]);
    folder.run("render scene.toml --buffers light:nobody -o a.npz").exits(1).says(&["no light is called \"nobody\""]);
    folder.run("render scene.toml --buffers light: -o a.npz").exits(2).says(&["names no light"]);
    folder.run("render scene.toml --buffers coverage:it -o a.npz").exits(1).says(&["no object is called \"it\""]);
    folder.run("render scene.toml --buffers coverage: -o a.npz").exits(2).says(&["names no object"]);
    folder.run("render scene.toml --buffers object-id:filtered -o a.npz").exits(2).says(&["an id has no mean"]);
    folder.run("render scene.toml --buffers depth").exits(2).says(&["--buffers is for .exr and .npz files"]);
    folder.run("render scene.toml --buffers depth -o a.png -o a.hdr").exits(2).says(&["name one with -o"]);
    folder.run("render scene.toml --buffers depth,depth -o a.npz").exits(1).says(&["\"depth\" is given twice"]);
    folder.run("render scene.toml -o dept=d.png").exits(2).says(&["\"dept\" is no buffer; did you mean \"depth\"?"]);
    folder.run("render scene.toml -o position=p.png").exits(2).says(&["no range", ".exr, .npz and .npy files can"]);
    folder.run("render scene.toml -o depth=d.hdr").exits(2).says(&["it is no colour"]);
    folder.run("render scene.toml -o light:nobody=d.png").exits(2).says(&["no light is called \"nobody\""]);
    folder.put("none.toml", SCENE.replace("[render]\n", "[render]\nbuffers = []\n"));
    folder.run("render none.toml -o a.npz").exits(1).says(&["render.buffers", "asks for nothing"]);
    assert_eq!(folder.names(), ["none.toml", "scene.toml"]);
}

#[test]
fn all_of_them_are_listed() {
    let list = String::from_utf8(Folder::new().run("buffers").done().stdout).unwrap();
    for plane in firstlight::Plane::ALL {
        let mut lines = list.lines().filter(|line| line.split_whitespace().next() == Some(plane.name()));
        let row = lines.next().unwrap();
        assert!(
            plane.channels().len() > 4 && row.contains(&format!("{} to ", plane.channels()[0]))
                || row.contains(&plane.channels().join(" "))
        );
        assert!(row.contains(plane.number_type()) && row.contains(plane.unit()));
        assert!(lines.next().is_some_and(|line| line.ends_with('.')), "{}", plane.name());
    }
}

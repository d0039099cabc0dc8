//! `verify` and `diff`: what is the same, what differs and where, and what cannot be compared.

use firstlight::{FileSettings, Format, NamedPlane, Plane, PlaneVec, Receipt, StoredPlanes, encode_planes};

use crate::common::{Folder, QUICK, SCENE, ran};

/// The options of [`QUICK`] as one text, but for the samples.
fn quick() -> String {
    QUICK[..4].join(" ")
}

/// The bytes of an archive of arrays, changed by `change`, with a receipt of its own making.
fn changed(bytes: &[u8], change: impl Fn(&mut StoredPlanes)) -> Vec<u8> {
    let mut file = StoredPlanes::read(bytes).unwrap();
    change(&mut file);
    let planes: Vec<NamedPlane> = file
        .planes
        .iter()
        .map(|plane| NamedPlane {
            name: &plane.name,
            plane: Plane::from_name(&plane.name).unwrap(),
            numbers: plane.numbers.numbers(),
        })
        .collect();
    encode_planes(file.film, file.window, &planes, Format::Npz, &FileSettings::default(), &file.receipt).unwrap()
}

/// The floats of a buffer.
fn floats<'a>(file: &'a mut StoredPlanes, name: &str) -> &'a mut Vec<f32> {
    match file.planes.iter_mut().find(|plane| plane.name == name).map(|plane| &mut plane.numbers) {
        Some(PlaneVec::Floats(numbers)) => numbers,
        _ => panic!("{name} has floats"),
    }
}

fn set(receipt: &mut Receipt, key: &str, value: &str) {
    receipt.entries.iter_mut().find(|(known, _)| known == key).unwrap().1 = value.into();
}

/// A text within bytes, put in place of another.
fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|part| part == from.as_bytes()).unwrap();
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

#[test]
fn every_file_is_rendered_again_from_its_receipt() {
    let folder = Folder::with_scene();
    let keys = "transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 8, translate = [8, 0, 0] }] }";
    folder.put("moving.toml", SCENE.replace("position = [4, 6, 4]", &format!("position = [4, 6, 4]\n{keys}")));
    folder.put("bare.toml", "[[sphere]]\ncenter = [0, 1, 0]\nradius = 1\n[[light.point]]\nposition = [3, 5, 4]\n");
    folder.put(
        "corner.stl",
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
        endloop\nendfacet\nendsolid a\n",
    );
    let all = "color,depth,normal-camera,object-id,rays,light:*,light:#2:specular";
    for (scene, options, files) in [
        ("scene.toml", format!("--buffers {all}"), &["a.png", "a.exr", "a.npz", "a.hdr"][..]),
        ("scene.toml", "--crop 3,2,20,9 --camera side --background #336699 --samples exact".into(), &["a.png"]),
        ("scene.toml", "--transparent --exposure -1.5 --bits 16 --reference --heat h.png".into(), &["a.png", "h.png"]),
        ("moving.toml", "--time 2.5 --aa-mode full --shadow-terminator hard --width 18".into(), &["a.exr"]),
        ("moving.toml", "--visibility traced --buffers rays,uv --tolerance 4".into(), &["a.npz"]),
        ("moving.toml", "--buffers motion,shadow --motion-to next".into(), &["a.npz"]),
        ("moving.toml", "--buffers motion-backward --motion-to side --time 1".into(), &["a.exr"]),
        ("bare.toml", "--view 30,60 --margin 0.2 --width 20".into(), &["a.png"]),
        ("corner.stl", "--smooth 40 --up z --view iso --size 20".into(), &["a.png"]),
    ] {
        let outputs: String = files.iter().filter(|file| **file != "h.png").map(|file| format!(" -o {file}")).collect();
        folder.run(&format!("render {scene} {options}{outputs}")).done();
        for file in files {
            let run = folder.run(&format!("verify {file} --scene {scene}")).done();
            assert!(run.text().starts_with(&format!("{file}: the same bits as {scene} gives")), "{}", run.text());
        }
    }
    // Cryptomatte, whose channels have names of their own, is one buffer in both kinds of files
    let buffers = "crypto-object,coverage:background";
    folder.run(&format!("render scene.toml {} --buffers {buffers} -o c.exr -o c.npz", quick())).done();
    folder.run("verify c.exr --scene scene.toml").done();
    let run = folder.run("diff c.exr c.npz").done();
    assert!(run.text().contains("crypto-object: the same bits"), "{}", run.text());
    // One of the scenes of a folder, and one that is built in
    folder.run("verify a.png --scene .").done();
    folder.run(&format!("render config23 {} -o b.png", quick())).done();
    let run = folder.run("verify b.png --json").done();
    assert!(run.text().contains("\"verdict\": \"same\"") && run.text().contains("\"scene\": \"config23\""));
    assert_eq!(folder.run("verify b.png --quiet").done().text(), "");
}

#[test]
fn other_bits_of_the_same_version_are_told_with_their_place() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --buffers color,depth -o a.npz").done();
    folder.put(
        "b.npz",
        changed(&folder.get("a.npz"), |file| {
            floats(file, "depth")[36 * 12 + 18] += 0.5;
            floats(file, "depth")[36 * 20 + 7] = 2.0;
        }),
    );
    let run = folder.run("verify b.npz --scene scene.toml").exits(3);
    for part in ["b.npz: other bits", "color: the same bits", "depth: 2 of 864 samples differ", "first at (18, 12): "] {
        assert!(run.text().contains(part), "{part}: {}", run.text());
    }
    // A pixel or an entry that was changed by another program
    folder.run("render scene.toml --width 7 -o c.hdr").done();
    folder.run("verify c.hdr --scene scene.toml").done();
    let mut edited = folder.get("c.hdr");
    *edited.last_mut().unwrap() ^= 1;
    folder.put("d.hdr", edited);
    let run = folder.run("verify d.hdr --scene scene.toml").exits(3);
    assert!(run.text().contains("does not hold the bits that its receipt speaks of"), "{}", run.text());
    folder.put("e.hdr", replaced(&folder.get("c.hdr"), "firstlight:intrinsics ", "firstlight:intrinsics 1"));
    let run = folder.run("verify e.hdr --scene scene.toml").exits(3);
    assert!(run.text().contains("color: the same bits") && run.text().contains("receipt intrinsics"), "{}", run.text());
}

#[test]
fn another_version_is_held_to_the_tolerance() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --buffers color,depth,rays -o a.npz").done();
    let with = |change: &dyn Fn(&mut StoredPlanes)| {
        folder.put(
            "b.npz",
            changed(&folder.get("a.npz"), |file| {
                set(&mut file.receipt, "version", "0.0.9+pixels.3");
                change(file);
            }),
        );
        folder.run("verify b.npz --scene scene.toml")
    };
    let run = with(&|_| {}).done();
    assert!(run.text().contains("written by version 0.0.9+pixels.3") && run.text().contains("within the tolerance"));
    // A fifth of a display step, and other work
    let run = with(&|file| {
        floats(file, "color").iter_mut().for_each(|c| *c += 1e-4);
        floats(file, "rays")[3] += 1.0;
    });
    assert!(run.done().text().contains("color: 0 of 864 pixels are farther apart than 1 display steps"));
    let run = with(&|file| floats(file, "color")[400] += 0.1).exits(3);
    assert!(run.text().contains("beyond the tolerance") && run.text().contains("color: 1 of 864 pixels are farther"));
    // What is exact has no tolerance
    with(&|file| floats(file, "depth")[36 * 12 + 18] += 1e-3).exits(3);
}

#[test]
fn jpeg_files_are_told_verified_and_compared() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml -o a.jpg -o b.JPEG -o a.png --quality 60").done();
    folder.run("render scene.toml -o c.jpg").done();
    assert!(folder.get("a.jpg") == folder.get("b.JPEG") && folder.get("a.jpg").len() < folder.get("c.jpg").len());
    let stdout = folder.run("render scene.toml --format jpeg -o - --quality 60").done().stdout;
    assert!(stdout == folder.get("a.jpg"));
    let said = folder.run("info a.jpg").done().text();
    for part in ["bytes, JPEG", "36 x 24 pixels", "scene_hash", "jpeg_quality", "60", "on black"] {
        assert!(said.contains(part), "{part:?} is not in:\n{said}");
    }
    folder.run("render scene.toml -o depth=d.jpg").exits(2).says(&["it is no colour"]);
    // The same losses in a render of today
    let said = folder.run("verify a.jpg --scene scene.toml").done().text();
    assert!(said.contains("the same bits"), "{said}");
    // The film is brought to the same losses, a PNG file is as it is
    folder.run("render scene.toml -o a.exr").done();
    folder.run("diff a.jpg a.exr").done();
    folder.run("diff a.jpg a.png").exits(3);
    folder.run("diff a.jpg a.png --max 128").done();
    folder.run("render scene.toml --buffers color,relight -o lights.exr").done();
    let light = "relight lights.exr --light #1=x1";
    folder.run(&format!("{light} -o d.jpg --quality 60 --exposure 0")).done();
    folder.run(&format!("{light} -o e.png --quality 60")).exits(2).says(&["--quality", "JPEG"]);
    for option in ["--exposure 1", "--display linear"] {
        let words = [option.split(' ').next().unwrap(), "PNG and JPEG"];
        folder.run(&format!("{light} -o e.exr {option}")).exits(2).says(&words);
    }
}

#[test]
fn what_cannot_be_verified_is_said() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml -o a.png -o a.exr").done();
    folder.run("verify a.png").exits(1).says(&["no built-in scene has it", "--scene FILE"]);
    folder.put("other.toml", SCENE.replace("radius = 1", "radius = 1.5"));
    folder
        .run("verify a.png --scene other.toml")
        .exits(1)
        .says(&["not made of other.toml as it is now", "its hash is"]);
    folder.run("verify a.png --scene config11").exits(1).says(&["config11"]);
    folder.run("verify a.png --scene none.toml").exits(1).says(&["none.toml: no such file"]);
    folder.run("verify none.png").exits(1).says(&["none.png: no such file"]);
    folder.run("verify .").exits(1).says(&["is a folder"]);
    folder.run("verify scene.toml").exits(1).says(&["scene.toml: is not a PNG, JPEG, EXR, NPZ, NPY or HDR file"]);
    for name in ["a.png", "a.exr"] {
        let whole = folder.get(name);
        folder.put("cut", &whole[..whole.len() / 2]);
        folder.run("verify cut --scene scene.toml").exits(1).says(&["cut: is a damaged"]);
    }
    let mut foreign = Vec::new();
    let mut writer = png::Encoder::new(&mut foreign, 2, 1).write_header().unwrap();
    writer.write_image_data(&[7, 9]).unwrap();
    writer.finish().unwrap();
    folder.put("foreign.png", foreign);
    folder.run("verify foreign.png --scene scene.toml").exits(1).says(&["holds no receipt", "another program"]);
    folder.put("odd.png", replaced(&folder.get("a.png"), "firstlight:aa_mode", "firstlight:aa_mOde"));
    // Its checksum is no longer right, so that the entry is not there
    folder.run("verify odd.png --scene scene.toml").exits(1);
    folder.run("verify").exits(2).says(&["<FILE>"]);
}

#[test]
fn differences_are_counted_and_measured() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --buffers color,depth,object-id -o a.npz -o a.exr -o a.png -o a.hdr").done();
    folder.run("render scene.toml --background #204060 --buffers color,depth,object-id -o b.npz -o b.png").done();
    // One picture in four kinds of files
    for (one, other) in [("a.npz", "a.exr"), ("a.png", "a.exr"), ("a.npz", "a.png"), ("a.png", "a.png")] {
        let run = folder.run(&format!("diff {one} {other}")).done();
        assert!(run.text().starts_with("color: the same bits\n"), "{}", run.text());
    }
    let run = folder.run("diff a.hdr a.exr").exits(3);
    assert!(run.text().contains("of 2592 samples differ"), "{}", run.text());
    folder.run("diff a.hdr a.exr --max 0.01 --flip 0.01").done();
    // Another background: the colours, and not what is infinitely far
    let run = folder.run("diff a.npz b.npz").exits(3);
    let text = run.text();
    assert!(text.contains("; FLIP mean 0.") && text.contains("at (0, 0) R: 0, "), "{text}");
    assert!(text.contains("depth: the same bits\nobject-id: the same bits\n"), "{text}");
    let run = folder.run("diff a.png b.png").exits(3);
    assert!(run.text().contains("largest difference 96 of 255 at (0, 0) B: 0, 96"), "{}", run.text());
    folder.run("diff a.png b.png --max 96").done();
    folder.run("diff a.png b.png --max 95").exits(3);
    folder.run("diff a.png b.png --max 96 --flip 0.0001 -q").exits(3);
    folder.run("diff a.npz b.npz --buffers depth,object-id").done();
    // As a program reads it, and as a picture
    let run = folder.run("diff a.png b.png --flip 1 --json -o d.png").done();
    let json: serde_json::Value = serde_json::from_str(&run.text()).unwrap();
    assert_eq!((&json["same"], &json["buffers"][0]["max"]), (&true.into(), &96.0.into()));
    let [x, y] = [0, 1].map(|k| json["buffers"][0]["first"]["pixel"][k].as_u64().unwrap());
    assert_eq!((x, y), (0, 0));
    let drawn = crate::common::Picture::decode(&folder.get("d.png"));
    assert_eq!(drawn.size(), (36, 24));
    assert!(drawn.data[..3].iter().any(|byte| *byte > 50), "the corner differs");
    // Of ids, those that differ are white
    folder.run("render scene.toml --camera side --buffers object-id -o c.npz").done();
    let run = folder.run("diff a.npz c.npz -o e.png --buffers object-id --max 9").exits(3);
    assert!(run.text().contains("samples differ") && !run.text().contains("largest"), "{}", run.text());
    let run = folder.run("diff a.npz c.npz").exits(3);
    assert!(run.text().contains("only in a.npz: color, depth"), "{}", run.text());
}

#[test]
fn what_a_png_file_holds_is_compared_as_it_holds_it() {
    let folder = Folder::with_scene();
    let lights = "-o light:#1=l.png -o depth=d.png -o object-id=i.png";
    folder
        .run(&format!("render scene.toml --buffers color,depth,object-id,light:#1 -o a.exr {lights} -o a.png"))
        .done();
    for png in ["a.png", "l.png", "d.png", "i.png"] {
        folder.run(&format!("diff {png} a.exr")).done();
        folder.run(&format!("diff a.exr {png}")).done();
    }
    folder.run("render scene.toml --camera side --buffers color,depth,object-id -o b.exr -o object-id=j.png").done();
    assert!(folder.run("diff d.png b.exr").exits(3).text().contains("depth"));
    folder.run("diff l.png b.exr").exits(1).says(&["l.png has light:#1 and b.exr has color, depth, object-id"]);
    // Ids are the same or not, in any file
    folder.run("diff i.png j.png --max 9").exits(3);
    // The name of a light that is long, or has spaces
    for name in ["my light", &"k".repeat(60)] {
        let scene = String::from_utf8(folder.get("scene.toml")).unwrap();
        folder.put(
            "named.toml",
            scene.replacen(
                "[[light.",
                &format!("[[light.point]]\nname = \"{name}\"\nposition = [1, 2, 3]\n[[light."),
                1,
            ),
        );
        for file in ["n.png", "n.hdr"] {
            ran(folder.command(["render", "named.toml", "-o", &format!("light:{name}={file}")]).output().unwrap())
                .done();
            ran(folder.command(["view-buffer", file, &format!("light:{name}"), "-o", "x.png"]).output().unwrap())
                .done();
            folder.run(&format!("verify {file} --scene named.toml")).done();
        }
    }
}

#[test]
fn what_cannot_be_compared_is_said() {
    let folder = Folder::with_scene();
    folder.run(&format!("render scene.toml {} --buffers color,depth -o a.npz -o a.png", quick())).done();
    folder.run(&format!("render scene.toml {} --buffers normal -o n.exr", quick())).done();
    folder.run("render scene.toml --width 12 --aa 1 -o small.png").done();
    for (line, code, words) in [
        ("diff a.png small.png", 1, "a.png is 24 x 16 pixels and small.png is 12 x 8"),
        ("diff a.npz n.exr", 1, "a.npz has color, depth and n.exr has normal: no buffer is in both"),
        ("diff a.npz n.exr --buffers normal", 1, "a.npz has no buffer normal; it has color, depth"),
        ("diff a.png scene.toml", 1, "scene.toml: is not a PNG, JPEG, EXR, NPZ, NPY or HDR file"),
        ("diff a.png none.png", 1, "none.png: no such file"),
        ("diff a.png a.png -o a.png", 2, "would replace one of the two pictures"),
        ("diff a.png a.png -o d.exr", 2, "must end in .png"),
        ("diff a.png a.png -o -", 2, "name a file"),
        ("diff a.png a.png --exposure 1", 2, "--exposure is for two pictures of linear light"),
        ("diff a.npz a.npz --buffers depth --flip 0.1", 2, "--flip is for colours"),
        ("diff a.png a.png --max x", 2, "a number of at least 0 is needed"),
        ("diff a.png a.png --flip 2", 2, "a number from 0 to 1 is needed"),
        ("diff a.png a.png --ppd 0", 2, "from 1 to 1000 is needed"),
        ("diff a.png", 2, "<B>"),
    ] {
        folder.run(line).exits(code).says(&[words]);
    }
    assert_eq!(folder.names(), ["a.npz", "a.png", "n.exr", "scene.toml", "small.png"]);
}

#[test]
fn shards_write_together_what_one_run_does() {
    let names = ["a.toml", "b.toml", "c.toml"];
    let files = |shards: &[&str], options: &str| {
        let folder = Folder::new();
        names.iter().for_each(|name| folder.put(name, SCENE));
        for shard in shards {
            folder.run(&format!("render {} {} {options} {shard}", names.join(" "), quick())).done();
        }
        let files: Vec<_> = folder.names().into_iter().map(|name| (folder.get(&name), name)).collect();
        files
    };
    for options in ["", "--frames 3..4 -o {stem}_#.png --samples 4"] {
        let whole = files(&[""], options);
        for count in [2, 4] {
            let shards: Vec<String> = (1..=count).map(|index| format!("--shard {index}/{count}")).collect();
            let shards: Vec<&str> = shards.iter().map(String::as_str).collect();
            assert!(files(&shards, options) == whole, "{count} {options}");
        }
    }
    // Every second of six frames of three scenes
    let some: Vec<String> =
        files(&["--shard 2/2"], "--frames 3..4 -o {stem}_#.png").into_iter().map(|(_, name)| name).collect();
    assert_eq!(some, ["a.toml", "a_4.png", "b.toml", "b_4.png", "c.toml", "c_4.png"]);
}

#[test]
fn a_shard_may_have_nothing_to_do() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --shard 2/3 -o a.png").done().says(&["shard 2 of 3 has nothing to do"]);
    assert_eq!(folder.names(), ["scene.toml"]);
    folder.run("render scene.toml --shard 1/3 -o a.png").done();
    assert_eq!(folder.get("a.png"), folder.png(""));
    for (options, words) in [
        ("--shard 0/3", "shards count from 1: the first of four is 1/4"),
        ("--shard 4/3", "there is no shard 4 of 3: they are 1 to 3"),
        ("--shard 3", "two whole numbers I/N are needed"),
        ("--shard 1/0", "two whole numbers I/N are needed"),
        ("--shard 1/2 --frames 0..3 --stats=s.json", "every shard of the frames would write this file"),
        ("--shard 1/2 --print-scene", "cannot be used with"),
    ] {
        folder.run(&format!("render scene.toml {options}")).exits(2).says(&[words]);
    }
}

//! Buffers as pictures to look at.

use crate::common::{Folder, size_of};

#[test]
fn every_file_of_a_buffer_gives_the_same_picture() {
    let folder = Folder::with_scene();
    let files = "-o a.exr -o a.npz -o depth=d.npy -o depth=d.png -o normal=n.png -o normal=n.npy -o object-id=i.png";
    folder
        .run(&format!("render scene.toml --buffers color,depth,object-id,normal,motion --motion-to side {files}"))
        .done();
    folder.run("view-buffer a.exr depth").done().says(&["wrote a.depth.png"]);
    // Larger than the film, with a legend beside it
    let (width, height) = size_of(&folder.path("a.depth.png"));
    assert!(height >= 160 && width > 240 + 40, "{width} x {height}");
    let same = |command: &str, as_in: &str| {
        folder.run(&format!("{command} -o x.png")).done();
        let samples = |name: &str| crate::common::Picture::decode(&folder.get(name)).data;
        assert!(samples("x.png") == samples(as_in), "{command}");
    };
    same("view-buffer a.npz depth", "a.depth.png");
    same("view-buffer d.npy depth", "a.depth.png");
    folder.run("view-buffer a.npz object-id").done();
    same("view-buffer i.png object-id", "a.object-id.png");
    folder.run("view-buffer a.exr normal").done();
    same("view-buffer n.npy normal", "a.normal.png");
    same("view-buffer n.png normal", "a.normal.png");
    for more in ["a.exr color", "a.npz motion --range 0,5", "d.png depth --range 1,9", "a.exr color --exposure 1"] {
        folder.run(&format!("view-buffer {more} -q -o y.png")).done();
    }
    // Stops of exposure are the same, whatever file the colours are from
    folder.run("render scene.toml -o c.png -o c.exr").done();
    for exposure in ["0", "1", "-1.5"] {
        folder.run(&format!("view-buffer c.exr color --exposure {exposure} -o x.png")).done();
        folder.run(&format!("view-buffer c.png color --exposure {exposure} -o y.png")).done();
        // 8 bits are half a step off, which three times the light shows as one and a half
        folder.run("diff x.png y.png --max 2").done();
    }
    let to_stdout = folder.run("view-buffer a.exr depth -o -").done().stdout;
    assert!(to_stdout == folder.get("a.depth.png"));
}

#[test]
fn what_cannot_be_is_said() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --buffers depth,object-id -o a.npz").done();
    folder.run("view-buffer a.npz dept").exits(1).says(&["did you mean \"depth\"?", "it has depth, object-id"]);
    folder.run("view-buffer none.npz depth").exits(1).says(&["no such file"]);
    folder.run("view-buffer scene.toml depth").exits(1).says(&["is not a PNG, JPEG, EXR, NPZ, NPY or HDR file"]);
    folder.run("view-buffer a.npz depth -o a.npz").exits(2).says(&["must end in .png"]);
    folder.run("view-buffer a.npz depth --range 2,1").exits(2).says(&["the lower one first"]);
    folder.run("render scene.toml --buffers color,normal,motion --motion-to side -o b.npz").done();
    for (line, said) in [
        ("a.npz depth --exposure 1", "depth is no colour, and has no exposure"),
        ("a.npz object-id --range 0,1", "object-id has no range"),
        ("b.npz color --range 0,1", "color is a colour, and has no range"),
        ("b.npz normal --range 0,1", "normal has no range"),
        ("b.npz motion --range=-5,5", "motion is motion, whose range is 0 to"),
    ] {
        folder.run(&format!("view-buffer {line} -o z.png")).exits(1).says(&[said]);
    }
    folder.put("a.depth.png", "not ours");
    folder.run("view-buffer a.npz depth").exits(1).says(&["is no picture of firstlight"]);
    assert_eq!(folder.get("a.depth.png"), b"not ours");
    // What numpy writes of float64 is not damaged
    let doubles = b"\x93NUMPY\x01\x00\x3e\x00{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1), }\n12345678";
    folder.put("doubles.npy", &doubles[..]);
    folder.run("view-buffer doubles.npy depth").exits(1).says(&["type \"<f8\"; float32, uint32"]);
    folder.put("short.npy", &b"\x93NUMPY\x01\x00\x10\x00{'descr': '<f4'}"[..]);
    folder.run("view-buffer short.npy depth").exits(1).says(&["is a damaged NPY file"]);
}

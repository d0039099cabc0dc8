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
    let to_stdout = folder.run("view-buffer a.exr depth -o -").done().stdout;
    assert!(to_stdout == folder.get("a.depth.png"));
}

#[test]
fn what_cannot_be_is_said() {
    let folder = Folder::with_scene();
    folder.run("render scene.toml --buffers depth,object-id -o a.npz").done();
    folder.run("view-buffer a.npz dept").exits(1).says(&["did you mean \"depth\"?", "it has depth, object-id"]);
    folder.run("view-buffer none.npz depth").exits(1).says(&["no such file"]);
    folder.run("view-buffer scene.toml depth").exits(1).says(&["is not a PNG, EXR, NPZ, NPY or HDR file"]);
    folder.run("view-buffer a.npz depth -o a.npz").exits(2).says(&["must end in .png"]);
    folder.run("view-buffer a.npz depth --range 2,1").exits(2).says(&["the lower one first"]);
    folder.put("a.depth.png", "not ours");
    folder.run("view-buffer a.npz depth").exits(1).says(&["is no picture of firstlight"]);
    assert_eq!(folder.get("a.depth.png"), b"not ours");
    folder.put("short.npy", &b"\x93NUMPY\x01\x00\x10\x00{'descr': '<f4'}"[..]);
    folder.run("view-buffer short.npy depth").exits(1).says(&["is a damaged"]);
}

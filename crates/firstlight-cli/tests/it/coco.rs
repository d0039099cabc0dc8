//! Annotations of many pictures in one file.

use serde_json::Value as Json;

use crate::common::{Folder, SCENE};

#[test]
fn all_frames_are_in_one_file() {
    let folder = Folder::new();
    let keys = "transform = { keys = [{ time = 0, translate = [0, 0, 0] }, { time = 8, translate = [1, 0, 0] }] }";
    folder.put("scene.toml", SCENE.replace("[[sphere]]\n", &format!("[[sphere]]\n{keys}\n")));
    std::fs::create_dir(folder.path("out")).unwrap();
    let plain = folder.png("");
    folder.run("render scene.toml --frames 0..1 -o depth=d.npy -o out/f_#.png --coco out/a.json").done();
    assert_eq!(folder.get("out/f_0.png").len(), plain.len(), "asking for annotations changes no picture");
    let json: Json = serde_json::from_slice(&folder.get("out/a.json")).unwrap();
    let names = [0, 1].map(|i| json["images"][i]["file_name"].clone());
    // As seen from the file itself
    assert_eq!(names, ["f_0.png", "f_1.png"]);
    let of = |image: u64| {
        json["annotations"].as_array().unwrap().iter().filter(move |annotation| annotation["image_id"] == image)
    };
    assert!(of(1).count() >= 2 && of(2).count() >= 2);
    folder.run("render scene.toml -o out/p.png --coco a.json").done();
    std::fs::create_dir(folder.path("notes")).unwrap();
    let whole = folder.path("out/q.png");
    let shard = "--frames 0..3 --shard 1/2 -o f_#.png";
    folder.run(&format!("render scene.toml {shard} --coco s.json")).exits(2).says(&["--coco s.json: every shard"]);
    folder.run(&format!("render scene.toml -o {} --coco notes/b.json", whole.display())).done();
    folder.run("render scene.toml -o - -o object-id=i.png --coco c.json").done();
    for (file, expected) in [("a.json", "out/p.png"), ("notes/b.json", "../out/q.png"), ("c.json", "i.png")] {
        let json: Json = serde_json::from_slice(&folder.get(file)).unwrap();
        assert_eq!(json["images"][0]["file_name"], expected);
    }
    // The part of the film that is rendered is the picture
    folder.run("render scene.toml --crop 10,8,16,12 -o c.png --coco c.json").done();
    let json: Json = serde_json::from_slice(&folder.get("c.json")).unwrap();
    assert_eq!((json["images"][0]["width"].clone(), json["images"][0]["height"].clone()), (16.into(), 12.into()));
    assert_eq!(json["annotations"][0]["segmentation"]["size"], serde_json::json!([12, 16]));
}

#[test]
fn what_cannot_be_is_said() {
    let folder = Folder::with_scene();
    folder.put("scene.json", "{}");
    folder.run("render scene.toml -o a.png --coco a.txt").exits(2).says(&["--coco a.txt", "must end in .json"]);
    folder.run("render scene.json -o a.png --coco scene.json").exits(2).says(&["would replace the scene's own file"]);
    folder.run("render scene.toml -o a.png --coco a.json --stats=./a.json").exits(2).says(&["name the same output"]);
    folder.run("render scene.toml scene.json -o {stem}.png --coco a.json").exits(2).says(&["--coco a.json", "{stem}"]);
    assert_eq!(folder.names(), ["scene.json", "scene.toml"]);
}

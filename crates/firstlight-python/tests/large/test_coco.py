"""Annotations of `firstlight.Coco` as pycocotools, the format's own library, reads them."""

import json

import numpy as np
import pytest

import firstlight as fl

coco_api = pytest.importorskip("pycocotools.coco")
masks = pytest.importorskip("pycocotools.mask")

WIDTH, HEIGHT = 64, 48
# Things that can be added to a scene, by their names
ADDED = {
    "ball": lambda scene: scene.add_sphere(center=[0, 1, 0], radius=1, name="ball"),
    "box": lambda scene: scene.add_box(center=[0.8, 0.6, 1.2], size=[1.2, 1.2, 1.2], name="box"),
    "floor": lambda scene: scene.add_rectangle(center=[0, 0, 0], size=[8, 8], name="floor"),
    "far/ball": lambda scene: scene.add_sphere(center=[-1, 0.8, -2], radius=0.8, name="far/ball"),
}


def room():
    scene = fl.Scene()
    for add in ADDED.values():
        add(scene)
    scene.add_torus(center=[-1.2, 0.7, 1], axis=[0, 0.3, 1], major_radius=0.5, minor_radius=0.2)
    scene.add_rectangle_light(center=[0, 3, 0], e0=[1, 0, 0], e1=[0, 0, 1], strength=20, name="lamp")
    return scene


def cameras():
    """Some see all of it, some are so near that the edges of the picture cut things off."""
    places = [[0, 2, 8], [5, 3, 5], [-4, 1, 4], [0.5, 1, 2.6], [0, 6, 0.1]]
    return [fl.Camera(position=at, look_at=[0, 0.8, 0], width=WIDTH, height=HEIGHT) for at in places]


@pytest.fixture(scope="module")
def scene():
    return room()


@pytest.fixture(scope="module")
def coco(scene, tmp_path_factory):
    file = tmp_path_factory.mktemp("coco") / "train.json"
    grown = fl.Coco()
    for number, camera in enumerate(cameras()):
        grown.add(scene, f"view_{number}.png", camera=camera)
    grown.save(file)
    assert json.loads(file.read_text()) == json.loads(grown.to_json())
    return coco_api.COCO(str(file))


def test_the_index_finds_images_categories_and_annotations(coco):
    assert coco.getImgIds() == [1, 2, 3, 4, 5]
    for number, image in enumerate(coco.loadImgs(coco.getImgIds())):
        assert (image["file_name"], image["width"], image["height"]) == (f"view_{number}.png", WIDTH, HEIGHT)
    names = {category["name"] for category in coco.loadCats(coco.getCatIds())}
    # Lights are none, unless they are asked for
    assert names == {"ball", "box", "floor", "unnamed"}
    balls = coco.loadAnns(coco.getAnnIds(imgIds=1, catIds=coco.getCatIds(catNms=["ball"])))
    assert {ball["object_name"] for ball in balls} == {"ball", "far/ball"}
    assert coco.getAnnIds(iscrowd=False) == coco.getAnnIds() != []


def test_decoded_masks_are_the_ids_of_the_buffer(scene, coco):
    for image, camera in enumerate(cameras(), 1):
        frame = scene.render(camera=camera, buffers=["object-id"])
        ids, names = frame["object-id"], json.loads(frame.receipt["object_names"])
        found = coco.loadAnns(coco.getAnnIds(imgIds=image))
        # Lights are not annotated
        ids[ids == names.index("lamp") + 1] = 0
        assert [one["object_id"] for one in found] == [number for number in np.unique(ids) if number != 0]
        drawn = np.zeros_like(ids)
        for one in found:
            mask = masks.decode(one["segmentation"])
            assert (coco.annToMask(one) == mask).all()
            assert (drawn[mask == 1] == 0).all()
            drawn[mask == 1] = one["object_id"]
            assert one["object_name"] == names[one["object_id"] - 1]
            assert coco.loadCats(one["category_id"])[0]["name"] == (one["object_name"] or "unnamed").split("/")[-1]
        assert (drawn == ids).all()


@pytest.mark.parametrize("which", ["", "amodal_"])
def test_areas_and_boxes_are_those_of_the_masks(coco, which):
    for one in coco.loadAnns(coco.getAnnIds()):
        coded = one[f"{which}segmentation"]
        assert one[f"{which}area"] == masks.area(coded) == masks.decode(coded).sum()
        assert one[f"{which}bbox"] == masks.toBbox(coded).tolist()
        # The run lengths are the ones that pycocotools itself would write
        again = masks.encode(np.asfortranarray(masks.decode(coded)))
        assert again == {"size": coded["size"], "counts": coded["counts"].encode()}


def test_amodal_masks_contain_the_visible_ones(coco):
    fractions = []
    for one in coco.loadAnns(coco.getAnnIds()):
        seen, whole = one["segmentation"], one["amodal_segmentation"]
        assert masks.area(masks.merge([seen, whole], intersect=True)) == one["area"]
        assert one["visible_fraction"] == one["area"] / one["amodal_area"]
        fractions.append(one["visible_fraction"])
    # Things that are hidden in part, and things that are not
    assert min(fractions) < 0.9 and max(fractions) == 1


@pytest.mark.parametrize("name", ADDED)
def test_amodal_masks_are_renders_of_the_object_alone(coco, name):
    alone, compared = fl.Scene(), 0
    ADDED[name](alone)
    for image, camera in enumerate(cameras(), 1):
        shown = alone.render(camera=camera, buffers=["object-id"])["object-id"] == 1
        for one in coco.loadAnns(coco.getAnnIds(imgIds=image)):
            if one["object_name"] == name:
                assert (masks.decode(one["amodal_segmentation"]) == shown).all()
                compared += 1
    assert compared > 1


@pytest.mark.parametrize("kind", ["segm", "bbox"])
def test_the_evaluation_finds_the_annotations_right(coco, kind):
    evaluation = pytest.importorskip("pycocotools.cocoeval").COCOeval
    keys = ["image_id", "category_id", "segmentation" if kind == "segm" else "bbox"]
    detections = [{**{key: one[key] for key in keys}, "score": 1.0} for one in coco.loadAnns(coco.getAnnIds())]
    result = evaluation(coco, coco.loadRes(detections), kind)
    result.evaluate()
    result.accumulate()
    result.summarize()
    # Average precision and average recall over all thresholds
    assert result.stats[0] == pytest.approx(1) and result.stats[8] == pytest.approx(1)

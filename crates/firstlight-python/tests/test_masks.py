"""Coverage and Cryptomatte: what they say, and what other readers make of files."""

import json

import cryptomatte_reader as cryptomatte
import numpy as np
import pytest

import firstlight as fl

SIZE = {"width": 64, "height": 48, "aa": 4}


def scene():
    scene = fl.Scene()
    scene.add_camera(position=[0, 3, 8], look_at=[0, 1, 0])
    scene.add_phong_material("röd", diffuse=[0.8, 0.1, 0.1])
    scene.add_sphere(center=[0, 1, 0], radius=1, material="röd", name="ball \"1\"")
    scene.add_sphere(center=[1.5, 1, 0.5], radius=0.7, name="Würfel")
    scene.add_sphere(center=[-1.5, 1, 0.5], radius=0.7)
    scene.add_box(center=[0, -0.5, 0], size=[8, 1, 8], name="floor")
    scene.add_rectangle_light(center=[0, 4, 0], e0=[2, 0, 0], e1=[0, 0, 2], strength=20, name="lamp", sides="both")
    return scene


@pytest.fixture(scope="module")
def frame():
    buffers = ["crypto-object", "crypto-instance", "crypto-material", "coverage:*", "coverage:background", "object-id"]
    return scene().render(buffers=buffers, **SIZE)


def test_coverage_adds_up_to_one(frame):
    shares = [frame[name] for name in frame if name.startswith("coverage:")]
    assert len(shares) == 6 and np.abs(np.sum(shares, axis=0) - 1).max() < 1e-6
    assert all(((share * 16) == np.round(share * 16)).all() for share in shares)
    assert frame["crypto-object"].shape == (48, 64, 12)


def coverage_of(frame, name, number):
    return frame.get(f"coverage:{name}", frame.get(f"coverage:#{number}"))


def test_a_second_reader_finds_the_same_masks(frame, tmp_path):
    assert cryptomatte.murmur3_32(b"hello") == 0x248BFA47
    frame.save(tmp_path / "a.exr")
    layers = cryptomatte.read(tmp_path / "a.exr")
    assert sorted(layers) == ["CryptoInstance", "CryptoMaterial", "CryptoObject"]
    objects = layers["CryptoObject"]
    names = json.loads(frame.receipt["object_names"])
    for number, name in enumerate(names, 1):
        called = name or f"#{number}"
        assert called in objects.manifest
        mask = objects.mask(called)
        assert mask.max() > 0 and (mask == coverage_of(frame, name, number)).all(), called
    assert objects.manifest == json.loads(frame.receipt["object_manifest"])
    red = layers["CryptoMaterial"].mask("röd")
    assert (red == coverage_of(frame, names[0], 1)).all()
    assert not any(shares.any() for _, shares in layers["CryptoInstance"].ranks)


def test_arrays_hold_the_bits_of_ids(frame, tmp_path):
    frame.save(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as stored:
        manifest = json.loads(json.loads(str(stored["receipt"]))["object_manifest"])
        ranks = stored["crypto-object"]
    assert (ranks.view(np.uint32) == frame["crypto-object"].view(np.uint32)).all()
    ids, shares = ranks.view(np.uint32)[..., 0::2], ranks[..., 1::2]
    mask = (shares * (ids == int(manifest["floor"], 16))).sum(axis=-1)
    assert (mask == frame["coverage:floor"]).all()
    # Where all rays meet one thing, it is that of the centre
    names = json.loads(frame.receipt["object_names"])
    whole = (shares[..., 0] == 1) & (frame["object-id"] > 0)
    numbers = [int(manifest[name or f"#{number}"], 16) for number, name in enumerate(names, 1)]
    assert whole.any() and (ids[whole][:, 0] == np.array(numbers, np.uint32)[frame["object-id"][whole] - 1]).all()


def test_what_has_no_mean_is_said():
    with pytest.raises(ValueError, match="an id has no mean"):
        scene().render(buffers=["object-id:filtered"], **SIZE)
    with pytest.raises(fl.SceneError, match="no object is called"):
        scene().render(buffers=["coverage:nobody"], **SIZE)

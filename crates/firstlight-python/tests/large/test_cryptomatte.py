"""Cryptomatte as another library decodes it, cryptomatte-api."""

import json

import numpy as np
import pytest

import firstlight as fl

cryptomatte_api = pytest.importorskip("cryptomatte_api")


def test_another_library_decodes_coverage(tmp_path):
    layers = ["crypto-object", "crypto-instance", "crypto-material"]
    frame = fl.builtin("config11").render(buffers=[*layers, "coverage:*", "color"], width=60, height=40, aa=4)
    frame.save(tmp_path / "a.exr")
    found = {layer.metadata().name(): layer for layer in cryptomatte_api.Cryptomatte.load(str(tmp_path / "a.exr"))}
    assert sorted(found) == ["CryptoInstance", "CryptoMaterial", "CryptoObject"]
    objects = found["CryptoObject"]
    assert (objects.num_levels(), objects.width(), objects.height()) == (6, 60, 40)
    names, compared = json.loads(frame.receipt["object_names"]), 0
    for number, name in enumerate(names, 1):
        share = frame.get(f"coverage:{name}", frame.get(f"coverage:#{number}"))
        if share is not None and (name is None or names.count(name) == 1):
            assert np.allclose(objects.mask(name or f"#{number}"), share, atol=1e-6), name
            compared += 1
    assert compared > 5

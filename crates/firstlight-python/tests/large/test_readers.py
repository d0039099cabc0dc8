"""Files of buffers as OpenImageIO and OpenCV read them."""

import os

import numpy as np
import pytest

import firstlight as fl

# Before it is imported
os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"


@pytest.fixture(scope="module")
def frame():
    names = ["color", "depth", "normal", "uv", "object-id", "light:*", "light:*:specular"]
    return fl.builtin("config11").render(buffers=names, width=40, height=30, aa=2)


def test_openimageio_reads_every_channel(frame, tmp_path):
    oiio = pytest.importorskip("OpenImageIO")
    frame.save(tmp_path / "a.exr")
    file = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    spec = file.spec()
    assert (spec.width, spec.height) == (40, 30)
    letters = {"depth": "Z", "normal": "XYZ", "uv": "UV", "object-id": ["ID"]}
    for name, array in frame.items():
        channels = "RGB" if name == "color" else letters.get(name, "RGB")
        for k, letter in enumerate(channels):
            at = spec.channelnames.index(letter if name == "color" else f"{name}.{letter}")
            kind = oiio.UINT if array.dtype == np.uint32 else oiio.FLOAT
            assert (kind == oiio.UINT) == (str(spec.channel_name(at)).endswith(".ID"))
            stored = file.read_image(0, 0, at, at + 1, kind)[..., 0]
            expected = array if array.ndim == 2 else array[..., k]
            assert (stored == expected).all(), (name, letter)
    assert spec.get_string_attribute("firstlight:version") == frame.receipt["version"]
    file.close()


def test_opencv_reads_the_picture(tmp_path):
    cv2 = pytest.importorskip("cv2")
    frame = fl.builtin("config11").render(width=40, height=30, aa=2)
    frame.save(tmp_path / "a.exr")
    if not cv2.haveImageReader(str(tmp_path / "a.exr")):
        pytest.skip("this OpenCV was built without OpenEXR")
    stored = cv2.imread(str(tmp_path / "a.exr"), cv2.IMREAD_UNCHANGED)
    assert stored is not None and (stored[..., 2::-1] == frame["color"][..., :3]).all()

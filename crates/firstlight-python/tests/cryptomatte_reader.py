"""A second reader of Cryptomatte, after Psyop's specification, version 1.2, and nothing of firstlight."""

import json
import re
import struct

import numpy as np
import OpenEXR


def murmur3_32(data, seed=0):
    """MurmurHash3_x86_32, written from its description."""

    def mixed(k):
        k = k * 0xCC9E2D51 % 2**32
        return (k << 15 | k >> 17) % 2**32 * 0x1B873593 % 2**32

    h = seed
    whole = len(data) // 4 * 4
    for (k,) in struct.iter_unpack("<I", data[:whole]):
        h ^= mixed(k)
        h = ((h << 13 | h >> 19) * 5 + 0xE6546B64) % 2**32
    if data[whole:]:
        h ^= mixed(int.from_bytes(data[whole:], "little"))
    h ^= len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        h = (h ^ h >> shift) * factor % 2**32
    return h ^ h >> 16


def id_of(name):
    """The 32-bit float that stands for a name."""
    bits = murmur3_32(name.encode())
    exponent = min(max(bits >> 23 & 255, 1), 254)
    return struct.unpack("<f", struct.pack("<I", bits & ~(255 << 23) | exponent << 23))[0]


class Layer:
    """A layer of Cryptomatte in an EXR file: masks by name."""

    def __init__(self, name, manifest, ranks):
        self.name, self.manifest, self.ranks = name, manifest, ranks

    def mask(self, name):
        wanted = np.float32(id_of(name))
        return sum(np.where(ids == wanted, shares, np.float32(0)) for ids, shares in self.ranks)


def read(path):
    """The layers of a file, by name."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header = dict(file.header())
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    layers = {}
    for key in header:
        if not (match := re.fullmatch(r"cryptomatte/([0-9a-f]{7})/name", key)):
            continue
        about = {what: header[f"cryptomatte/{match[1]}/{what}"] for what in ("name", "hash", "conversion", "manifest")}
        name = about["name"]
        assert f"{struct.unpack('<I', struct.pack('<f', id_of(name)))[0]:08x}"[:7] == match[1]
        assert (about["hash"], about["conversion"]) == ("MurmurHash3_32", "uint32_to_float32")
        manifest = json.loads(about["manifest"])
        for thing, digits in manifest.items():
            assert struct.pack(">f", id_of(thing)).hex() == digits, thing
        ranks = []
        for level in sorted(c[:-2] for c in channels if re.fullmatch(re.escape(name) + r"\d\d\.R", c)):
            r, g, b, a = (channels[f"{level}.{letter}"] for letter in "RGBA")
            assert all(pixels.dtype == np.float32 for pixels in (r, g, b, a))
            ranks += [(r, g), (b, a)]
        layers[name] = Layer(name, manifest, ranks)
    return layers

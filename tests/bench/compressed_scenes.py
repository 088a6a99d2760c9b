#!/usr/bin/env python3
"""Writes a compressed PLY, a SOG archive and an SPZ file of many Gaussians, for measurements of memory and time.

    compressed_scenes.py INRIA.ply COUNT FOLDER

The Gaussians are those of the PLY file, again and again, each time moved by some hundredths of the scene's size. Needs numpy and,
for SOG, Pillow.
"""

import gzip
import io
import json
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np

CHUNK = 256
C0 = 0.28209479177387814


def read(path):
    """The columns of an INRIA PLY file."""
    data = Path(path).read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    lines = data[:end].decode().splitlines()
    names = [line.split()[2] for line in lines if line.startswith("property float")]
    rows = np.frombuffer(data[end:], dtype="<f4").reshape(-1, len(names))
    return {name: rows[:, index] for index, name in enumerate(names)}


def morton(positions):
    """The order of positions along Morton's curve."""
    low, high = positions.min(0), positions.max(0)
    cells = ((positions - low) / (high - low) * 1023).astype(np.uint64)
    key = np.zeros(len(positions), dtype=np.uint64)
    for axis in range(3):
        value = cells[:, axis]
        for bit in range(10):
            key |= ((value >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(key, kind="stable")


def gaussians(path, count):
    """Positions, log scales, quaternions, logits, constant coefficients and the other ones, channel by channel."""
    columns = read(path)
    random = np.random.default_rng(1)
    stack = lambda *names: np.stack([columns[name] for name in names], axis=1)
    rest = [f"f_rest_{index}" for index in range(len([n for n in columns if n.startswith("f_rest_")]))]
    arrays = [
        stack("x", "y", "z"),
        stack("scale_0", "scale_1", "scale_2"),
        stack("rot_0", "rot_1", "rot_2", "rot_3"),
        columns["opacity"],
        stack("f_dc_0", "f_dc_1", "f_dc_2"),
        stack(*rest) if rest else random.normal(0, 0.1, (len(columns["x"]), 45)).astype("<f4"),
    ]
    source = np.arange(count) % len(arrays[0])
    arrays = [array[source] for array in arrays]
    size = arrays[0].std()
    arrays[0] = arrays[0] + random.normal(0, 0.02 * size, arrays[0].shape).astype("<f4")
    # More of them are smaller.
    arrays[1] = arrays[1] - np.float32(np.log(count / len(columns["x"])) / 3)
    arrays[2] = arrays[2] / np.linalg.norm(arrays[2], axis=1, keepdims=True)
    order = morton(arrays[0])
    return [array[order] for array in arrays]


def smallest_three(quaternions, bits):
    """The codes of the three smaller components, and the index of the greatest."""
    largest = np.abs(quaternions).argmax(1)
    sign = np.sign(np.take_along_axis(quaternions, largest[:, None], 1))
    sign[sign == 0] = 1
    others = (quaternions * sign)[np.arange(4)[None] != largest[:, None]].reshape(-1, 3)
    greatest = (1 << bits) - 1
    return np.clip(np.rint((others * np.sqrt(2) + 1) / 2 * greatest), 0, greatest).astype(np.uint32), largest


def compressed_ply(scene, path):
    positions, scales, quaternions, logits, colors, rest = scene
    count = len(positions)
    chunks = -(-count // CHUNK)
    shades = colors * C0 + 0.5

    def bounds(values):
        padded = np.concatenate([values, np.repeat(values[-1:], chunks * CHUNK - count, 0)]).reshape(chunks, CHUNK, 3)
        return padded.min(1), padded.max(1)

    def fractions(values, low, high):
        chunk = np.arange(count) // CHUNK
        span = np.where(high > low, high - low, 1)
        return np.clip((values - low[chunk]) / span[chunk], 0, 1)

    def packed(values, low, high):
        t = fractions(values, low, high)
        x, y, z = (np.rint(t[:, axis] * ((1 << bits) - 1)).astype(np.uint32) for axis, bits in enumerate((11, 10, 11)))
        return x << 21 | y << 11 | z

    all_bounds = [bounds(values) for values in (positions, scales, shades)]
    codes, largest = smallest_three(quaternions, 10)
    color = np.rint(fractions(shades, *all_bounds[2]) * 255).astype(np.uint32)
    opacity = np.rint(255 / (1 + np.exp(-logits))).astype(np.uint32)
    words = np.stack(
        [
            packed(positions, *all_bounds[0]),
            largest.astype(np.uint32) << 30 | codes[:, 0] << 20 | codes[:, 1] << 10 | codes[:, 2],
            packed(scales, *all_bounds[1]),
            color[:, 0] << 24 | color[:, 1] << 16 | color[:, 2] << 8 | opacity,
        ],
        axis=1,
    )
    names = [f"{end}_{name}" for group in ("xyz", ("scale_x", "scale_y", "scale_z"), "rgb") for end in ("min", "max") for name in group]
    header = ["ply", "format binary_little_endian 1.0", f"element chunk {chunks}", *(f"property float {name}" for name in names)]
    header += [f"element vertex {count}", *(f"property uint packed_{name}" for name in ("position", "rotation", "scale", "color"))]
    header += [f"element sh {count}", *(f"property uchar f_rest_{index}" for index in range(rest.shape[1])), "end_header", ""]
    with open(path, "wb") as file:
        file.write("\n".join(header).encode())
        table = np.concatenate([part for low_high in all_bounds for part in low_high], axis=1)
        file.write(table.astype("<f4").tobytes())
        file.write(words.astype("<u4").tobytes())
        file.write(np.clip(np.trunc((rest / 8 + 0.5) * 256), 0, 255).astype(np.uint8).tobytes())


def codebook(values):
    """256 quantiles of the values, and the nearest one of each value."""
    numbers = np.quantile(values[:: max(1, values.size // 1_000_000)], np.linspace(0, 1, 256))
    middles = (numbers[1:] + numbers[:-1]) / 2
    return numbers, np.searchsorted(middles, values).astype(np.uint8)


def sog(scene, path):
    from PIL import Image

    positions, scales, quaternions, logits, colors, rest = scene
    count = len(positions)
    width = -(-int(np.ceil(np.sqrt(count))) // 4) * 4
    height = -(-(-(-count // width)) // 4) * 4
    archive = zipfile.ZipFile(path, "w", zipfile.ZIP_STORED)

    def image(name, components, width=width, height=height):
        pixels = np.full((width * height, 4), 255, dtype=np.uint8)
        pixels[: len(components), : components.shape[1]] = components
        data = io.BytesIO()
        Image.fromarray(pixels.reshape(height, width, 4), "RGBA").save(data, "WEBP", lossless=True, quality=0, method=0, exact=True)
        archive.writestr(name, data.getvalue())
        return [name]

    logs = np.sign(positions) * np.log1p(np.abs(positions))
    low, high = logs.min(0), logs.max(0)
    shorts = np.rint((logs - low) / (high - low) * 65535).astype(np.uint16)
    means = image("means_l.webp", (shorts & 255).astype(np.uint8)) + image("means_u.webp", (shorts >> 8).astype(np.uint8))
    scale_numbers, scale_codes = codebook(scales)
    color_numbers, color_codes = codebook(colors)
    codes, largest = smallest_three(quaternions, 8)
    opacity = np.rint(255 / (1 + np.exp(-logits))).astype(np.uint8)
    # A palette of entries that Gaussians have.
    entries = min(65536, count)
    chosen = np.random.default_rng(2).choice(count, entries, replace=False)
    rest_numbers, rest_codes = codebook(rest[chosen])
    coefficients = rest.shape[1] // 3
    pixels = rest_codes.reshape(entries, 3, coefficients).transpose(0, 2, 1).reshape(-1, 3)
    labels = (np.arange(count) * 40503 % entries).astype(np.uint16)
    meta = {
        "version": 2,
        "count": count,
        "means": {"mins": low.tolist(), "maxs": high.tolist(), "files": means},
        "scales": {"codebook": scale_numbers.tolist(), "files": image("scales.webp", scale_codes)},
        "quats": {"files": image("quats.webp", np.column_stack([codes.astype(np.uint8), (largest + 252).astype(np.uint8)]))},
        "sh0": {"codebook": color_numbers.tolist(), "files": image("sh0.webp", np.column_stack([color_codes, opacity]))},
        "shN": {
            "count": entries,
            "bands": int(np.sqrt(coefficients + 1)) - 1,
            "codebook": rest_numbers.tolist(),
            "files": image("shN_centroids.webp", pixels, 64 * coefficients, -(-entries // 64))
            + image("shN_labels.webp", np.column_stack([labels & 255, labels >> 8]).astype(np.uint8)),
        },
    }
    archive.writestr("meta.json", json.dumps(meta))
    archive.close()


def spz(scene, path):
    """Version 2, whose axes are right, up and back."""
    positions, scales, quaternions, logits, colors, rest = scene
    bits = 12
    flip = np.array([1, -1, -1], dtype=np.float32)
    fixed = np.rint(positions * flip * (1 << bits)).astype("<i4").view(np.uint8).reshape(-1, 3, 4)[:, :, :3]
    quaternions = quaternions * np.where(quaternions[:, :1] < 0, -1, 1)
    xyz = quaternions[:, 1:] * flip
    coefficients = rest.shape[1] // 3
    codes = np.clip(np.rint(rest * 128 + 128), 0, 255).astype(np.uint8).reshape(-1, 3, coefficients).transpose(0, 2, 1)
    with gzip.open(path, "wb", compresslevel=1) as file:
        degree = int(np.sqrt(coefficients + 1)) - 1
        file.write(struct.pack("<4sIIBBBB", b"NGSP", 2, len(positions), degree, bits, 0, 0))
        file.write(fixed.tobytes())
        file.write(np.rint(255 / (1 + np.exp(-logits))).astype(np.uint8).tobytes())
        file.write(np.clip(np.rint((colors * 0.15 + 0.5) * 255), 0, 255).astype(np.uint8).tobytes())
        file.write(np.clip(np.rint((scales + 10) * 16), 0, 255).astype(np.uint8).tobytes())
        file.write(np.clip(np.rint((xyz + 1) * 127.5), 0, 255).astype(np.uint8).tobytes())
        file.write(codes.tobytes())


def main():
    path, count, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    scene = gaussians(path, count)
    compressed_ply(scene, folder / "scene.compressed.ply")
    spz(scene, folder / "scene.spz")
    sog(scene, folder / "scene.sog")


main()

#!/usr/bin/env python3
"""Measures the default view of scenes on a wider picture.

Each scene is drawn by the camera of its default view with twice the angle. What alpha above a half covers there is
compared with the default picture: the part of the area that lies inside of it, and the part of the picture's limiting
side that is filled. Parts that lie apart and together cover less than 0.5 % of the area are floaters and are not counted
in the latter.

    samples/gaurast/tests/framing.py target/release/gaurast SCENE...

It needs Python alone. The exit code is 1 if an object has less than 99.5 % inside, or fills less than 85 % or more than
92 %.
"""

import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import zlib

SIZE = (640, 360)
FLOATERS = 0.005


def alphas(path):
    """The width, the height and the rows of alphas of a PNG file of 8-bit RGBA."""
    data = open(path, "rb").read()
    at, packed, width, height = 8, b"", 0, 0
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        chunk = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", chunk[:10])
            assert (depth, color) == (8, 6), "8-bit RGBA"
        elif kind == b"IDAT":
            packed += chunk
        at += 12 + length
    data, stride = zlib.decompress(packed), 4 * width
    above, rows = bytearray(stride), []
    for y in range(height):
        start = y * (stride + 1)
        filter, row = data[start], bytearray(data[start + 1 : start + 1 + stride])
        # The alphas are the last of each four bytes, and each filter works on them alone.
        for x in range(3, stride, 4):
            left = row[x - 4] if x > 3 else 0
            up, corner = above[x], above[x - 4] if x > 3 else 0
            if filter == 1:
                row[x] = (row[x] + left) & 255
            elif filter == 2:
                row[x] = (row[x] + up) & 255
            elif filter == 3:
                row[x] = (row[x] + (left + up) // 2) & 255
            elif filter == 4:
                guess = left + up - corner
                near = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))
                row[x] = (row[x] + near[2]) & 255
        rows.append([row[x] for x in range(3, stride, 4)])
        above = row
    return width, height, rows


def components(covered):
    """The connected parts of a set of pixels, the smallest first."""
    covered, parts = set(covered), []
    while covered:
        part = [covered.pop()]
        for x, y in part:
            for near in [(x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]:
                if near in covered:
                    covered.remove(near)
                    part.append(near)
        parts.append(part)
    return sorted(parts, key=len)


def measure(gaurast, scene, options):
    """Whether it is an object, the part of the area inside, and the part of the limiting side that is filled."""
    info = subprocess.run([gaurast, "info", scene, "--json"], capture_output=True, text=True, check=True)
    is_object = json.loads(info.stdout)["framed"].get("object", True)
    size = ["--size", "%dx%d" % SIZE]
    frame = subprocess.run([gaurast, scene, "--frame", *size, *options], capture_output=True, text=True, check=True)
    [view] = json.loads(frame.stdout)
    fov = view.get("fov", 50.0)
    with tempfile.TemporaryDirectory() as folder:
        path, picture = os.path.join(folder, "wide.json"), os.path.join(folder, "wide.png")
        json.dump([{**view, "fov": 2 * fov}], open(path, "w"))
        draw = [gaurast, scene, "--path", path, "--background", "transparent", "-q", "-o", picture, *size, *options]
        subprocess.run(draw, check=True)
        width, height, rows = alphas(picture)
    covered = [(x, y) for y, row in enumerate(rows) for x, alpha in enumerate(row) if alpha > 127]
    if not covered:
        return is_object, 0.0, 0.0
    share = math.tan(math.radians(fov / 2)) / math.tan(math.radians(fov))
    half = (width / 2 * share, height / 2 * share)
    middle = (width / 2, height / 2)
    inside = sum(abs(x + 0.5 - middle[0]) <= half[0] and abs(y + 0.5 - middle[1]) <= half[1] for x, y in covered)
    left, kept = FLOATERS * len(covered), []
    for part in components(covered):
        if len(part) <= left:
            left -= len(part)
        else:
            left, kept = 0, kept + part
    sides = [max(pixel[axis] for pixel in kept) + 1 - min(pixel[axis] for pixel in kept) for axis in (0, 1)]
    return is_object, inside / len(covered), max(sides[axis] / (2 * half[axis]) for axis in (0, 1))


def main():
    gaurast, *scenes = sys.argv[1:]
    options = [scene for scene in scenes if scene.startswith("--")]
    wrong = 0
    for scene in scenes:
        if scene in options:
            continue
        is_object, inside, filled = measure(gaurast, scene, options)
        right = not is_object or inside >= 0.995 and 0.85 <= filled <= 0.92
        wrong += not right
        print(f"{scene}: {100 * inside:.2f} % of the area inside, {100 * filled:.1f} % of the limiting side"
              + ("" if is_object else ", of surroundings") + ("" if right else " (not right)"), flush=True)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()

"""Projects points through lenses by OpenCV and by COLMAP, and writes the answers of the test beside this script.

    python3 project.py [DIRECTIONS RADII [FILE]]

It needs opencv-python-headless and pycolmap of PyPI. The file is `projected.json` beside this script, of 6 directions and 6 radii,
unless others are given. Each lens has a line of COLMAP's cameras.txt, whose coefficients are those of real cameras, or a little
stronger, or a distortion in our own form. Points are in the camera's coordinates, at radii up to the fold, which is looked for
on a fine grid here, or up to what the other program projects.
"""

import json
import math
import sys
from pathlib import Path

import cv2
import numpy as np
import pycolmap

WIDTH, HEIGHT = 4000, 3000
SIMPLE = [2900.0, 2010.5, 1489.25]
FULL = [2900.0, 2880.0, 2010.5, 1489.25]
WIDE = [1150.0, 1140.0, 2010.5, 1489.25]

# The greatest ideal radius: 75 degrees of a pinhole, 85 of a fisheye. Both programs project what is in front alone.
GREATEST = {False: math.tan(math.radians(75.0)), True: math.radians(85.0)}

# Focal lengths with the principal point, coefficients, and the factor of the radial part by the square of the ideal radius.
COLMAP = {
    "SIMPLE_RADIAL": (SIMPLE, [-0.08], lambda s, k: 1 + k[0] * s),
    "RADIAL": (SIMPLE, [-0.21, 0.01], lambda s, k: 1 + s * (k[0] + s * k[1])),
    "OPENCV": (FULL, [-0.35, 0.05, 0.0012, -0.0008], lambda s, k: 1 + s * (k[0] + s * k[1])),
    "FULL_OPENCV": (
        FULL,
        [0.42, -0.11, -0.0006, 0.0009, 0.013, 0.77, -0.05, 0.021],
        lambda s, k: (1 + s * (k[0] + s * (k[1] + s * k[4]))) / (1 + s * (k[5] + s * (k[6] + s * k[7]))),
    ),
    "FOV": (FULL, [0.92], lambda s, k: np.arctan(2 * np.sqrt(s) * math.tan(k[0] / 2)) / (np.sqrt(s) * k[0])),
    "SIMPLE_DIVISION": (SIMPLE, [-0.19], lambda s, k: 2 / (1 + np.sqrt(1 - 4 * k[0] * s))),
    # Its fold is where the root is of 0.
    "DIVISION": (FULL, [0.11], lambda s, k: 2 / (1 + np.sqrt(1 - 4 * k[0] * s))),
    "SIMPLE_RADIAL_FISHEYE": (SIMPLE, [-0.045], lambda s, k: 1 + k[0] * s),
    "RADIAL_FISHEYE": (SIMPLE, [0.031, -0.012], lambda s, k: 1 + s * (k[0] + s * k[1])),
    "OPENCV_FISHEYE": (WIDE, [0.034, -0.009, 0.0051, -0.0061], lambda s, k: 1 + s * np.polyval(k[::-1], s)),
    "THIN_PRISM_FISHEYE": (
        WIDE,
        [-0.021, 0.0043, 0.0007, -0.0011, -0.0026, 0.0004, 0.0013, -0.0009],
        lambda s, k: 1 + s * np.polyval([k[5], k[4], k[1], k[0]], s),
    ),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        WIDE,
        [0.399, -0.356, 0.172, 0.021, -0.047, 0.0108, 0.0009, -0.0004, 0.0016, -0.0003, -0.0007, 0.0002],
        lambda s, k: 1 + s * np.polyval(k[5::-1], s),
    ),
    # The angle is the ideal radius.
    "EUCM": (WIDE, [0.58, 1.12], lambda s, k: unified(np.sqrt(s), *k) / np.sqrt(s)),
}

# The models of fisheyes.
FISHEYES = {name for name in COLMAP if "FISHEYE" in name or name == "EUCM"}

# OpenCV's twelve coefficients, of which COLMAP's models have eight at most, in its order: k1, k2, p1, p2, k3 to k6, s1 to s4.
TWELVE = [0.31, -0.09, 0.0011, -0.0007, 0.008, 0.52, -0.03, 0.015, 0.0021, -0.0006, -0.0014, 0.0004]


def unified(angle, alpha, beta):
    """The radius of EUCM at an angle."""
    sine, cosine = np.sin(angle), np.cos(angle)
    return sine / (alpha * np.sqrt(beta * sine**2 + cosine**2) + (1 - alpha) * cosine)


def first_fold(factor, coefficients, greatest):
    """The radius at which the lens folds, or None if that is beyond the greatest one."""
    radii = np.linspace(0, greatest, 4_000_001)[1:]
    with np.errstate(invalid="ignore"):
        places = radii * factor(radii * radii, coefficients)
        rises = np.diff(places) > 0
    return None if rises.all() else float(radii[np.argmin(rises)])


def points_up_to(radius, is_fisheye, directions, radii):
    """Points at `radii` radii before this one, the last one close to it, each in some directions."""
    points = []
    for i in range(radii):
        share = min((i + 0.5) / (radii - 0.5), 0.999)
        for j in range(directions):
            turn = 2 * math.pi * (j + 0.3 * i + 0.1) / directions
            ideal = radius * share
            slope = math.tan(ideal) if is_fisheye else ideal
            depth = 1.0 + 0.25 * j
            points.append([depth * slope * math.cos(turn), depth * slope * math.sin(turn), depth])
    # As the file has them.
    return np.round(points, 7)


def of_opencv(parameters, coefficients, points, is_fisheye):
    fx, fy, cx, cy = parameters
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    project = cv2.fisheye.projectPoints if is_fisheye else cv2.projectPoints
    places, *_ = project(points.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), matrix, np.array(coefficients))
    return places.reshape(-1, 2)


def case(name, program, camera, fold, points, places):
    rows = np.round(np.concatenate([points, places], axis=1), 7)
    assert np.isfinite(rows).all(), name
    return {"name": name, "program": program, **camera, "fold": fold, "points": rows.tolist()}


def cases(directions, radii):
    for name, (head, coefficients, factor) in COLMAP.items():
        is_fisheye = name in FISHEYES
        greatest = GREATEST[is_fisheye]
        fold = first_fold(factor, coefficients, greatest)
        points = points_up_to(fold or greatest, is_fisheye, directions, radii)
        camera = {"colmap": " ".join(map(str, [name, WIDTH, HEIGHT, *head, *coefficients]))}
        lens = pycolmap.Camera(model=name, width=WIDTH, height=HEIGHT, params=head + coefficients)
        yield case(name, "pycolmap", camera, fold, points, np.array(lens.img_from_cam(points)))
        if name in ("OPENCV", "FULL_OPENCV", "OPENCV_FISHEYE"):
            yield case(name, "cv2", camera, fold, points, of_opencv(head, coefficients, points, is_fisheye))
    k1, k2, p1, p2, k3, k4, k5, k6, *thin_prism = TWELVE
    radial = [k1, k2, k3, k4, k5, k6]
    distortion = {"model": "rational", "radial": radial, "tangential": [p1, p2], "thin_prism": thin_prism}
    fold = first_fold(COLMAP["FULL_OPENCV"][2], TWELVE, GREATEST[False])
    points = points_up_to(fold or GREATEST[False], False, directions, radii)
    camera = {"focal": FULL[:2], "principal": FULL[2:], "distortion": distortion}
    yield case("twelve coefficients", "cv2", camera, fold, points, of_opencv(FULL, TWELVE, points, False))


def main():
    directions, radii = map(int, sys.argv[1:3] or (6, 6))
    path = sys.argv[3] if len(sys.argv) > 3 else Path(__file__).parent / "projected.json"
    lines = ",\n".join(json.dumps(one) for one in cases(directions, radii))
    Path(path).write_text(f"[{lines}]\n")


if __name__ == "__main__":
    main()

"""Draws the cases of the manifest beside it by NumPy in binary64, from the clauses that they name, and compares the pictures.

    python3 reference.py [CASE...]

It shares no code with the oracle, whose pictures it must match to within 1e-6. It is as plain as the texts: every Gaussian is
evaluated at every pixel.
"""

from __future__ import annotations

import base64
import json
import re
import struct
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

HERE = Path(__file__).parent
TOLERANCE = 1e-6


class Gaussians(NamedTuple):
    """Gaussians in the axes of their file."""

    means: np.ndarray  # [N, 3]
    covariances: np.ndarray  # [N, 3, 3]
    opacities: np.ndarray  # [N]
    harmonics: np.ndarray  # [N, K, 3]
    turns: np.ndarray  # [N, 3, 3]: the rotation of the node


class Rules(NamedTuple):
    """What renderers do differently."""

    ceiling: float
    by_distance: bool
    cut_off: str
    ratio_floor: float


RULES = {
    # diff-gaussian-rasterization: forward.cu, auxiliary.h
    "inria": Rules(0.99, False, "square", 0.000025),
    # gsplat 1.6: Common.h, Utils.cuh, ProjectionEWA3DGSFused.cu
    "gsplat": Rules(0.99, False, "rectangle", 0.005**2),
    # gsplat 1.5
    "gsplat-1.5": Rules(0.999, False, "rectangle", 0.0),
    # KHR_gaussian_splatting: "3 sigma cut-off", "cameraDistance"
    "gltf": Rules(0.99, True, "ellipse", 0.0),
    # UsdVol: sortingModeHint, whose fallback is zDepth
    "usd": Rules(0.99, False, "none", 0.0),
}


def rotation_matrices(quaternions: np.ndarray) -> np.ndarray:
    """Matrices of quaternions x, y, z, w."""
    x, y, z, w = (quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def placed(means: Any, quaternions: Any, scales: Any, opacities: Any, harmonics: Any, matrix: np.ndarray) -> Gaussians:
    """Gaussians within a node of a matrix [4, 4] of columns."""
    means, quaternions, scales = (np.asarray(array, np.float64) for array in (means, quaternions, scales))
    linear = matrix[:3, :3]
    c = linear @ (rotation_matrices(quaternions) * scales[:, None, :])
    # The rotation of the polar decomposition.
    left, _, right = np.linalg.svd(linear)
    return Gaussians(
        means @ linear.T + matrix[:3, 3],
        c @ c.transpose(0, 2, 1),
        np.asarray(opacities, np.float64).reshape(-1),
        np.asarray(harmonics, np.float64),
        np.repeat((left @ right)[None], len(means), axis=0),
    )


def joined(parts: list[Gaussians]) -> Gaussians:
    """All Gaussians of several nodes."""
    return Gaussians(*(np.concatenate(arrays) for arrays in zip(*parts)))


# glTF 2.0


def gltf_scene(path: Path) -> Gaussians:
    """The Gaussians of a glTF file's scene."""
    file = json.loads(path.read_text())
    buffer = base64.b64decode(file["buffers"][0]["uri"].split(",")[1])
    types = {5120: ("b", 127), 5121: ("B", 255), 5122: ("<i2", 32767), 5123: ("<u2", 65535), 5126: ("<f4", 1)}
    widths = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}

    def elements(view: int, offset: int, kind: str, width: int, count: int) -> np.ndarray:
        view = file["bufferViews"][view]
        size = np.dtype(kind).itemsize * width
        stride = view.get("byteStride", size)
        start = view.get("byteOffset", 0) + offset
        rows = [buffer[start + stride * at : start + stride * at + size] for at in range(count)]
        return np.array([np.frombuffer(row, kind) for row in rows])

    def values(number: int) -> np.ndarray:
        accessor = file["accessors"][number]
        kind, greatest = types[accessor["componentType"]]
        width, count = widths[accessor["type"]], accessor["count"]
        if "bufferView" in accessor:
            array = elements(accessor["bufferView"], accessor.get("byteOffset", 0), kind, width, count)
        else:
            array = np.zeros((count, width))
        array = array.astype(np.float64)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            indices = elements(sparse["indices"]["bufferView"], 0, types[sparse["indices"]["componentType"]][0], 1, sparse["count"])
            array[indices[:, 0]] = elements(sparse["values"]["bufferView"], 0, kind, width, sparse["count"])
        if accessor.get("normalized"):
            array = np.maximum(array / greatest, -1.0)
        return array

    def local(node: dict[str, Any]) -> np.ndarray:
        if "matrix" in node:
            return np.array(node["matrix"], np.float64).reshape(4, 4).T
        matrix = np.eye(4)
        turn = rotation_matrices(np.array([node.get("rotation", [0.0, 0.0, 0.0, 1.0])], np.float64))[0]
        matrix[:3, :3] = turn * np.array(node.get("scale", [1.0, 1.0, 1.0]))
        matrix[:3, 3] = node.get("translation", [0.0, 0.0, 0.0])
        return matrix

    def own(name: str) -> str:
        return f"KHR_gaussian_splatting:{name}"

    parts = []

    def visit(number: int, parent: np.ndarray) -> None:
        node = file["nodes"][number]
        matrix = parent @ local(node)
        for primitive in file["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            attributes = primitive["attributes"]
            names = [own(f"SH_DEGREE_{degree}_COEF_{at}") for degree in range(4) for at in range(2 * degree + 1)]
            harmonics = np.stack([values(attributes[name]) for name in names if name in attributes], axis=1)
            rest = [values(attributes[own(name)]) for name in ("ROTATION", "SCALE", "OPACITY")]
            parts.append(placed(values(attributes["POSITION"]), *rest, harmonics, matrix))
        for child in node.get("children", []):
            visit(child, matrix)

    for root in file["scenes"][file["scene"]]["nodes"]:
        visit(root, np.eye(4))
    return joined(parts)


# OpenUSD


def usd_scene(path: Path) -> tuple[Gaussians, str | None]:
    """The Gaussians of a USD text file, and the hint on their order."""
    matrices = [np.eye(4)]
    attributes: list[dict[str, Any]] = [{}]
    found, hint = [], None
    for line in path.read_text().splitlines():
        line = line.strip()
        if line == "{":
            attributes.append({})
        elif line == "}":
            closed = attributes.pop()
            found = [matrix_of_prim(closed) @ one for one in found] if found else [matrix_of_prim(closed)]
            if "orientations" in closed or "orientationsh" in closed:
                prim = closed
        elif match := re.fullmatch(r"(?:uniform )?(\w+)(\[\])? ([\w:]+) = (.*)", line):
            attributes[-1][match[3]] = json.loads(match[4].replace("(", "[").replace(")", "]"))
    del matrices

    def either(name: str) -> np.ndarray:
        return np.array(prim.get(name, prim.get(f"{name}h")), np.float64)

    means = either("positions")
    w, x, y, z = either("orientations").T
    degree = prim["radiance:sphericalHarmonicsDegree"]
    harmonics = either("radiance:sphericalHarmonicsCoefficients").reshape(len(means), (degree + 1) ** 2, 3)
    hint = prim.get("sortingModeHint")
    quaternions = np.stack([x, y, z, w], axis=-1)
    return placed(means, quaternions, either("scales"), either("opacities"), harmonics, found[0]), hint


def matrix_of_prim(attributes: dict[str, Any]) -> np.ndarray:
    """The matrix of a prim's stack of operations, of which the last is applied to points first."""
    matrix = np.eye(4)
    for name in attributes.get("xformOpOrder", []):
        value, operation = attributes[name], np.eye(4)
        kind = name.removeprefix("xformOp:")
        if kind == "translate":
            operation[:3, 3] = value
        elif kind == "scale":
            operation[:3, :3] = np.diag(value)
        else:
            axis = "XYZ".index(kind.removeprefix("rotate"))
            angle, (a, b) = np.radians(value), ((axis + 1) % 3, (axis + 2) % 3)
            operation[a, a] = operation[b, b] = np.cos(angle)
            operation[b, a], operation[a, b] = np.sin(angle), -np.sin(angle)
        matrix = matrix @ operation
    return matrix


# PLY of 3DGS


def ply_scene(path: Path) -> Gaussians:
    """The Gaussians of a text PLY of degree 0: logarithms of scales, logits of opacities, quaternions w, x, y, z."""
    header, body = path.read_text().split("end_header\n")
    names = re.findall(r"property float (\w+)", header)
    # Numbers of the file are binary32.
    rows = np.array([line.split() for line in body.splitlines()], np.float32).astype(np.float64)
    columns = dict(zip(names, rows.T))

    def stack(text: str) -> np.ndarray:
        return np.stack([columns[name] for name in text.split()], axis=-1)

    opacities = 1.0 / (1.0 + np.exp(-columns["opacity"]))
    harmonics = stack("f_dc_0 f_dc_1 f_dc_2")[:, None, :]
    scales = np.exp(stack("scale_0 scale_1 scale_2"))
    return placed(stack("x y z"), stack("rot_1 rot_2 rot_3 rot_0"), scales, opacities, harmonics, np.eye(4))


# Rendering


def colors_of(gaussians: Gaussians, eye: np.ndarray) -> np.ndarray:
    """Colours by the real spherical harmonics with the Condon-Shortley phase, of the direction from the camera."""
    directions = gaussians.means - eye
    directions = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    # Harmonics turn with the node: the direction is taken to the mesh's axes.
    x, y, z = np.einsum("nij,ni->nj", gaussians.turns, directions).T
    pi = np.pi
    functions = [
        np.full_like(x, 0.5 * np.sqrt(1 / pi)),
        -np.sqrt(3 / (4 * pi)) * y,
        np.sqrt(3 / (4 * pi)) * z,
        -np.sqrt(3 / (4 * pi)) * x,
        0.5 * np.sqrt(15 / pi) * x * y,
        -0.5 * np.sqrt(15 / pi) * y * z,
        0.25 * np.sqrt(5 / pi) * (3 * z * z - 1),
        -0.5 * np.sqrt(15 / pi) * x * z,
        0.25 * np.sqrt(15 / pi) * (x * x - y * y),
        -0.25 * np.sqrt(35 / (2 * pi)) * y * (3 * x * x - y * y),
        0.5 * np.sqrt(105 / pi) * x * y * z,
        -0.25 * np.sqrt(21 / (2 * pi)) * y * (5 * z * z - 1),
        0.25 * np.sqrt(7 / pi) * z * (5 * z * z - 3),
        -0.25 * np.sqrt(21 / (2 * pi)) * x * (5 * z * z - 1),
        0.25 * np.sqrt(105 / pi) * z * (x * x - y * y),
        -0.25 * np.sqrt(35 / (2 * pi)) * x * (x * x - 3 * y * y),
    ]
    count = gaussians.harmonics.shape[1]
    sums = np.einsum("kn,nkc->nc", np.array(functions[:count]), gaussians.harmonics)
    return np.maximum(sums + 0.5, 0.0)


def within(rules: Rules, mean: np.ndarray, covariance: np.ndarray, opacity: float, q: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """True where the renderer draws a Gaussian at all. `pixels` are the columns and rows [2, H, W]."""
    (xx, xy), (_, yy) = covariance
    tiles = pixels // 16
    if rules.cut_off == "ellipse":
        return q <= 9.0
    if rules.cut_off == "square":
        middle = 0.5 * (xx + yy)
        greatest = middle + np.sqrt(max(0.1, middle * middle - (xx * yy - xy * xy)))
        radius = np.ceil(3.0 * np.sqrt(greatest))
        # Centres of pixels are whole numbers there.
        low = np.floor((mean - 0.5 - radius) / 16)
        high = np.floor((mean - 0.5 + radius + 15) / 16)
    elif rules.cut_off == "rectangle":
        extent = min(3.33, np.sqrt(2.0 * np.log(opacity * 255.0)))
        radius = np.ceil(extent * np.sqrt([xx, yy]))
        low, high = np.floor((mean - radius) / 16), np.ceil((mean + radius) / 16)
    else:
        return np.ones_like(q, bool)
    inside = (low[:, None, None] <= tiles) & (tiles < high[:, None, None])
    return inside.all(axis=0)


def picture(case: dict[str, Any]) -> np.ndarray:
    """The picture [H, W, 4] of a case: colours times alpha, and alpha."""
    rules, camera = RULES[case["as"]], case["camera"]
    scene = HERE / case["scene"]
    if scene.suffix == ".gltf":
        gaussians = gltf_scene(scene)
    elif scene.suffix == ".ply":
        gaussians = ply_scene(scene)
    else:
        gaussians, hint = usd_scene(scene)
        rules = rules._replace(by_distance=hint == "cameraDistance")
    matrix = np.array(camera["world_to_camera"])
    turn, moved = matrix[:, :3], matrix[:, 3]
    eye = -np.linalg.solve(turn, moved)
    seen = gaussians.means @ turn.T + moved
    colors = colors_of(gaussians, eye)
    keys = np.linalg.norm(seen, axis=-1) if rules.by_distance else seen[:, 2]
    width, height = camera["width"], camera["height"]
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)))
    fx, fy = camera["focal"]
    cx, cy = camera["principal"]
    total, transmittance = np.zeros((height, width, 3)), np.ones((height, width))
    is_open = np.ones((height, width), bool)
    for at in np.argsort(keys.astype(np.float32), kind="stable"):
        x, y, z = seen[at]
        if z <= np.float32(camera["near"]):
            continue
        # 3DGS's limit of the slopes in J: 1.3 times those of the picture's edges.
        u, v = np.clip(x / z, -0.65 * width / fx, 0.65 * width / fx), np.clip(y / z, -0.65 * height / fy, 0.65 * height / fy)
        jacobian = np.array([[fx / z, 0.0, -fx * u / z], [0.0, fy / z, -fy * v / z]])
        to_plane = jacobian @ turn
        before = to_plane @ gaussians.covariances[at] @ to_plane.T
        covariance = before + 0.3 * np.eye(2)
        opacity = gaussians.opacities[at]
        if "--antialiasing" in case["options"]:
            opacity *= np.sqrt(max(np.linalg.det(before) / np.linalg.det(covariance), rules.ratio_floor))
        mean = np.array([fx * x / z + cx, fy * y / z + cy])
        away = pixels + 0.5 - mean[:, None, None]
        q = np.einsum("ihw,ij,jhw->hw", away, np.linalg.inv(covariance), away)
        alpha = opacity * np.exp(-0.5 * q)
        counts = is_open & (alpha >= np.float32(1 / 255))
        if not counts.any():
            continue
        counts &= within(rules, mean, covariance, opacity, q, pixels)
        alpha = np.minimum(alpha, np.float32(rules.ceiling))
        rest = transmittance * (1.0 - alpha)
        is_open &= ~(counts & (rest < np.float32(1e-4)))
        counts &= is_open
        total += np.where(counts, transmittance * alpha, 0.0)[..., None] * colors[at]
        transmittance = np.where(counts, rest, transmittance)
    return np.concatenate([total, 1.0 - transmittance[..., None]], axis=-1)


def exr(path: Path) -> np.ndarray:
    """The picture [H, W, 4] of an OpenEXR file without compression."""
    data = path.read_bytes()
    at, header = 8, {}
    while data[at]:
        name, kind, rest = data[at:].split(b"\0", 2)
        at = len(data) - len(rest)
        (size,) = struct.unpack_from("<i", data, at)
        header[name.decode()] = data[at + 4 : at + 4 + size]
        at += 4 + size
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    names = re.findall(rb"(\w+)\0.{16}", header["channels"], re.DOTALL)
    if header["compression"] != b"\0" or sorted(names) != [b"A", b"B", b"G", b"R"]:
        raise ValueError(f"{path}: this reads four channels without compression")
    pixels = np.empty((height, width, 4))
    for offset in struct.unpack_from(f"<{height}q", data, at + 1):
        row, size = struct.unpack_from("<2i", data, offset)
        planes = np.frombuffer(data, "<f4", size // 4, offset + 8).reshape(4, width)
        for plane, name in zip(planes, names):
            pixels[row - top, :, b"RGBA".index(name)] = plane
    return pixels


def main() -> int:
    """Compares the cases of the command line, or all."""
    cases = json.loads((HERE / "manifest.json").read_text())["cases"]
    wanted = sys.argv[1:]
    far = 0
    for case in cases:
        if wanted and case["name"] not in wanted:
            continue
        apart = np.abs(picture(case) - exr(HERE / case["picture"])).max()
        far += int(not apart <= TOLERANCE)
        print(f"{case['name']}: {apart:.1e}")
    print(f"{far} of {len(wanted) or len(cases)} differ by more than {TOLERANCE}")
    return 1 if far else 0


if __name__ == "__main__":
    sys.exit(main())

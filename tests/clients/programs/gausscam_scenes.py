"""gausscam: draws the scenes of tests/compliance that it can to a folder, and compares the pictures: gausscam_scenes.py FOLDER.

gausscam takes constant harmonics alone and no linear colours. It sorts by depth, so that the two scenes that ask for another order differ.
"""

import json
import sys
from pathlib import Path

import numpy as np
from gausscam.backends.webgpu import Pipeline, pick_variant
from PIL import Image
from wgpu.backends.wgpu_native.extras import set_instance_extras

compliance = Path(__file__).parents[2] / "compliance"
sys.path.insert(0, str(compliance))
import reference  # noqa: E402

SCENES = {".gltf": reference.gltf_scene, ".ply": reference.ply_scene, ".usda": lambda path: reference.usd_scene(path)[0]}


def quaternions_and_scales(covariances):
    """Rotations w, x, y, z and scales of covariances."""
    variances, axes = np.linalg.eigh(covariances)
    axes[np.linalg.det(axes) < 0.0, :, 0] *= -1.0
    quaternions = []
    for m in axes:
        # The eigenvector of the largest eigenvalue (Bar-Itzhack 2000), which no axis makes unstable.
        k = np.array(
            [
                [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
                [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
                [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], 0],
                [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m.trace()],
            ]
        )
        x, y, z, w = np.linalg.eigh(k)[1][:, -1]
        quaternions.append([w, x, y, z])
    return np.array(quaternions), np.sqrt(np.maximum(variances, 0.0))


def draw(case):
    """The picture of a case, or None if gausscam cannot be asked for it."""
    camera = case["camera"]
    width, height = camera["width"], camera["height"]
    scene = compliance / case["scene"]
    gaussians = SCENES[scene.suffix](scene)
    is_centred = camera["principal"] == [width / 2, height / 2] and camera["focal"][0] == camera["focal"][1]
    if gaussians.harmonics.shape[1] > 1 or not is_centred or "lin" in case["colorSpace"]:
        return None
    rotations, scales = quaternions_and_scales(gaussians.covariances)
    matrix = np.array(camera["world_to_camera"])
    turn = matrix[:, :3]
    eye = -np.linalg.solve(turn, matrix[:, 3])
    arrays = {
        "xyz": np.ascontiguousarray(gaussians.means, np.float32),
        "rot": np.ascontiguousarray(rotations, np.float32),
        "scale": np.ascontiguousarray(scales, np.float32),
        "opacity": np.ascontiguousarray(gaussians.opacities, np.float32),
        "sh": np.ascontiguousarray(gaussians.harmonics[:, 0, :], np.float32),
        "slots": np.zeros(0, np.int32),
        "W": np.int32(width),
        "H": np.int32(height),
        "fovy": np.float32(np.degrees(2.0 * np.arctan(0.5 * height / camera["focal"][1]))),
        "cam_pos": eye[None].astype(np.float32),
        # Axes to the right, upwards and backwards.
        "cam_xmat": (turn.T * [1.0, -1.0, -1.0])[None].astype(np.float32),
    }
    pipeline = Pipeline(arrays, "", variant=pick_variant(""), cap=4096)
    return pipeline.unpack(*pipeline.render_frame())[0][0]


# They are sorted by distances.
OTHER_ORDER = {"gltf-sort-distance", "gltf-sort-default"}

set_instance_extras(backends=["Vulkan"], flags=["AllowUnderlyingNoncompliantAdapter"])
folder = Path(sys.argv[1])
folder.mkdir(exist_ok=True)
normative, differ = 0, set()
for case in json.loads((compliance / "manifest.json").read_text())["cases"]:
    found = draw(case)
    if found is None:
        continue
    Image.fromarray(found).save(folder / f"{case['name']}.png")
    if case["level"] == "normative":
        normative += 1
        expected = np.clip(reference.exr(compliance / case["picture"])[..., :3], 0.0, 1.0)
        # gausscam truncates to bytes.
        if np.abs(found / 255.0 - expected).max() > case["tolerance"] + 1.0 / 255.0:
            differ.add(case["name"])
assert differ == OTHER_ORDER, sorted(differ)
print(f"{normative - len(differ)} of {normative} scenes within their tolerance, the others sorted by distance")

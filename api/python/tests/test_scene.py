"""Scenes, cameras and pictures."""

from __future__ import annotations

import dataclasses
import pickle
import struct
import zlib

import numpy as np
import pytest

import gaurast


@pytest.fixture(scope="module")
def garden():
    return gaurast.garden(1, 2000)


def test_arrays_are_views(garden):
    assert garden.means.shape == (len(garden), 3) and garden.quats.shape == (len(garden), 4)
    assert garden.scales.shape == (len(garden), 3) and garden.opacities.shape == (len(garden),)
    assert garden.harmonics.shape == (len(garden), (garden.sh_degree + 1) ** 2, 3)
    for array in garden.arrays:
        assert array.dtype == np.float32 and not array.flags.writeable and not array.flags.owndata
    means = gaurast.garden(1, 100).means
    assert np.isfinite(means).all(), "the array keeps its scene alive"


def test_a_scene_of_arrays_has_them(garden):
    copy = gaurast.Scene.from_arrays(*garden.arrays)
    assert all(np.array_equal(a, b) for a, b in zip(copy.arrays, garden.arrays))
    size = (64, 36)
    assert np.array_equal(gaurast.render(copy, size=size), gaurast.render(garden, size=size))
    red = gaurast.Scene.from_arrays([[0, 0, 2]], [[1, 0, 0, 0]], [[0.1] * 3], [0.9], colors=[[1, 0, 0]])
    camera = gaurast.Camera.look_at((0, 0, 0), (0, 0, 1), size=(9, 9))
    assert np.allclose(gaurast.render(red, camera)[0, 4, 4], [0.9, 0, 0, 0.9], atol=1e-6)


def test_wrong_arrays_are_named(garden):
    means, quats, scales, opacities, harmonics = garden.arrays
    with pytest.raises(ValueError, match="scales has the shape"):
        gaurast.Scene.from_arrays(means, quats, scales[:5], opacities, harmonics)
    with pytest.raises(ValueError, match="either harmonics or colors"):
        gaurast.Scene.from_arrays(means, quats, scales, opacities)
    with pytest.raises(ValueError, match="harmonics has the shape"):
        gaurast.Scene.from_arrays(means, quats, scales, opacities, harmonics[:, :0])


@pytest.mark.parametrize("degree", [0, 1, 3])
def test_ply_files_come_back(tmp_path, degree):
    random = np.random.default_rng(degree)
    harmonics = random.normal(0, 1, (50, (degree + 1) ** 2, 3))
    scene = gaurast.Scene.from_arrays(
        random.normal(0, 1, (50, 3)), random.normal(0, 1, (50, 4)), random.uniform(0.01, 2, (50, 3)), random.uniform(0.01, 0.99, 50), harmonics
    )
    scene.write_ply(tmp_path / "scene.ply")
    back = gaurast.open(tmp_path / "scene.ply")
    assert back.sh_degree == degree
    for a, b in zip(scene.arrays, back.arrays):
        assert np.allclose(a, b, rtol=1e-5, atol=1e-6)


def test_scenes_and_cameras_pickle(garden):
    back = pickle.loads(pickle.dumps(garden))
    assert all(np.array_equal(a, b) for a, b in zip(back.arrays, garden.arrays))
    assert back.metadata == garden.metadata and back.origin == garden.origin
    camera = garden.frame((64, 48))
    assert pickle.loads(pickle.dumps(camera)) == camera
    assert repr(camera).startswith("Camera(rotation=") and str(len(garden)) in repr(garden)


def test_a_scene_far_away_pickles():
    means = np.array([[0.25, 0, 2], [0, 0.5, 2]])
    scene = gaurast.Scene.from_arrays(means, [[1, 0, 0, 0]] * 2, [[0.1] * 3] * 2, [0.9] * 2, colors=[[1, 0, 0]] * 2, origin=(1e6, 0, 0))
    back = pickle.loads(pickle.dumps(scene))
    assert back.origin == (1e6, 0.0, 0.0)
    camera = gaurast.Camera.look_at((1e6, 0, 0), (1e6, 0, 1), size=(64, 64))
    assert gaurast.render(back, camera).any() and np.array_equal(gaurast.render(back, camera), gaurast.render(scene, camera))


def test_errors_are_pythons(tmp_path):
    with pytest.raises(FileNotFoundError) as raised:
        gaurast.open(tmp_path / "none.ply")
    assert raised.value.filename == str(tmp_path / "none.ply")
    with pytest.raises(FileNotFoundError):
        gaurast.cameras(tmp_path / "none.json")
    damaged = tmp_path / "damaged.ply"
    damaged.write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nend_header\n")
    with pytest.raises(ValueError, match=r"damaged.ply: .*: "):
        gaurast.open(damaged)
    (tmp_path / "text.txt").write_text("hello")
    with pytest.raises(ValueError, match="not a scene file of a known kind"):
        gaurast.open(tmp_path / "text.txt")
    with pytest.raises(ValueError, match="three letters"):
        gaurast.open(damaged, axes="xyz")


def test_camera_files(tmp_path):
    file = tmp_path / "cameras.json"
    file.write_text(
        '[{"img_name": "a", "width": 64, "height": 48, "position": [1, 2, 3],'
        ' "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 50, "fy": 60}]'
    )
    (camera,) = gaurast.cameras(file)
    assert (camera.name, camera.width, camera.height, tuple(camera.eye)) == ("a", 64, 48, (1.0, 2.0, 3.0))
    again = gaurast.Camera.from_matrices(camera.viewmat, camera.K, 64, 48)
    assert np.allclose(again.eye, camera.eye) and np.allclose(again.rotation, camera.rotation)
    assert again.focal == tuple(camera.focal) and again.principal == tuple(camera.principal)
    with pytest.raises(ValueError, match="not a rotation"):
        gaurast.Camera.from_matrices(2.0 * np.eye(4), camera.K, 64, 48)


def test_lenses_of_camera_files(tmp_path):
    file = tmp_path / "transforms.json"
    file.write_text(
        '{"camera_model": "OPENCV", "fl_x": 50, "w": 64, "h": 48, "k1": -0.25, "p2": 0.125, "frames": [{"file_path": "a.png",'
        ' "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]}'
    )
    (camera,) = gaurast.cameras(file)
    lens = gaurast.Distortion(radial=(-0.25, 0, 0, 0, 0, 0), tangential=(0, 0.125))
    assert camera.distortion == lens and camera.resized((32, 24)).distortion == lens
    assert pickle.loads(pickle.dumps(camera)) == camera
    with pytest.warns(UserWarning, match=r"distortion \(k1 = -0.25, p2 = 0.125\) is left out"):
        (ideal,) = gaurast.cameras(file, undistorted=True)
    assert ideal.distortion is None


def test_lenses_that_no_camera_has_are_refused(garden):
    camera = garden.frame((16, 16))
    for lens, reason in [
        (gaurast.Distortion("barrel"), '"barrel" is not a model of distortion'),
        (gaurast.Distortion("division", (0.1, 0.1, 0, 0, 0, 0)), "a coefficient of the lens"),
    ]:
        with pytest.raises(ValueError, match=reason):
            gaurast.render(garden, dataclasses.replace(camera, distortion=lens))


def test_pictures_of_several_cameras(garden):
    first = garden.frame((64, 36))
    second = gaurast.Camera.look_at((3, -2, -4), (0, 0, 0), size=(64, 36))
    both = gaurast.render(garden, [first, second])
    assert both.shape == (2, 36, 64, 4) and both.dtype == np.float32
    assert np.array_equal(both[0], gaurast.render(garden, first)[0])
    assert np.array_equal(both[1], gaurast.render(garden, second)[0])
    out = np.zeros((2, 36, 64, 4), np.float32)
    given = gaurast.render(garden, [first, second], out=out)
    assert np.array_equal(out, both) and np.shares_memory(given, out)
    with pytest.raises(ValueError, match="one size"):
        gaurast.render(garden, [first, second.resized((32, 18))])
    assert gaurast.render(garden, first, (32, 18)).shape == (1, 18, 32, 4)


def test_settings_have_effects_and_are_checked(garden):
    camera = garden.frame((96, 54))
    plain = gaurast.render(garden, camera)
    for options in [
        {"as_": "gltf"},
        {"order": "per-pixel"},
        {"antialiasing": "compensated"},
        {"precision": "fp16"},
        {"sh_degree": 0},
        {"contribution_budget": 0.2},
    ]:
        picture = gaurast.render(garden, camera, **options)
        same = options == {"sh_degree": 0} and garden.sh_degree == 0
        assert same or not np.array_equal(picture, plain), options
    with pytest.raises(ValueError, match="order='none' is not one of"):
        gaurast.render(garden, camera, order="none")
    with pytest.raises(ValueError, match="panoramas are not drawn in binary16|fp16"):
        gaurast.render(garden, camera, order="per-pixel", precision="fp16")
    over = gaurast.render(garden, camera, background=(0.0, 0.0, 1.0))
    expected = plain[..., 2] + (1.0 - plain.alpha)
    assert np.allclose(over[..., 2], expected, atol=1e-6) and (over.alpha == 1.0).all()


def test_depths_ids_and_features():
    means = [[0.0, 0.0, 2.0], [0.0, 0.0, 4.0], [50.0, 0.0, 3.0]]
    scene = gaurast.Scene.from_arrays(means, [[1, 0, 0, 0]] * 3, [[0.2] * 3] * 3, [0.4, 0.9, 0.9], colors=[[1, 1, 1]] * 3)
    camera = gaurast.Camera.look_at((0, 0, 0), (0, 0, 1), size=(33, 33))
    features = np.array([[1.0, -2.0, 0.0, 5.0], [0.0, 3.0, 1.0, -5.0], [9.0, 9.0, 9.0, 9.0]])
    picture = gaurast.render(scene, camera, depth=True, ids=True, features=features)
    weights = np.array([0.4, 0.6 * 0.9])
    assert np.allclose(picture[0, 16, 16, 3], weights.sum(), atol=1e-6)
    assert np.isclose(picture.depth[0, 16, 16], (weights * [2, 4]).sum() / weights.sum(), atol=1e-5)
    # Transmittance falls below one half at the second.
    assert picture.median_depth[0, 16, 16] == 4.0
    assert (picture.ids[0, 16, 16], picture.nearest_ids[0, 16, 16]) == (1, 0)
    assert np.allclose(picture.features[0, 16, 16], weights @ features[:2], atol=1e-5)
    assert picture.ids[0, 0, 0] == -1 and picture.depth[0, 0, 0] == np.inf and not picture.features[0, 0, 0].any()


def test_png(garden, tmp_path):
    picture = gaurast.render(garden, size=(40, 30))
    picture.save(tmp_path / "a.png")
    data = (tmp_path / "a.png").read_bytes()
    assert data == picture._repr_png_() and data[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", data[16:24]) == (40, 30)
    length = struct.unpack(">I", data[33:37])[0]
    rows = np.frombuffer(zlib.decompress(data[41 : 41 + length]), np.uint8).reshape(30, 121)
    texels = np.asarray(picture)[0, ..., :3].reshape(30, 120)
    assert not rows[:, 0].any() and np.abs(rows[:, 1:] / 255.0 - np.clip(texels, 0, 1)).max() < 0.5 / 255.0 + 1e-6
    assert picture[0]._repr_png_() is None
    assert garden._repr_png_()[:4] == b"\x89PNG"

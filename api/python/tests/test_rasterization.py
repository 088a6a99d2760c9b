"""`rasterization` against a reference in binary64, and against what gsplat's CUDA code drew."""

from __future__ import annotations

import dataclasses
import importlib.util
import threading

import numpy as np
import pytest
from reference import rasterize

import gaurast

MODES = ["RGB", "D", "ED", "RGB+D", "RGB+ED"]


def call(scene, colors, **options):
    return gaurast.rasterization(
        scene.means,
        scene.quats,
        scene.scales,
        scene.opacities,
        colors,
        scene.viewmat[None],
        scene.K[None],
        *scene.size,
        **options,
    )


def expected(scene, colors, render_mode, version="1.6", **options):
    ceiling, ratio_floor = {"1.5": (0.999, 0.0), "1.6": (0.99, 0.005**2)}[version]
    options = {**options, "ceiling": ceiling, "ratio_floor": ratio_floor}
    values, alphas, depths, undecided = rasterize(
        scene.means, scene.quats, scene.scales, scene.opacities, colors, scene.viewmat, scene.K, *scene.size, **options
    )
    mean = np.where(alphas > 0.0, depths / np.maximum(alphas, 1e-10), 0.0)
    last = {"D": [depths[..., None]], "ED": [mean[..., None]]}.get(render_mode.rpartition("+")[2], [])
    parts = ([values] if render_mode.startswith("RGB") else []) + last
    return np.concatenate(parts, axis=-1), alphas, undecided


@pytest.mark.parametrize("seed", range(40))
def test_forty_random_scenes_are_those_of_the_reference(arrays, seed):
    scene = arrays(seed, 120, channels=1 + seed % 5)
    mode = MODES[seed % len(MODES)]
    options = {
        "rasterize_mode": ["classic", "antialiased"][seed // 2 % 2],
        "camera_model": ["pinhole", "ortho"][seed // 4 % 2 if seed % 3 == 0 else 0],
        "eps2d": [0.3, 0.1][seed // 5 % 2],
        "version": ["1.6", "1.5"][seed // 3 % 2],
        "near_plane": [0.01, 4.5][seed // 7 % 2],
        "sh_degree": [None, None, 0, 1, 2, 3][seed % 6],
    }
    colors = scene.colors if options["sh_degree"] is None else scene.harmonics
    picture, alpha, meta = call(scene, colors, render_mode=mode, **options)
    reference, alphas, undecided = expected(scene, colors, mode, **options)
    assert picture.shape == (1, scene.size[1], scene.size[0], reference.shape[-1]) and picture.dtype == np.float32
    assert alpha.shape == (1, scene.size[1], scene.size[0], 1)
    assert (alphas > 0.1).mean() > 0.05, "something is drawn"
    assert undecided.mean() < 0.005
    # Depths are as large as 9.
    scale = np.array([9.0 if index == reference.shape[-1] - 1 and mode != "RGB" else 1.0 for index in range(reference.shape[-1])])
    errors = np.maximum((np.abs(picture[0] - reference) / scale).max(axis=-1), np.abs(alpha[0, ..., 0] - alphas))
    assert errors[~undecided].max() < 1e-4
    assert meta["tile_width"] == -(-scene.size[0] // 16) and meta["n_cameras"] == 1


def test_the_reference_notices_another_ceiling(arrays):
    scene = arrays(0, 120)
    scene.opacities[:] = 1.0
    picture, _, _ = call(scene, scene.colors, version="1.5")
    reference, _, undecided = expected(scene, scene.colors, "RGB", version="1.6")
    assert np.abs(picture[0] - reference)[~undecided].max() > 1e-3


def test_shapes_are_gsplats(arrays):
    scene = arrays(1, 50)
    width, height = scene.size
    views, intrinsics = np.stack([scene.viewmat, np.eye(4)]), np.stack([scene.K, scene.K])
    own = np.stack([scene.colors, scene.colors[::-1]])
    gaussians = [scene.means, scene.quats, scene.scales, scene.opacities]
    one, alpha, _ = gaurast.rasterization(*gaussians, own, views, intrinsics, width, height)
    assert one.shape == (2, height, width, 3) and alpha.shape == (2, height, width, 1)
    for index in range(2):
        alone, _, _ = gaurast.rasterization(*gaussians, own[index], views[index, None], intrinsics[:1], width, height)
        assert np.array_equal(one[index], alone[0])
    batches = [np.stack([array, array]) for array in gaussians]
    two, _, meta = gaurast.rasterization(
        *batches, np.stack([scene.colors] * 2), np.stack([views] * 2), np.stack([intrinsics] * 2), width, height, render_mode="RGB+ED"
    )
    assert two.shape == (2, 2, height, width, 4) and (meta["n_batches"], meta["n_cameras"]) == (2, 2)
    assert np.array_equal(two[0], two[1])
    harmonics, _, _ = gaurast.rasterization(*gaussians, scene.harmonics, views, intrinsics, width, height, sh_degree=3)
    assert harmonics.shape == (2, height, width, 3)


def test_features_and_backgrounds(arrays):
    scene = arrays(2, 80, channels=7)
    background = np.linspace(-1.0, 1.0, 7)[None]
    picture, alpha, _ = call(scene, scene.colors, backgrounds=background)
    plain, _, _ = call(scene, scene.colors)
    assert picture.shape[-1] == 7
    assert np.abs(picture - plain - (1.0 - alpha) * background[:, None, None]).max() < 1e-6
    for channel in range(7):
        alone, _, _ = call(scene, scene.colors[:, channel : channel + 1])
        assert np.abs(alone[..., 0] - plain[..., channel]).max() < 1e-6


def test_covariances_are_scales_and_rotations(arrays):
    scene = arrays(3, 200)
    quats = scene.quats / np.linalg.norm(scene.quats, axis=-1, keepdims=True)
    from reference import rotations

    axes = rotations(quats.astype(np.float64)) * scene.scales[:, None, :]
    covars = axes @ axes.transpose(0, 2, 1)
    picture, _, _ = call(scene, scene.colors)
    scene.quats, scene.scales = None, None
    other, _, _ = call(scene, scene.colors, covars=covars)
    assert np.quantile(np.abs(picture - other), 0.999) < 1e-4


def test_a_fisheye_hides_what_is_before_the_near_plane(arrays):
    scene = arrays(4, 100)
    everything, _, _ = call(scene, scene.colors, camera_model="fisheye")
    some, _, _ = call(scene, scene.colors, camera_model="fisheye", near_plane=5.0)
    nothing, alpha, _ = call(scene, scene.colors, camera_model="fisheye", near_plane=50.0)
    assert np.abs(everything - some).max() > 0.1
    assert not nothing.any() and not alpha.any()


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"radius_clip": 1.0}, "radius_clip"),
        ({"with_eval3d": True}, "with_eval3d"),
        ({"distributed": True}, "distributed"),
        ({"absgrad": True}, "gradients"),
        ({"sparse_grad": True}, "gradients"),
        ({"render_mode": "Ed"}, "render_mode"),
        ({"camera_model": "ftheta"}, "camera_model"),
        ({"tile_size": 8}, "tile_size"),
        ({"rays": np.zeros((1, 6))}, "rays"),
        ({"return_normals": True}, "return_normals"),
    ],
)
def test_what_is_not_supported_is_one_sentence(arrays, options, name):
    scene = arrays(5, 10)
    with pytest.raises(NotImplementedError, match=name) as raised:
        call(scene, scene.colors, **options)
    assert "\n" not in str(raised.value)


RADIAL = [0.12, -0.05, 0.01, 0.02, -0.01, 0.001]
TANGENTIAL = [0.002, -0.003]
THIN_PRISM = [0.004, -0.001, -0.002, 0.0005]


def test_lenses_change_pictures(arrays):
    scene = arrays(9, 120)
    lens = {"radial_coeffs": [RADIAL], "tangential_coeffs": [TANGENTIAL], "thin_prism_coeffs": [THIN_PRISM]}
    ideal, _, _ = call(scene, scene.colors, with_ut=True)
    distorted, _, _ = call(scene, scene.colors, with_ut=True, **lens)
    assert ideal.any() and np.abs(distorted - ideal).max() > 1e-3
    camera = gaurast.Camera.from_matrices(
        scene.viewmat, scene.K, *scene.size, distortion=gaurast.Distortion("rational", RADIAL, TANGENTIAL, THIN_PRISM)
    )
    own = gaurast.Scene.from_arrays(scene.means, scene.quats, scene.scales, scene.opacities, scene.harmonics)
    plain = dataclasses.replace(camera, distortion=None)
    assert np.abs(np.asarray(gaurast.render(own, camera)) - np.asarray(gaurast.render(own, plain))).max() > 1e-3


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"radial_coeffs": np.zeros((1, 6))}, "radial_coeffs need with_ut=True"),
        ({"radial_coeffs": np.zeros((1, 5)), "with_ut": True}, r"radial_coeffs has the shape \(1, 5\), not \(1, 6\)"),
        ({"tangential_coeffs": np.zeros((1, 2)), "with_ut": True, "camera_model": "fisheye"}, "does not go with"),
        ({"radial_coeffs": np.zeros((1, 6)), "with_ut": True, "camera_model": "ortho"}, "does not go with"),
        ({"with_ut": True, "rasterize_mode": "antialiased"}, "with_ut=True goes with"),
    ],
)
def test_lenses_that_gsplat_refuses_are_refused(arrays, options, reason):
    scene = arrays(5, 10)
    with pytest.raises(ValueError, match=reason):
        call(scene, scene.colors, **options)


def test_wrong_shapes_are_named(arrays):
    scene = arrays(6, 10)
    scene.quats = scene.quats[:9]
    with pytest.raises(ValueError, match=r"quats has the shape \(9, 4\), not \(10, 4\)"):
        call(scene, scene.colors)


class OnGpu:
    def __dlpack_device__(self):
        return (2, 0)


class Trained:
    requires_grad = True


def test_tensors_that_are_refused_say_what_to_do(arrays):
    scene = arrays(7, 10)
    with pytest.raises(ValueError, match=r"colors is in a GPU's memory.*colors.cpu\(\)"):
        call(scene, OnGpu())
    with pytest.raises(NotImplementedError, match=r"colors.detach\(\)"):
        call(scene, Trained())


def test_results_are_jaxs_where_arguments_are(arrays):
    if importlib.util.find_spec("jax") is None:
        pytest.skip("jax is missing")
    import jax

    scene = arrays(7, 100)
    picture, alpha, _ = call(scene, scene.colors)
    for name in ("means", "quats", "scales", "opacities", "colors", "viewmat", "K"):
        setattr(scene, name, jax.numpy.asarray(getattr(scene, name)))
    found, alphas, _ = call(scene, scene.colors)
    assert isinstance(found, jax.Array) and isinstance(alphas, jax.Array)
    assert np.array_equal(found, picture) and np.array_equal(alphas, alpha)


def test_results_are_torchs_where_arguments_are(arrays):
    if importlib.util.find_spec("torch") is None:
        pytest.skip("torch is missing")
    import torch

    scene = arrays(7, 100)
    picture, alpha, _ = call(scene, scene.colors)
    given = {name: getattr(scene, name) for name in ("means", "quats", "scales", "opacities", "colors", "viewmat", "K")}

    def drawn(tensor):
        for name, array in given.items():
            setattr(scene, name, tensor(array))
        return call(scene, scene.colors)

    def strided(array):
        return torch.from_numpy(np.stack([array, array], axis=-1))[..., 0]

    for tensor in [torch.from_numpy, lambda array: torch.from_numpy(array).double(), strided]:
        found, alphas, _ = drawn(tensor)
        assert isinstance(found, torch.Tensor) and isinstance(alphas, torch.Tensor)
        assert np.array_equal(found.numpy(), picture) and np.array_equal(alphas.numpy(), alpha)
    # NumPy has no bfloat16. Cameras would be inexact in it.
    rounded = {name: torch.from_numpy(array).bfloat16() for name, array in given.items() if name not in ("viewmat", "K")}
    found, expected = [], []
    for pictures, tensors in [(found, rounded), (expected, {name: tensor.float() for name, tensor in rounded.items()})]:
        for name, tensor in tensors.items():
            setattr(scene, name, tensor)
        pictures.append(call(scene, scene.colors)[0].numpy())
    assert np.array_equal(found, expected)
    scene.means.requires_grad = True
    with pytest.raises(NotImplementedError, match=r"means needs a gradient.*means\.detach"):
        call(scene, scene.colors)


def test_a_scenes_own_arrays_are_drawn_as_copies_are():
    scene = gaurast.garden(1, 2000)
    camera = scene.frame((64, 48))
    copies = [array.copy() for array in scene.arrays]
    for options in [{"sh_degree": scene.sh_degree}, {"sh_degree": 1, "render_mode": "RGB+ED", "eps2d": 0.1}]:
        view, K = camera.viewmat[None], camera.K[None]
        own = gaurast.rasterization(*scene.arrays, view, K, 64, 48, **options)
        assert np.array_equal(own[0], gaurast.rasterization(*copies, view, K, 64, 48, **options)[0])
    # Views of a part, or in another order, are not the scene.
    part = [array[:500] for array in scene.arrays]
    own = gaurast.rasterization(*part, view, K, 64, 48, sh_degree=1)
    assert np.array_equal(own[0], gaurast.rasterization(*(array.copy() for array in part), view, K, 64, 48, sh_degree=1)[0])


@pytest.mark.parametrize("name", ["means", "quats", "scales", "opacities", "colors"])
def test_a_changed_array_is_drawn_anew(arrays, name):
    scene = arrays(10, 200)
    before = [call(scene, scene.colors)[0] for _ in range(3)]
    assert np.array_equal(before[0], before[1]) and np.array_equal(before[0], before[2])
    brightest = np.argmax(scene.opacities * scene.scales.prod(axis=-1))
    getattr(scene, name)[brightest] *= 0.5 if name != "quats" else [1.0, -1.0, 1.0, 1.0]
    after = call(scene, scene.colors)[0]
    assert not np.array_equal(before[0], after)
    # Another device has not seen the arrays before.
    assert np.array_equal(after, call(scene, scene.colors, threads=1)[0])


def test_no_channels_are_named(arrays):
    scene = arrays(11, 10)
    with pytest.raises(ValueError, match="no channels"):
        call(scene, scene.colors[:, :0])


def test_no_gaussians_and_no_cameras(arrays):
    scene = arrays(8, 0)
    picture, alpha, _ = call(scene, scene.colors.reshape(0, 3), render_mode="RGB+ED")
    assert picture.shape[-1] == 4 and not picture.any() and not alpha.any()


def test_eight_threads_draw_their_own(arrays):
    scenes = [arrays(seed, 60) for seed in range(8)]
    alone = [call(scene, scene.colors)[0] for scene in scenes]
    wrong = []

    def draw(index):
        for _ in range(20):
            if not np.array_equal(call(scenes[index], scenes[index].colors)[0], alone[index]):
                wrong.append(index)

    threads = [threading.Thread(target=draw, args=(index,)) for index in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_the_number_of_threads_changes_no_bit(arrays):
    scene = arrays(9, 300)
    assert np.array_equal(call(scene, scene.colors)[0], call(scene, scene.colors, threads=1)[0])


def exr(path):
    OpenEXR = pytest.importorskip("OpenEXR")
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return {name: channel.pixels.astype(np.float64) for name, channel in channels.items()}


SCENES = {"skull": "skull.ply", "playbot": "playbot-125k.ply", "plant": "plant.splat"}


def drawn_by_cuda(test_data, folder, name, view, **settings):
    """What gsplat's CUDA code drew of a view, by channel, and what `rasterization` draws of it with these settings."""
    references = test_data / "reference/gpu"
    drawn = exr(references / folder / f"{name}-{view}.exr")
    scene = gaurast.open(test_data / "splats" / SCENES[name])
    camera = next(camera for camera in gaurast.cameras(references / "cameras.json") if camera.name == f"{name}-{view}")
    picture, alpha, _ = gaurast.rasterization(
        *scene.arrays,
        camera.viewmat[None],
        camera.K[None],
        camera.width,
        camera.height,
        near_plane=0.2,
        sh_degree=scene.sh_degree,
        **settings,
    )
    return drawn, picture[0], alpha[0]


@pytest.mark.parametrize("name", list(SCENES))
@pytest.mark.parametrize("view", [0, 2])
@pytest.mark.parametrize("mode", ["classic", "antialiased"])
def test_what_gsplats_cuda_drew(test_data, name, view, mode):
    folder = {"classic": "gsplat", "antialiased": "gsplat_compensated"}[mode]
    drawn, picture, alpha = drawn_by_cuda(test_data, folder, name, view, rasterize_mode=mode, render_mode="RGB+ED")
    reference = np.stack([drawn[channel] for channel in "RGB"], axis=-1)
    assert np.abs(picture[..., :3] - reference).max() < 1.0 / 255.0
    assert np.abs(alpha[..., 0] - drawn["A"]).max() < 1.0 / 255.0
    # There are no depths of the compensated mode.
    if mode == "classic":
        errors = np.abs(picture[..., 3] - drawn["Z"]) / np.maximum(drawn["Z"], 1.0)
        assert errors[drawn["A"] > 0.5].max() < 1e-3


@pytest.mark.parametrize("name", list(SCENES))
@pytest.mark.parametrize("view", [0, 2])
def test_what_gsplats_cuda_drew_by_a_fisheye(test_data, name, view):
    drawn, picture, _ = drawn_by_cuda(test_data, "gsplat_fisheye", name, view, camera_model="fisheye")
    reference = np.stack([drawn[channel] for channel in "RGB"], axis=-1)
    errors = np.abs(picture[..., :3] - reference)
    assert 10.0 * np.log10(1.0 / np.mean(errors**2)) > 80.0

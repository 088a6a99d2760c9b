"""gsplat's `rasterization`, forward."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Optional

import numpy as np

from . import _gaurast
from ._arrays import Floats, floats, like
from ._camera import Camera, Distortion
from ._device import device as device_of

# The ceiling of alpha of each version.
_CEILINGS = {"1.5": 0.999, "1.6": 0.99}

# The least ratio of determinants of each version, of "antialiased".
_COMPENSATION_FLOORS = {"1.5": 0.0, "1.6": 0.000_025}

_MODELS = {"pinhole": "pinhole", "ortho": "orthographic", "fisheye": "fisheye"}

_MODES = ("RGB", "D", "ED", "RGB+D", "RGB+ED")

_TILE = 16


class Gaussians(NamedTuple):
    """The arrays of Gaussians, in the order of the native module."""

    means: Floats
    quats: Floats
    scales: Floats
    opacities: Floats


def draw_channels(
    device: _gaurast.Device,
    arrays: Gaussians,
    values: Floats,
    cameras: Sequence[Camera],
    settings: dict[str, Any],
) -> Floats:
    """`[C, H, W, D]` composited channels of the Gaussians' `[N, D]` values, three at a draw."""
    channels = values.shape[1]
    drawn = []
    for first in range(0, channels, 3):
        frames, low = _draw_three(device, arrays, values, first, cameras, settings)
        drawn.append(np.stack([_raised(colors, low, channels - first) for colors, _, _ in frames]))
    return np.concatenate(drawn, axis=-1) if drawn else np.zeros((*_shape(cameras), 0), np.float32)


def _draw_three(
    device: _gaurast.Device,
    arrays: Gaussians,
    values: Floats,
    first: int,
    cameras: Sequence[Camera],
    settings: dict[str, Any],
) -> tuple[list[_gaurast.FrameArrays], Floats]:
    """Frames of three channels, and what they are less by: the device draws no colour below 0."""
    low = np.zeros(3, np.float32)
    three = values[:, first : first + 3]
    if three.size:
        low[: three.shape[1]] = np.minimum(three.min(axis=0), 0.0)
    frames = device.rasterize(*arrays, values[:, None, :], None, first, low.tolist(), cameras, json.dumps(settings))
    return frames, low


def _raised(colors: Floats, low: Floats, channels: int) -> Floats:
    """The channels of a frame, with what they are less by."""
    wanted = min(channels, 3)
    return colors[..., :wanted] + low[:wanted] * colors[..., 3:] if low.any() else colors[..., :wanted]


def _shape(cameras: Sequence[Camera]) -> tuple[int, int, int]:
    return len(cameras), cameras[0].height, cameras[0].width


def _refuse(arguments: dict[str, tuple[Any, Any]]) -> None:
    for name, (value, default) in arguments.items():
        is_default = value is default or (default is not None and value == default)
        if not is_default:
            raise NotImplementedError(f"{name} is not supported: GauRast draws with its default, {default}")


def _covariances(covars: Floats) -> tuple[Floats, Floats]:
    """Rotations w, x, y, z and scales of symmetric matrices."""
    values, axes = np.linalg.eigh(covars.astype(np.float64))
    axes[np.linalg.det(axes) < 0.0, :, 0] *= -1.0
    diagonal = axes.diagonal(axis1=-2, axis2=-1)
    # The largest of the four is computed first, of which the others are quotients.
    squares = np.stack(
        [
            1.0 + diagonal.sum(axis=-1),
            1.0 + diagonal[:, 0] - diagonal[:, 1] - diagonal[:, 2],
            1.0 - diagonal[:, 0] + diagonal[:, 1] - diagonal[:, 2],
            1.0 - diagonal[:, 0] - diagonal[:, 1] + diagonal[:, 2],
        ],
        axis=-1,
    )
    m = axes
    products = np.empty((len(m), 4, 4))
    products[:, range(4), range(4)] = squares
    for (row, column), product in {
        (0, 1): m[:, 2, 1] - m[:, 1, 2],
        (0, 2): m[:, 0, 2] - m[:, 2, 0],
        (0, 3): m[:, 1, 0] - m[:, 0, 1],
        (1, 2): m[:, 0, 1] + m[:, 1, 0],
        (1, 3): m[:, 0, 2] + m[:, 2, 0],
        (2, 3): m[:, 1, 2] + m[:, 2, 1],
    }.items():
        products[:, row, column] = products[:, column, row] = product
    quats = products[np.arange(len(m)), squares.argmax(axis=-1)]
    quats /= np.linalg.norm(quats, axis=-1, keepdims=True)
    return quats.astype(np.float32), np.sqrt(np.maximum(values, 0.0)).astype(np.float32)


def _scene_of(*arrays: Any) -> Optional[_gaurast.NativeScene]:
    """The scene whose `Scene.arrays` the arrays are, if they are. It does not change, so that its copy on the device serves."""
    owner = arrays[0]
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if not isinstance(owner, _gaurast.NativeScene) or owner.has_mesh or any(owner.origin):
        return None
    shapes = owner.shapes
    own = (owner.positions, shapes[:, 3:7], shapes[:, 0:3], shapes[:, 7], owner.harmonics.reshape(len(owner), -1, 3))

    def same(array: Any, view: Floats) -> bool:
        return (
            isinstance(array, np.ndarray)
            and array.__array_interface__ == view.__array_interface__
            and array.dtype == view.dtype
        )

    return owner if all(map(same, arrays, own)) else None


class _Batch:
    """The colours of one batch of Gaussians, and C cameras."""

    def __init__(self, colors: Optional[Floats], cameras: list[Camera]) -> None:
        self.colors = colors
        self.cameras = cameras

    def by_camera(self) -> list[tuple[Optional[Floats], list[Camera]]]:
        """What is drawn at once: each camera alone if its colours are its own."""
        if self.colors is None or self.colors.ndim == 3:
            return [(self.colors, self.cameras)]
        return [(colors, [camera]) for colors, camera in zip(self.colors, self.cameras)]


def rasterization(
    means: Any,
    quats: Any,
    scales: Any,
    opacities: Any,
    colors: Any,
    viewmats: Any,
    Ks: Any,
    width: int,
    height: int,
    near_plane: float = 0.01,
    far_plane: float = 1e10,
    radius_clip: float = 0.0,
    eps2d: float = 0.3,
    sh_degree: Optional[int] = None,
    packed: bool = True,
    tile_size: Optional[int] = None,
    backgrounds: Optional[Any] = None,
    render_mode: str = "RGB",
    sparse_grad: bool = False,
    absgrad: bool = False,
    rasterize_mode: str = "classic",
    channel_chunk: int = 32,
    distributed: bool = False,
    camera_model: str = "pinhole",
    segmented: bool = False,
    covars: Optional[Any] = None,
    with_ut: bool = False,
    with_eval3d: bool = False,
    return_normals: bool = False,
    global_z_order: bool = True,
    rays: Optional[Any] = None,
    radial_coeffs: Optional[Any] = None,
    tangential_coeffs: Optional[Any] = None,
    thin_prism_coeffs: Optional[Any] = None,
    ftheta_coeffs: Optional[Any] = None,
    lidar_coeffs: Optional[Any] = None,
    external_distortion_coeffs: Optional[Any] = None,
    rolling_shutter: Optional[Any] = None,
    viewmats_rs: Optional[Any] = None,
    ut_params: Optional[Any] = None,
    extra_signals: Optional[Any] = None,
    extra_signals_sh_degree: Optional[int] = None,
    renderer_config: Optional[Any] = None,
    *,
    version: str = "1.6",
    threads: int = 0,
    device: Optional[str] = None,
) -> tuple[Any, Any, dict[str, Any]]:
    """Rasterizes N Gaussians to C pictures, as gsplat's function of this name does. The pass forward alone: what needs a gradient
    is refused.

    Arguments are arrays, or torch's and jax's tensors on the processor; results are of the library that `means` is of.

    Args:
        means: Centres, `[..., N, 3]`.
        quats: Rotations w, x, y, z, `[..., N, 4]`, which need not be normalised.
        scales: Standard deviations, `[..., N, 3]`.
        opacities: `[..., N]`.
        colors: Values `[..., N, D]` or `[..., C, N, D]`; with `sh_degree`, harmonics `[N, K, D]` or `[..., (C,) N, K, D]`; None for
            depths alone.
        viewmats: World-to-camera matrices, `[..., C, 4, 4]`.
        Ks: Intrinsics in pixels, `[..., C, 3, 3]`. Skew is ignored, as gsplat does.
        width: The pictures' width in pixels.
        height: The pictures' height in pixels.
        near_plane: Gaussians are drawn beyond this depth.
        far_plane: Gaussians are drawn before this depth.
        eps2d: The variance of the screen filter in px^2.
        sh_degree: The degree of harmonics that is drawn.
        backgrounds: Values behind the Gaussians, `[..., C, D]`.
        render_mode: "RGB", "D" (accumulated depth), "ED" (mean depth), "RGB+D" or "RGB+ED".
        rasterize_mode: "classic" or "antialiased".
        camera_model: "pinhole", "ortho" or "fisheye". Depths of a fisheye are distances, where gsplat's are z.
        with_ut: Project covariances by the unscented transform, with `ut_params` or gsplat's sigma points.
        radial_coeffs: Coefficients of lenses, `[..., C, 6]` of pinholes (k1 to k6) or `[..., C, 4]` (k1 to k4). They need `with_ut`, as
            those below.
        tangential_coeffs: p1 and p2 of pinholes, `[..., C, 2]`.
        thin_prism_coeffs: s1 to s4 of pinholes, `[..., C, 4]`.
        covars: Covariances `[..., N, 3, 3]`, instead of `quats` and `scales`.
        version: "1.6" (alpha is at most 0.99, and antialiasing leaves at least 0.005 of the opacity) or "1.5" (0.999, and 0).
        threads: The number of the device's threads; 0 is one for each processor.
        device: A part of the name of another Vulkan device, such as one of `devices()`; without it, the driver of this package draws.

    `packed`, `segmented` and `channel_chunk` change nothing.

    Returns:
        Colours `[..., C, height, width, X]`, alphas `[..., C, height, width, 1]`, and a dictionary with `width`, `height`,
        `tile_size`, `tile_width`, `tile_height`, `n_batches` and `n_cameras`. X is D, 1 or D + 1 by `render_mode`.

    Raises:
        NotImplementedError: An argument asks for what is not supported.
        ValueError: An array has the wrong shape, or is in a GPU's memory.
    """
    _refuse(
        {
            "radius_clip": (radius_clip, 0.0),
            "distributed": (distributed, False),
            "with_eval3d": (with_eval3d, False),
            "return_normals": (return_normals, False),
            "global_z_order": (global_z_order, True),
            "rays": (rays, None),
            "ftheta_coeffs": (ftheta_coeffs, None),
            "lidar_coeffs": (lidar_coeffs, None),
            "external_distortion_coeffs": (external_distortion_coeffs, None),
            "viewmats_rs": (viewmats_rs, None),
            "extra_signals": (extra_signals, None),
            "renderer_config": (renderer_config, None),
        }
    )
    if absgrad or sparse_grad:
        raise NotImplementedError("gradients are not computed: train with gsplat on a GPU, and draw with GauRast")
    if getattr(rolling_shutter, "name", "GLOBAL") != "GLOBAL":
        raise NotImplementedError("rolling_shutter is not supported: GauRast draws with its default, a global shutter")
    if tile_size not in (None, _TILE):
        raise NotImplementedError(f"tile_size is not supported: GauRast draws with its default, {_TILE}")
    if render_mode not in _MODES:
        raise NotImplementedError(f"render_mode={render_mode!r} is not supported: {', '.join(_MODES)} are")
    if camera_model not in _MODELS:
        raise NotImplementedError(f"camera_model={camera_model!r} is not supported: {', '.join(_MODELS)} are")
    if rasterize_mode not in ("classic", "antialiased"):
        raise ValueError(f"rasterize_mode={rasterize_mode!r} is neither 'classic' nor 'antialiased'")
    if with_ut and (rasterize_mode != "classic" or covars is not None):
        raise ValueError("with_ut=True goes with rasterize_mode='classic', quats and scales")
    if version not in _CEILINGS:
        raise ValueError(f"version={version!r} is not one of {', '.join(_CEILINGS)}")

    has_colors = render_mode.startswith("RGB")
    # Rays and sigma points are drawn anywhere in front of the eye, so the list by z is cut at the near plane.
    by_z = camera_model == "fisheye" or with_ut
    is_scene = covars is None and sh_degree is not None and not by_z and has_colors
    scene = _scene_of(means, quats, scales, opacities, colors) if is_scene else None

    def taken(value: Any, name: str) -> Floats:
        # The device has a scene's arrays.
        return value if scene is not None else floats(value, name)

    centres = taken(means, "means")
    lead, count = centres.shape[:-2], centres.shape[-2] if centres.ndim >= 2 else 0
    batches = math.prod(lead)
    views, intrinsics = floats(viewmats, "viewmats"), floats(Ks, "Ks")
    seen = views.shape[-3] if views.ndim >= 3 else 0

    def flat(value: Floats, name: str, shape: tuple[int, ...]) -> Floats:
        if value.shape != (*lead, *shape):
            raise ValueError(f"{name} has the shape {value.shape}, not {(*lead, *shape)}")
        return value.reshape(batches, *shape)

    gaussians = {
        "means": flat(centres, "means", (count, 3)),
        "opacities": flat(taken(opacities, "opacities"), "opacities", (count,)),
    }
    if covars is None:
        gaussians["quats"] = flat(taken(quats, "quats"), "quats", (count, 4))
        gaussians["scales"] = flat(taken(scales, "scales"), "scales", (count, 3))
    else:
        rotations, deviations = _covariances(flat(floats(covars, "covars"), "covars", (count, 3, 3)).reshape(-1, 3, 3))
        gaussians["quats"] = rotations.reshape(batches, count, 4)
        gaussians["scales"] = deviations.reshape(batches, count, 3)
    views = flat(views, "viewmats", (seen, 4, 4))
    intrinsics = flat(intrinsics, "Ks", (seen, 3, 3))
    coefficients = {
        name: (floats(value, name), lengths)
        for name, value, lengths in (
            ("radial_coeffs", radial_coeffs, (6, 4)),
            ("tangential_coeffs", tangential_coeffs, (2,)),
            ("thin_prism_coeffs", thin_prism_coeffs, (4,)),
        )
        if value is not None
    }
    if coefficients and not with_ut:
        raise ValueError(f"{', '.join(coefficients)} need with_ut=True")
    for name, (value, lengths) in coefficients.items():
        if value.shape not in [(*lead, seen, length) for length in lengths]:
            raise ValueError(f"{name} has the shape {value.shape}, not {(*lead, seen, lengths[0])}")
    lenses = _lenses(camera_model, {name: value for name, (value, _) in coefficients.items()}, batches * seen)

    if has_colors and colors is None:
        raise ValueError(f"render_mode={render_mode!r} needs colors")
    values = taken(colors, "colors") if has_colors else None
    by_batch = _colors_by_batch(values, lead, batches, count, seen, sh_degree)

    settings: dict[str, Any] = {
        "sh_degree": sh_degree or 0,
        "alpha_ceiling": _CEILINGS[version],
        "antialiasing": "compensated" if rasterize_mode == "antialiased" else "off",
        "cut_off": "TileRectangleCompensated" if with_ut else "TileRectangle",
        "cut_off_deviations": 3.33,
        "low_pass_variance": float(eps2d),
        "compensation_floor": _COMPENSATION_FLOORS[version],
        "by_z": by_z,
        "sigma_points": sigma_points(ut_params) if with_ut else None,
    }
    model = _MODELS[camera_model]
    drawing = device_of(threads, device)
    pictures, alphas = [], []
    for index in range(batches):
        arrays = Gaussians(**{name: values[index] for name, values in gaussians.items()})
        cameras = [
            Camera.from_matrices(view, K, width, height, model=model, near=near_plane, far=far_plane, distortion=lens)
            for view, K, lens in zip(views[index], intrinsics[index], lenses[index * seen :])
        ]
        for channels, some in _Batch(by_batch[index], cameras).by_camera():
            frame, alpha = _draw(drawing, scene, arrays, channels, some, settings, sh_degree, render_mode)
            pictures.append(frame)
            alphas.append(alpha)

    def joined(parts: list[Floats]) -> Floats:
        whole = parts[0] if len(parts) == 1 else np.concatenate(parts)
        return whole.reshape(*lead, seen, height, width, whole.shape[-1]) if lead else whole

    picture, alpha = joined(pictures), joined(alphas)
    if backgrounds is not None and has_colors:
        behind = floats(backgrounds, "backgrounds")
        channels = picture.shape[-1] - (render_mode != "RGB")
        if behind.shape != (*lead, seen, channels):
            raise ValueError(f"backgrounds has the shape {behind.shape}, not {(*lead, seen, channels)}")
        picture = np.concatenate(
            [picture[..., :channels] + (1.0 - alpha) * behind[..., None, None, :], picture[..., channels:]], axis=-1
        )
    meta = {
        "width": width,
        "height": height,
        "tile_size": _TILE,
        "tile_width": -(-width // _TILE),
        "tile_height": -(-height // _TILE),
        "n_batches": batches,
        "n_cameras": seen,
    }
    return like(picture, means), like(alpha, means), meta


def _lenses(camera_model: str, coefficients: dict[str, Floats], count: int) -> list[Optional[Distortion]]:
    """The lens of each of `count` cameras, whose arrays of coefficients have one more axis."""
    if not coefficients:
        return [None] * count
    if camera_model == "ortho" or (camera_model == "fisheye" and list(coefficients) != ["radial_coeffs"]):
        raise ValueError(f"camera_model={camera_model!r} does not go with {', '.join(coefficients)}")

    def rows(name: str, length: int) -> list[tuple[float, ...]]:
        if name not in coefficients:
            return [(0.0,) * length] * count
        given = coefficients[name].reshape(count, -1)
        return [tuple(row) + (0.0,) * (length - len(row)) for row in given.tolist()]

    model = "polynomial" if camera_model == "fisheye" else "rational"
    parts = zip(rows("radial_coeffs", 6), rows("tangential_coeffs", 2), rows("thin_prism_coeffs", 4))
    return [Distortion(model, *of_camera) for of_camera in parts]


def sigma_points(ut_params: Any) -> dict[str, Any]:
    """The settings of gsplat's `UnscentedTransformParameters`, of an object with some of its attributes, or its defaults."""
    return {
        "alpha": float(getattr(ut_params, "alpha", 0.1)),
        "beta": float(getattr(ut_params, "beta", 2.0)),
        "kappa": float(getattr(ut_params, "kappa", 0.0)),
        "picture_margin": float(getattr(ut_params, "in_image_margin_factor", 0.1)),
        "all": bool(getattr(ut_params, "require_all_sigma_points_valid", False)),
    }


def _colors_by_batch(
    values: Optional[Floats], lead: tuple[int, ...], batches: int, count: int, seen: int, sh_degree: Optional[int]
) -> list[Optional[Floats]]:
    """The colours of each batch, `[N, K, D]` or `[C, N, K, D]`. Values without harmonics have a K of 1."""
    if values is None:
        return [None] * batches
    if sh_degree is None:
        values = values[..., None, :]
    elif not 0 <= sh_degree <= 4:
        raise ValueError(f"sh_degree={sh_degree} is not within 0 to 4")
    elif values.ndim < 3 or values.shape[-2] < (sh_degree + 1) ** 2:
        raise ValueError(f"colors has the shape {values.shape}, which lacks harmonics of degree {sh_degree}")
    own = values.shape[-2:]
    if 0 in own:
        raise ValueError(f"colors has the shape {values.shape}, with no channels")
    if values.shape == (*lead, count, *own):
        return list(values.reshape(batches, count, *own))
    if values.shape == (*lead, seen, count, *own):
        return list(values.reshape(batches, seen, count, *own))
    if values.shape == (count, *own) and sh_degree is not None:
        return [values] * batches
    raise ValueError(f"colors has the shape {values.shape}, which does not fit {count} Gaussians and {seen} cameras")


def _draw(
    device: _gaurast.Device,
    scene: Optional[_gaurast.NativeScene],
    arrays: Gaussians,
    colors: Optional[Floats],
    cameras: list[Camera],
    settings: dict[str, Any],
    sh_degree: Optional[int],
    render_mode: str,
) -> tuple[Floats, Floats]:
    """Pictures `[C, H, W, X]` and alphas `[C, H, W, 1]`, of the scene if there is one."""
    has_depth = render_mode != "RGB"
    first = {**settings, "linear_depth": True} if has_depth else settings
    parts: list[Floats] = []
    if colors is None:
        frames, _ = _draw_three(device, arrays, arrays.opacities[:, None], 0, cameras, first)
    elif sh_degree is None:
        values = colors[:, 0, :]
        frames, low = _draw_three(device, arrays, values, 0, cameras, first)
        parts.append(_of_frames(frames, low, values.shape[1]))
        if values.shape[1] > 3:
            parts.append(draw_channels(device, arrays, np.ascontiguousarray(values[:, 3:]), cameras, settings))
    elif scene is not None:
        frames = device.render(scene, cameras, json.dumps(first))
        parts.append(_of_frames(frames, np.zeros(3, np.float32), 3))
    else:
        frames = []
        channels = colors.shape[2]
        for start in range(0, channels, 3):
            three = colors[..., start : start + 3]
            if three.shape[2] < 3:
                three = np.pad(three, ((0, 0), (0, 0), (0, 3 - three.shape[2])))
            text = json.dumps(first if start == 0 else settings)
            low = np.zeros(3, np.float32)
            drawn = device.rasterize(*arrays, np.ascontiguousarray(three), sh_degree, 0, low.tolist(), cameras, text)
            frames = frames or drawn
            parts.append(_of_frames(drawn, low, channels - start))
    whole = frames[0][0][None] if len(frames) == 1 else np.stack([colors for colors, _, _ in frames])
    alphas = whole[..., 3:]
    if has_depth:
        means = np.stack([depths for _, depths, _ in frames if depths is not None])[..., :1]
        means = np.where(alphas > 0.0, means, np.float32(0.0))
        parts.append(means if render_mode.endswith("ED") else means * alphas)
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-1), alphas


def _of_frames(frames: list[_gaurast.FrameArrays], low: Floats, channels: int) -> Floats:
    pictures = [_raised(colors, low, channels) for colors, _, _ in frames]
    return pictures[0][None] if len(pictures) == 1 else np.stack(pictures)

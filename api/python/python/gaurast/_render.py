"""Pictures of scenes."""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from ._arrays import Floats, floats
from ._camera import Camera
from ._device import device as device_of
from ._gsplat import Gaussians, draw_channels, sigma_points
from ._scene import Scene

# What other renderers draw, as the command's --as: cut-off, its size in standard deviations, the ceiling of alpha, order, near plane.
_RENDERERS: dict[str, tuple[str, float, float, str, Optional[float]]] = {
    "inria": ("TileSquare", 3.0, 0.99, "depth", 0.2),
    "gsplat": ("TileRectangle", 3.33, 0.99, "depth", 0.01),
    "gsplat-1.5": ("TileRectangle", 3.33, 0.999, "depth", 0.01),
    "gsplat-unscented": ("TileRectangleCompensated", 3.33, 0.99, "depth", 0.01),
    "gltf": ("Ellipse", 3.0, 0.99, "distance", None),
    "usd": ("None", 3.0, 0.99, "depth", None),
}

_GEOMETRIES = {"3d": "volume", "2d": "surfel"}
_PRECISIONS = {"fp32": "Fp32", "fp16": "Fp16"}


if TYPE_CHECKING:
    _Array = np.ndarray[Any, np.dtype[np.float32]]
else:
    # Newer versions of NumPy have aliases with arguments that can't be base classes.
    _Array = np.ndarray


class Pictures(_Array):
    """C pictures as a NumPy array `[C, H, W, 4]` of binary32: colours times alpha, and alpha.

    Attributes:
        depth: The mean depth, `[C, H, W]`; infinite where nothing is drawn. None unless it was asked for, as are the following.
        median_depth: The depth of the Gaussian at which transmittance falls below one half, `[C, H, W]`.
        ids: The number of that Gaussian, `[C, H, W]`; -1 where nothing is drawn.
        nearest_ids: The number of the first Gaussian that contributes, `[C, H, W]`.
        features: The features, weighted as colours are, `[C, H, W, D]`.
    """

    depth: Optional[Floats] = None
    median_depth: Optional[Floats] = None
    ids: Optional[npt.NDArray[np.int32]] = None
    nearest_ids: Optional[npt.NDArray[np.int32]] = None
    features: Optional[Floats] = None

    @property
    def alpha(self) -> Floats:
        """One less the transmittance, `[C, H, W]`."""
        return np.asarray(self)[..., 3]

    def save(self, path: Union[str, os.PathLike[str]], index: int = 0) -> None:
        """Writes a picture over black as a PNG of 8 bits."""
        with open(path, "wb") as file:
            file.write(_png(np.asarray(self)[index]))

    def _repr_png_(self) -> Optional[bytes]:
        # A slice of the array need not be a picture.
        is_pictures = self.ndim == 4 and self.shape[-1] == 4 and self.size > 0
        return _png(np.asarray(self)[0]) if is_pictures else None


def _png(picture: Floats) -> bytes:
    height, width, _ = picture.shape
    texels = (np.clip(np.nan_to_num(picture[..., :3]), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = texels.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = zlib.compress(rows.tobytes(), 6)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def _choice(name: str, value: str, choices: Sequence[str]) -> str:
    if value not in choices:
        raise ValueError(f"{name}={value!r} is not one of {', '.join(choices)}")
    return value


def render(
    scene: Scene,
    camera: Optional[Union[Camera, Sequence[Camera]]] = None,
    size: Optional[Sequence[int]] = None,
    *,
    as_: Optional[str] = None,
    sh_degree: int = 4,
    order: str = "auto",
    geometry: str = "auto",
    antialiasing: str = "auto",
    precision: str = "fp32",
    exponential_error: float = 0.0,
    contribution_budget: float = 0.0,
    background: Optional[Sequence[float]] = None,
    depth: bool = False,
    ids: bool = False,
    features: Optional[Any] = None,
    out: Optional[Floats] = None,
    threads: int = 0,
    device: Optional[str] = None,
) -> Pictures:
    """Draws a scene from one camera or several. Python's lock is released meanwhile.

    Args:
        camera: A camera or several of one size; without one, `scene.frame(size)`.
        size: The picture's width and height in pixels, instead of the camera's.
        as_: Draw what another renderer would: "inria", "gsplat" (1.6), "gsplat-1.5", "gsplat-unscented", "gltf" or "usd". With `antialiasing`
            "compensated" it is that renderer's compensated mode. Their near planes are not taken over: a camera has its own.
        sh_degree: The highest degree of spherical harmonics that is drawn.
        order: "depth", "distance" or "per-pixel"; "auto" is what the file says.
        geometry: "3d", "2d" or "auto".
        antialiasing: "off", "compensated" or "auto".
        precision: "fp32" or "fp16".
        exponential_error: The greatest relative error of the exponential in alpha.
        contribution_budget: The greatest sum of contributions that may be skipped at a pixel.
        background: RGB behind the Gaussians; without it, nothing is.
        depth: Give `depth` and `median_depth`, too, in the scene's units along the camera's axis (from the eye for a fisheye
            and a panorama).
        ids: Give `ids` and `nearest_ids`, too.
        features: `[N, D]` numbers of the Gaussians, to be composited as colours are.
        out: An array `[C, H, W, 4]` of binary32 that receives the pictures. The result looks into it.
        threads: The number of the device's threads; 0 is one for each processor.
        device: A part of the name of another Vulkan device, such as one of `devices()`; without it, the driver of this package draws.

    Raises:
        ValueError: An argument is outside its range, modes can't be combined, or no device has such a name.
    """
    cameras = [scene.frame(size or (1280, 720))] if camera is None else camera
    cameras = [cameras] if isinstance(cameras, Camera) else list(cameras)
    if size is not None:
        cameras = [camera.resized(size) for camera in cameras]
    if len({(camera.width, camera.height) for camera in cameras}) != 1:
        raise ValueError("one call draws cameras of one size, at least one")
    metadata = scene.metadata

    def chosen(name: str, value: str, choices: Sequence[str], stated: Optional[str], default: str) -> str:
        return (stated or default) if _choice(name, value, ["auto", *choices]) == "auto" else value

    settings: dict[str, Any] = {
        "sh_degree": sh_degree,
        "precision": _PRECISIONS[_choice("precision", precision, list(_PRECISIONS))],
        "exponential_error": exponential_error,
        "contribution_budget": contribution_budget,
    }
    compensated = chosen("antialiasing", antialiasing, ["off", "compensated"], metadata["antialiasing"], "off")
    settings["antialiasing"] = compensated
    stated_order = metadata["order"]
    if as_ is not None:
        cut_off, deviations, ceiling, own_order, _ = _RENDERERS[_choice("as_", as_, list(_RENDERERS))]
        if as_ != "usd":
            stated_order = own_order
        settings.update(cut_off=cut_off, cut_off_deviations=deviations, alpha_ceiling=ceiling)
        if as_ in ("inria", "gsplat") and compensated == "compensated":
            settings["compensation_floor"] = 0.000_025
    settings["order"] = chosen("order", order, ["depth", "distance", "per-pixel"], stated_order, "depth")
    shape = chosen("geometry", geometry, list(_GEOMETRIES), metadata["geometry"], "3d")
    settings["geometry"] = _GEOMETRIES.get(shape, shape)
    if as_ is not None and as_.startswith("gsplat"):
        # gsplat draws lenses that distort by the unscented transform alone.
        is_unscented = as_ == "gsplat-unscented" or any(camera.distortion is not None for camera in cameras)
        if is_unscented:
            settings["sigma_points"] = sigma_points(None)
            settings["cut_off"] = "TileRectangleCompensated"
            settings["compensation_floor"] = 0.000_025
        # gsplat's rays meet discs, and its lenses see sigma points, anywhere in front of the eye.
        is_other_depth = (
            is_unscented or settings["geometry"] == "surfel" or any(camera.model == "fisheye" for camera in cameras)
        )
        settings["by_z"] = is_other_depth and settings["order"] == "depth"

    drawing = device_of(threads, device)
    first = {**settings, "linear_depth": True} if depth else settings
    frames = drawing.render(scene._native, cameras, json.dumps(first))
    pictures = _stacked([colors for colors, _, _ in frames], out).view(Pictures)
    if depth:
        depths = np.stack([depths for _, depths, _ in frames if depths is not None])
        pictures.depth, pictures.median_depth = depths[..., 0], depths[..., 1]
    if ids:
        frames = drawing.render(scene._native, cameras, json.dumps({**settings, "gaussians": True}))
        numbers = np.stack([numbers for _, _, numbers in frames if numbers is not None]).view(np.int32)
        pictures.ids, pictures.nearest_ids = numbers[..., 0], numbers[..., 1]
    if features is not None:
        values = floats(features, "features")
        if values.ndim != 2 or len(values) != len(scene):
            raise ValueError(f"features has the shape {values.shape}, not ({len(scene)}, D)")
        if any(scene.origin):
            raise NotImplementedError("features of a scene far from zero: make one of its arrays, near zero")
        arrays = Gaussians(*(np.ascontiguousarray(array) for array in scene.arrays[:4]))
        pictures.features = draw_channels(drawing, arrays, values, cameras, settings)
    if background is not None:
        color = np.asarray(background, np.float32)
        if color.shape != (3,):
            raise ValueError("background is three numbers")
        plain = np.asarray(pictures)
        plain[..., :3] += (1.0 - plain[..., 3:]) * color
        plain[..., 3] = 1.0
    return pictures


def _stacked(pictures: list[Floats], out: Optional[Floats]) -> Floats:
    if out is None:
        return pictures[0][None] if len(pictures) == 1 else np.stack(pictures)
    shape = (len(pictures), *pictures[0].shape)
    if out.shape != shape or out.dtype != np.float32:
        raise ValueError(f"out is an array {out.shape} of {out.dtype}, not {shape} of float32")
    np.stack(pictures, out=out)
    return out

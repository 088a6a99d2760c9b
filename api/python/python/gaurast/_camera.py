"""Cameras."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _gaurast

_Row = Sequence[float]


@dataclass(frozen=True)
class Distortion:
    """The distortion of a lens. An ideal place (u, v), for focal lengths of 1 and relative to the principal point, at the distance
    r from it, is moved to another one: by a radial factor, and by what is added to it.

    Attributes:
        model: "rational" (OpenCV's), "polynomial" (OpenCV's fisheye), "polynomial_first" (Aria's Fisheye624), "field_of_view" or
            "division".
        radial: k1 to k6. The angle omega in radians of a field of view, and the coefficient of a division, are the first.
        tangential: p1 and p2, in OpenCV's order.
        thin_prism: s1 to s4, in OpenCV's order.
    """

    model: str = "rational"
    radial: Sequence[float] = (0.0,) * 6
    tangential: Sequence[float] = (0.0,) * 2
    thin_prism: Sequence[float] = (0.0,) * 4


@dataclass(frozen=True)
class Camera:
    """A camera with its picture's size. Cameras compare, pickle and print by their values.

    Attributes:
        rotation: The directions right, down and forward in the world, three rows of three numbers.
        eye: The position in the world.
        focal: Focal lengths along x and y: in pixels (pinhole), pixels per radian (fisheye, equirectangular) or pixels per
            unit of length (orthographic).
        principal: The principal point, in pixels from the upper left corner.
        width: The picture's width in pixels.
        height: The picture's height in pixels.
        model: "pinhole", "fisheye" (equidistant), "equirectangular" or "orthographic".
        near: Gaussians are drawn beyond this depth.
        far: Gaussians are drawn before this depth.
        name: The name of the photograph, of a camera from a file.
        distortion: The distortion of the lens, of a pinhole or a fisheye; None of an ideal one. Nothing is drawn from the angle on
            at which the lens folds.
    """

    rotation: Sequence[_Row]
    eye: _Row
    focal: _Row
    principal: _Row
    width: int
    height: int
    model: str = "pinhole"
    near: float = 0.2
    far: float = math.inf
    name: str = ""
    distortion: Optional[Distortion] = None

    @classmethod
    def _of(cls, items: _gaurast.CameraItems) -> Camera:
        values = {key: _tuples(value) for key, value in items.items()}
        lens = values["distortion"]
        if isinstance(lens, dict):
            parts: dict[str, Any] = {key: _tuples(value) for key, value in lens.items()}
            values["distortion"] = Distortion(**parts)
        return cls(**values)  # type: ignore[arg-type]

    @classmethod
    def look_at(
        cls,
        eye: _Row,
        target: _Row,
        up: _Row = (0.0, -1.0, 0.0),
        fov: float = 50.0,
        size: Sequence[int] = (1280, 720),
    ) -> Camera:
        """A pinhole camera at `eye` that looks at `target`, with `up` upwards in the picture.

        Args:
            fov: The vertical field of view in degrees.
            size: The picture's width and height in pixels.

        Raises:
            ValueError: The eye is the target, `up` is along the line of sight, or the field of view is none.
        """
        return cls._of(_gaurast.look_at(list(eye), list(target), list(up), fov, list(size)))

    @classmethod
    def from_matrices(
        cls,
        viewmat: npt.ArrayLike,
        K: npt.ArrayLike,
        width: int,
        height: int,
        *,
        model: str = "pinhole",
        near: float = 0.2,
        far: float = math.inf,
        distortion: Optional[Distortion] = None,
    ) -> Camera:
        """The camera of a world-to-camera matrix `[4, 4]` (x right, y down, z forward) and intrinsics `[3, 3]`, whose skew is
        ignored.

        Raises:
            ValueError: The matrix is not a rotation with a translation.
        """
        view = np.asarray(viewmat, dtype=np.float64)
        intrinsics = np.asarray(K, dtype=np.float64)
        if view.shape != (4, 4) or intrinsics.shape != (3, 3):
            raise ValueError(f"a view matrix is [4, 4] and intrinsics are [3, 3], not {view.shape} and {intrinsics.shape}")
        rotation, translation = view[:3, :3], view[:3, 3]
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3):
            raise ValueError("the view matrix is not a rotation with a translation")
        eye = -np.linalg.solve(rotation, translation)
        return cls(
            rotation=tuple(map(tuple, rotation.tolist())),
            eye=tuple(eye.tolist()),
            focal=(float(intrinsics[0, 0]), float(intrinsics[1, 1])),
            principal=(float(intrinsics[0, 2]), float(intrinsics[1, 2])),
            width=int(width),
            height=int(height),
            model=model,
            near=float(near),
            far=float(far),
            distortion=distortion,
        )

    @property
    def viewmat(self) -> npt.NDArray[np.float64]:
        """The world-to-camera matrix, `[4, 4]`."""
        view = np.eye(4)
        view[:3, :3] = self.rotation
        view[:3, 3] = -view[:3, :3] @ np.asarray(self.eye)
        return view

    @property
    def K(self) -> npt.NDArray[np.float64]:
        """The intrinsics, `[3, 3]`."""
        (fx, fy), (cx, cy) = self.focal, self.principal
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def resized(self, size: Sequence[int]) -> Camera:
        """The same view in a picture of another width and height, to which each axis is scaled on its own."""
        width, height = size
        x, y = width / self.width, height / self.height
        return replace(
            self,
            focal=(self.focal[0] * x, self.focal[1] * y),
            principal=(self.principal[0] * x, self.principal[1] * y),
            width=int(width),
            height=int(height),
        )


def _tuples(value: object) -> object:
    return tuple(map(_tuples, value)) if isinstance(value, (list, tuple)) else value


def cameras(
    path: Union[str, os.PathLike[str]],
    *,
    size: Sequence[int] = (1280, 720),
    dataparser: Optional[Union[str, os.PathLike[str]]] = None,
    undistorted: bool = False,
) -> list[Camera]:
    """Reads the cameras of a file: `cameras.json` of 3DGS, `transforms.json` or `camera_path.json` of nerfstudio, or COLMAP's
    folder. Parts that are ignored are warned of.

    Args:
        size: The picture's size, for a `transforms.json` that gives none.
        dataparser: nerfstudio's `dataparser_transforms.json`.
        undistorted: Replace lenses that distort by ideal ones.

    Raises:
        OSError: The file can't be read.
        ValueError: The file is of no known kind, or a camera in it is invalid.
    """
    views, ignored = _gaurast.read_cameras(path, list(size), dataparser, undistorted)
    for sentence in ignored:
        warnings.warn(f"{os.fspath(path)}: {sentence}", stacklevel=2)
    return [Camera._of(view) for view in views]

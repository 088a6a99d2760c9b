"""Scenes of Gaussians."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _gaurast
from ._arrays import Floats, floats
from ._camera import Camera


class Scene:
    """A set of N Gaussians, in the frame of 3DGS: x right, y down, z forward. It does not change.

    Its arrays are read-only views, without a copy. `rasterization(*scene.arrays, ...)` draws it as gsplat does.
    """

    def __init__(self, native: _gaurast.NativeScene, metadata: Optional[dict[str, Any]] = None) -> None:
        self._native = native
        self._metadata: dict[str, Any] = json.loads(native.metadata) if metadata is None else metadata

    @classmethod
    def from_arrays(
        cls,
        means: Any,
        quats: Any,
        scales: Any,
        opacities: Any,
        harmonics: Optional[Any] = None,
        *,
        colors: Optional[Any] = None,
        origin: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> Scene:
        """A scene of arrays, in the order of gsplat's arguments.

        Args:
            means: Centres, `[N, 3]`.
            quats: Rotations w, x, y, z, `[N, 4]`, which need not be normalised.
            scales: Standard deviations, `[N, 3]`, not logarithms.
            opacities: `[N]`, 0 to 1, not logits.
            harmonics: Spherical harmonics, `[N, K, 3]` with K of 1, 4, 9, 16 or 25.
            colors: RGB, `[N, 3]`, instead of harmonics.
            origin: The point of the world to which `means` are relative.

        Raises:
            ValueError: An array has another shape.
        """
        if (harmonics is None) == (colors is None):
            raise ValueError("a scene has either harmonics or colors")
        if harmonics is None:
            harmonics = ((floats(colors, "colors") - 0.5) / SH_C0)[:, None, :]
        centres = floats(means, "means")
        count = len(centres) if centres.ndim else 0

        def checked(value: Any, name: str, shape: tuple[int, ...]) -> Floats:
            array = floats(value, name)
            if array.shape != shape:
                raise ValueError(f"{name} has the shape {array.shape}, not {shape}")
            return array

        coefficients = floats(harmonics, "harmonics")
        shape = coefficients.shape
        if len(shape) != 3 or shape[0] != count or shape[2] != 3 or shape[1] not in (1, 4, 9, 16, 25):
            raise ValueError(f"harmonics has the shape {shape}, not ({count}, 1, 4, 9, 16 or 25, 3)")
        native = _gaurast.from_arrays(
            checked(centres, "means", (count, 3)),
            checked(quats, "quats", (count, 4)),
            checked(scales, "scales", (count, 3)),
            checked(opacities, "opacities", (count,)),
            coefficients.reshape(-1, 3),
            {1: 0, 4: 1, 9: 2, 16: 3, 25: 4}[shape[1]],
            list(origin),
        )
        return cls(native)

    def __len__(self) -> int:
        return len(self._native)

    def __repr__(self) -> str:
        return f"<gaurast.Scene of {len(self)} Gaussians, spherical harmonics degree {self.sh_degree}>"

    def __reduce__(self) -> tuple[Any, ...]:
        if self._native.has_mesh:
            raise TypeError("a scene with triangles can't be pickled: open its file again")
        arrays = tuple(np.array(array) for array in self.arrays)
        return (_restored, (arrays, self.origin, self._metadata))

    def _repr_png_(self) -> Optional[bytes]:
        from ._render import render

        return render(self, self.frame((640, 360)))._repr_png_()

    @property
    def means(self) -> Floats:
        """Centres, `[N, 3]`, relative to `origin`."""
        return self._native.positions

    @property
    def scales(self) -> Floats:
        """Standard deviations along the Gaussians' own axes, `[N, 3]`."""
        return self._native.shapes[:, 0:3]

    @property
    def quats(self) -> Floats:
        """Rotations w, x, y, z, `[N, 4]`, as the file has them."""
        return self._native.shapes[:, 3:7]

    @property
    def opacities(self) -> Floats:
        """Opacities at the centres, `[N]`, 0 to 1."""
        return self._native.shapes[:, 7]

    @property
    def harmonics(self) -> Floats:
        """Spherical harmonics, `[N, K, 3]` with K = (degree + 1)^2. A colour is 0.5 plus their weighted sum."""
        return self._native.harmonics.reshape(len(self), (self.sh_degree + 1) ** 2, 3)

    @property
    def arrays(self) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Means, quats, scales, opacities and harmonics: gsplat's first five arguments."""
        return self.means, self.quats, self.scales, self.opacities, self.harmonics

    @property
    def sh_degree(self) -> int:
        """The degree of the spherical harmonics, 0 to 4."""
        return self._native.sh_degree

    @property
    def origin(self) -> tuple[float, ...]:
        """The point of the world to which `means` are relative: zero, unless they lie far from there. Cameras are not."""
        return tuple(self._native.origin)

    @property
    def metadata(self) -> dict[str, Any]:
        """What the file states apart from its Gaussians, and sentences about what is ignored in it (`warnings`, `notes`)."""
        return dict(self._metadata)

    def frame(self, size: Sequence[int] = (1280, 720), fov: float = 50.0) -> Camera:
        """A camera that has the scene in its picture of this width and height, with a vertical field of view in degrees."""
        return Camera._of(_gaurast.frame(self._native, list(size), fov))

    def write_ply(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes the Gaussians as 3DGS's binary PLY. Opacities of 0 and 1, and scales of 0, become the nearest ones whose
        logarithms are finite; `origin` is added."""
        count, coefficients = len(self), (self.sh_degree + 1) ** 2
        rest = [f"f_rest_{index}" for index in range(3 * (coefficients - 1))]
        names = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", *rest, "opacity"]
        names += [f"scale_{axis}" for axis in range(3)] + [f"rot_{axis}" for axis in range(4)]
        opacities = np.clip(self.opacities.astype(np.float64), 1e-10, 1.0 - 1e-7)
        smallest = float(np.finfo(np.float32).tiny)
        columns: list[npt.NDArray[Any]] = [
            self.means + np.asarray(self.origin),
            np.zeros((count, 3)),
            self.harmonics[:, 0],
            # Channel by channel.
            self.harmonics[:, 1:].transpose(0, 2, 1).reshape(count, -1),
            np.log(opacities / (1.0 - opacities))[:, None],
            np.log(np.maximum(self.scales.astype(np.float64), smallest)),
            self.quats,
        ]
        header = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
        header += [f"property float {name}" for name in names] + ["end_header", ""]
        with _builtin_open(path, "wb") as file:
            file.write("\n".join(header).encode())
            file.write(np.concatenate(columns, axis=1).astype("<f4").tobytes())


def _restored(arrays: tuple[Floats, ...], origin: Sequence[float], metadata: dict[str, Any]) -> Scene:
    """A scene that was pickled."""
    return Scene(Scene.from_arrays(*arrays, origin=origin)._native, metadata)


# The constant spherical harmonic.
SH_C0 = 0.28209479177387814

_builtin_open = open


def open(  # noqa: A001, the name is the package's
    path: Union[str, os.PathLike[str]],
    *,
    axes: Optional[str] = None,
    points: Optional[float] = None,
    level: int = 0,
) -> Scene:
    """Reads a scene: .ply, .compressed.ply, .splat, .ksplat, .spz, SOG, or glTF with `KHR_gaussian_splatting`.

    Args:
        axes: The directions of the file's axes, three letters such as "rdf" or "rub", instead of those that it names.
        points: The diameter with which points without scales are drawn, in the scene's units. They are refused without it.
        level: The level of detail of a scene that has several; 0 is the finest.

    Raises:
        OSError: The file can't be read; `FileNotFoundError` if there is none.
        ValueError: The file is of no known kind, or malformed. The sentence has the file, the place and the reason.
    """
    return Scene(_gaurast.open(path, axes, points, level))


def garden(seed: int = 1, count: int = 300_000) -> Scene:
    """The generated garden, of about `count` Gaussians."""
    return Scene(_gaurast.garden(seed, count))

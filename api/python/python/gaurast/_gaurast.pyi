"""The native module."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Optional, Union

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]
FrameArrays = tuple[Floats, Optional[Floats], Optional[npt.NDArray[np.uint32]]]
CameraItems = dict[str, object]
Path = Union[str, "os.PathLike[str]"]

class NativeScene:
    sh_degree: int
    origin: Sequence[float]
    has_mesh: bool
    metadata: str
    positions: Floats
    shapes: Floats
    harmonics: Floats
    def __len__(self) -> int: ...

class Device:
    name: str
    def __init__(self, driver: Path, threads: int) -> None: ...
    @staticmethod
    def named(loader: Path, name: str) -> Device: ...
    def render(self, scene: NativeScene, cameras: Sequence[object], settings: str) -> list[FrameArrays]: ...
    def rasterize(
        self,
        means: Floats,
        quats: Floats,
        scales: Floats,
        opacities: Floats,
        colors: Floats,
        sh_degree: Optional[int],
        first: int,
        low: Sequence[float],
        cameras: Sequence[object],
        settings: str,
    ) -> list[FrameArrays]: ...

def device_names(loader: Path) -> list[str]: ...
def open(path: Path, axes: Optional[str], points: Optional[float], level: int) -> NativeScene: ...
def garden(seed: int, count: int) -> NativeScene: ...
def from_arrays(
    means: Floats,
    quats: Floats,
    scales: Floats,
    opacities: Floats,
    harmonics: Floats,
    sh_degree: int,
    origin: Sequence[float],
) -> NativeScene: ...
def read_cameras(
    path: Path, size: Sequence[int], dataparser: Optional[Path], undistorted: bool
) -> tuple[list[CameraItems], list[str]]: ...
def frame(scene: NativeScene, size: Sequence[int], fov: float) -> CameraItems: ...
def look_at(
    eye: Sequence[float], target: Sequence[float], up: Sequence[float], fov: float, size: Sequence[int]
) -> CameraItems: ...

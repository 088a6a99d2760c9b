"""Devices of a process: one of the package's driver for each number of threads, and one for each name of another."""

from __future__ import annotations

import os
import threading
from typing import Optional, Union

from . import _gaurast
from ._env import driver_path, loader_path

# By the number of threads, or by a part of a name.
_devices: dict[Union[int, str], _gaurast.Device] = {}
_lock = threading.Lock()
# The devices of a parent process. Their threads are not here, so they are never dropped.
_of_parent: list[_gaurast.Device] = []


def devices() -> list[str]:
    """The names of the Vulkan devices of this machine that draw Gaussians, for `device=` of `render` and `rasterization`: those of
    Vulkan 1.3 that have the extension, or the features for which compute kernels stand in for it.

    Raises:
        OSError: There is no Vulkan loader.
    """
    return _gaurast.device_names(loader_path())


def device(threads: int, name: Optional[str] = None) -> _gaurast.Device:
    """The package's device with this number of threads, 0 for one for each processor; or the first of `devices()` with `name` in
    its name."""
    if threads < 0:
        raise ValueError("the number of threads is negative")
    if name is not None and threads != 0:
        raise ValueError(f"threads={threads}: only the driver of this package takes a number, not device={name!r}")
    with _lock:
        key = threads if name is None else name
        if key not in _devices:
            _devices[key] = (
                _gaurast.Device(driver_path(), threads)
                if name is None
                else _gaurast.Device.named(loader_path(), name)
            )
        return _devices[key]


def _forget() -> None:
    global _lock
    _lock = threading.Lock()
    _of_parent.extend(_devices.values())
    _devices.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)

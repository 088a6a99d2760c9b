"""Devices of the package's driver, one for each number of threads of a process."""

from __future__ import annotations

import os
import threading

from . import _gaurast
from ._env import driver_path

_devices: dict[int, _gaurast.Device] = {}
_lock = threading.Lock()
# The devices of a parent process. Their threads are not here, so they are never dropped.
_of_parent: list[_gaurast.Device] = []


def device(threads: int) -> _gaurast.Device:
    """The device with this number of threads; 0 is one for each processor."""
    if threads < 0:
        raise ValueError("the number of threads is negative")
    with _lock:
        if threads not in _devices:
            _devices[threads] = _gaurast.Device(driver_path(), threads)
        return _devices[threads]


def _forget() -> None:
    global _lock
    _lock = threading.Lock()
    _of_parent.extend(_devices.values())
    _devices.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)

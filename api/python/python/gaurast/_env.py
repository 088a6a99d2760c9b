"""The package's files for the Vulkan loader, and the environment in which other programs find them."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

_LIBRARIES = Path(__file__).resolve().parent / "lib"


def driver_path() -> str:
    """The driver's library."""
    return str(_LIBRARIES / "libvulkan_gaurast.so")


def icd_path() -> str:
    """The driver's manifest, for `VK_DRIVER_FILES`."""
    return str(_LIBRARIES / "gaurast_icd.json")


def layer_path() -> str:
    """The folder of the manifests of `VK_LAYER_GAURAST_validation` and `VK_LAYER_GAURAST_emulation`, for `VK_ADD_LAYER_PATH`."""
    return str(_LIBRARIES)


def loader_folder() -> str:
    """The folder of the Vulkan loader that the package brings."""
    return str(_LIBRARIES / "loader")


def loader_path() -> str:
    """The Vulkan loader: the system's, or the package's if the system has none."""
    return "libvulkan.so.1" if has_loader() else os.path.join(loader_folder(), "libvulkan.so.1")


def has_loader() -> bool:
    """True if the system has a Vulkan loader."""
    try:
        ctypes.CDLL("libvulkan.so.1")
    except OSError:
        return False
    return True


def environment() -> dict[str, str]:
    """The variables with which a Vulkan program runs on the driver: `VK_DRIVER_FILES`, its older name `VK_ICD_FILENAMES`,
    `VK_ADD_LAYER_PATH` for the layer, and `LD_LIBRARY_PATH` if the system has no Vulkan loader."""
    variables = {
        "VK_DRIVER_FILES": icd_path(),
        "VK_ICD_FILENAMES": icd_path(),
        "VK_ADD_LAYER_PATH": layer_path(),
    }
    if not has_loader() and os.path.isdir(loader_folder()):
        paths = [loader_folder(), os.environ.get("LD_LIBRARY_PATH", "")]
        variables["LD_LIBRARY_PATH"] = ":".join(path for path in paths if path)
    return variables


def use_driver() -> None:
    """Makes Vulkan libraries of this process, such as wgpu, use the driver. Call it before they create an instance. If the
    system has no Vulkan loader, it loads the package's."""
    variables = environment()
    # The dynamic linker reads it when a process starts.
    variables.pop("LD_LIBRARY_PATH", None)
    os.environ.update(variables)
    if not has_loader():
        ctypes.CDLL(loader_path(), mode=ctypes.RTLD_GLOBAL)

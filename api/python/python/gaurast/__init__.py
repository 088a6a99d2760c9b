"""GauRast: a Vulkan driver that runs on the CPU and draws 3D Gaussians, and pictures of scenes drawn with it.

    >>> import gaurast
    >>> picture = gaurast.render(gaurast.open("scene.ply"))
    >>> picture.save("scene.png")

`rasterization` has the arguments and the results of gsplat's function of that name. `icd_path` and `python -m gaurast env`
make any Vulkan program run on the driver.
"""

from ._camera import Camera, Distortion, cameras
from ._device import devices
from ._env import environment, icd_path, layer_path, use_driver
from ._gsplat import rasterization
from ._render import Pictures, render
from ._scene import Scene, garden, open

__version__ = "0.1.0"

__all__ = [
    "Camera",
    "Distortion",
    "Pictures",
    "Scene",
    "cameras",
    "devices",
    "environment",
    "garden",
    "icd_path",
    "layer_path",
    "open",
    "rasterization",
    "render",
    "use_driver",
]

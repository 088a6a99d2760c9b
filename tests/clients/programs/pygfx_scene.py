"""pygfx: meshes, lines, points, a volume and text, offscreen. Each covers its part of the picture in its colour."""

import sys

import numpy as np
import wgpu
from wgpu.backends.wgpu_native.extras import set_instance_extras

set_instance_extras(backends=["Vulkan"], flags=["AllowUnderlyingNoncompliantAdapter"])
import pygfx  # noqa: E402 (after the flags)
from PIL import Image  # noqa: E402
from rendercanvas.offscreen import RenderCanvas  # noqa: E402

SIZE = 400
canvas = RenderCanvas(size=(SIZE, SIZE), pixel_ratio=1)
renderer = pygfx.renderers.WgpuRenderer(canvas)
scene = pygfx.Scene()
scene.add(pygfx.Background.from_color("#000"))
scene.add(pygfx.AmbientLight(intensity=0.4))
light = pygfx.DirectionalLight(intensity=3)
light.local.position = (0, 0, 300)
scene.add(light)


def add(thing, x, y):
    thing.local.position = (x, y, 0)
    scene.add(thing)


add(pygfx.Mesh(pygfx.plane_geometry(80, 80), pygfx.MeshBasicMaterial(color="#f00")), -100, 100)
add(pygfx.Mesh(pygfx.sphere_geometry(45), pygfx.MeshPhongMaterial(color="#0f0")), 0, 100)
checker = np.kron(np.indices((8, 8)).sum(0) % 2, np.ones((8, 8))).astype(np.float32)
add(
    pygfx.Mesh(
        pygfx.plane_geometry(80, 80),
        pygfx.MeshBasicMaterial(map=pygfx.TextureMap(pygfx.Texture(checker, dim=2), filter="nearest")),
    ),
    100,
    100,
)
line = np.array([[-40, 0, 0], [40, 0, 0]], np.float32)
add(pygfx.Line(pygfx.Geometry(positions=line), pygfx.LineMaterial(thickness=20, color="#ff0")), -100, 0)
point = np.zeros((1, 3), np.float32)
add(pygfx.Points(pygfx.Geometry(positions=point), pygfx.PointsMaterial(size=60, color="#0ff")), 0, 0)
volume = np.full((16, 16, 16), 0.5, np.float32)
add(
    pygfx.Volume(
        pygfx.Geometry(grid=pygfx.Texture(volume, dim=3)), pygfx.VolumeMipMaterial(clim=(0, 1), interpolation="linear")
    ),
    100 - 7.5,
    -7.5,
)
add(pygfx.Text(text="GauRast", font_size=60, anchor="middle-center", material=pygfx.TextMaterial("#fff")), 0, -100)
camera = pygfx.OrthographicCamera(SIZE, SIZE)
camera.local.position = (0, 0, 200)
canvas.request_draw(lambda: renderer.render(scene, camera))
picture = np.asarray(canvas.draw())[..., :3].astype(int)
Image.fromarray(picture.astype(np.uint8)).save(sys.argv[1])


def region(x, y, half):
    """The pixels around a place of the scene."""
    row, column = SIZE // 2 - y, SIZE // 2 + x
    return picture[row - half : row + half, column - half : column + half]


def expect(what, found, want, tolerance):
    assert abs(found - want) <= tolerance, f"{what}: {found:.3f}, not {want:.3f}"


def share(pixels, colour):
    """The part of the pixels that is nearer to a colour than to black. Edges are smoothed."""
    return (np.abs(pixels - np.array(colour)) < 128).all(-1).mean()


expect("the plane's share", share(region(-100, 100, 50), (255, 0, 0)), 0.64, 0.01)
green = region(0, 100, 50)
expect("the sphere's share", (green[..., 1] > 64).mean(), np.pi * 0.45**2, 0.02)
assert green[50, 50, 1] > green[50, 90, 1] + 30, "the sphere is not lit from the front"
expect("the checker's white", share(region(100, 100, 50), (255, 255, 255)), 0.32, 0.02)
expect("the line's share", share(region(-100, 0, 50), (255, 255, 0)), (80 * 20 + np.pi * 100) / 1e4, 0.02)
expect("the point's share", share(region(0, 0, 50), (0, 255, 255)), np.pi * 0.3**2, 0.02)
expect("the volume's share", (region(100, 0, 20)[..., 0] > 60).mean(), 0.16, 0.02)
expect("the text's share", (picture[260:340, 60:340].mean(-1) > 128).mean(), 0.16, 0.04)
print(f"{renderer.device.adapter.info['device']}: seven objects cover what they must")

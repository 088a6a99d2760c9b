"""The package as a driver for other programs, and its command."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gaurast


def run(*words, **options):
    return subprocess.run(words, check=True, capture_output=True, text=True, **options).stdout


def test_manifests_name_what_is_there():
    layers = Path(gaurast.layer_path())
    for path in [Path(gaurast.icd_path()), layers / "gaurast_layer.json", layers / "gaurast_emulation.json"]:
        manifest = json.loads(path.read_text())
        library = manifest.get("ICD", manifest.get("layer"))["library_path"]
        assert library.startswith("./") and (path.parent / library).exists()


def test_the_environment_is_that_of_a_shell():
    printed = run(sys.executable, "-m", "gaurast", "env")
    script = printed + 'printf "%s" "$VK_DRIVER_FILES:$VK_ICD_FILENAMES:$VK_ADD_LAYER_PATH"'
    assert run("sh", "-c", script) == f"{gaurast.icd_path()}:{gaurast.icd_path()}:{gaurast.layer_path()}"


def test_vulkan_programs_run_on_the_driver():
    if shutil.which("vulkaninfo") is None:
        pytest.skip("vulkaninfo is missing")
    printed = run("vulkaninfo", "--summary", env={**os.environ, **gaurast.environment()})
    assert "GauRast" in printed


def test_the_command_draws(tmp_path):
    gaurast.garden(1, 500).write_ply(tmp_path / "a.ply")
    run(sys.executable, "-m", "gaurast", "a.ply", "--size", "64x36", "-o", "a.png", cwd=tmp_path)
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    assert gaurast.icd_path() in run(sys.executable, "-m", "gaurast", "icd")


@pytest.fixture
def lavapipe():
    """A part of the name of Mesa's device for processors."""
    try:
        names = gaurast.devices()
    except (OSError, RuntimeError) as error:
        pytest.skip(f"no Vulkan devices: {error}")
    if not any("llvmpipe" in name for name in names):
        pytest.skip("lavapipe is missing")
    return "llvmpipe"


def same_pictures(first, second):
    """True if all but few pixels are equal. Those others may be undecidable in binary32."""
    differences = np.abs(np.asarray(first) - np.asarray(second)).max(axis=-1)
    return (differences > 1e-5).mean() <= 0.001 and (differences <= 0.02).all()


def test_another_device_draws_scenes(lavapipe):
    scene = gaurast.garden(1, 500)
    camera = scene.frame((96, 54))
    own = gaurast.render(scene, camera, depth=True, ids=True)
    other = gaurast.render(scene, camera, depth=True, ids=True, device=lavapipe)
    assert own.alpha.max() > 0.5 and same_pictures(own, other)
    assert (own.ids == other.ids).mean() > 0.995
    seen = np.isfinite(own.median_depth)
    assert np.allclose(own.median_depth[seen], other.median_depth[seen], rtol=1e-3)


def test_another_device_draws_arrays(arrays, lavapipe):
    given = arrays(7, 300)
    words = (given.means, given.quats, given.scales, given.opacities, given.harmonics, given.viewmat[None], given.K[None])
    own, own_alphas, _ = gaurast.rasterization(*words, *given.size, sh_degree=3, render_mode="RGB+ED")
    other, alphas, _ = gaurast.rasterization(*words, *given.size, sh_degree=3, render_mode="RGB+ED", device=lavapipe)
    assert same_pictures(own[..., :3], other[..., :3]) and same_pictures(own_alphas, alphas)


def test_devices_that_are_not_there_are_refused():
    scene = gaurast.garden(1, 10)
    with pytest.raises((ValueError, OSError), match="nobody's device|libvulkan"):
        gaurast.render(scene, size=(8, 8), device="nobody's device")
    with pytest.raises(ValueError, match="threads=2"):
        gaurast.render(scene, size=(8, 8), device="llvmpipe", threads=2)


def draw(_):
    return np.asarray(gaurast.render(gaurast.garden(1, 500), size=(32, 18)))


def test_a_forked_process_draws():
    alone = draw(0)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        for picture in pool.map(draw, range(2)):
            assert np.array_equal(picture, alone)


def test_memory_does_not_grow(arrays):
    scene = arrays(0, 200)

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def draws(count):
        for _ in range(count):
            gaurast.rasterization(
                scene.means, scene.quats, scene.scales, scene.opacities, scene.colors, scene.viewmat[None], scene.K[None], 32, 32
            )

    draws(300)
    before = resident()
    draws(10_000 if os.environ.get("GAURAST_TEST_LONG") else 1000)
    assert resident() - before < 4 << 20


@pytest.mark.skipif(sys.version_info < (3, 11), reason="NumPy's types of this Python are older ones")
def test_types(pytestconfig):
    pytest.importorskip("mypy")
    package = Path(gaurast.__file__).parent
    configuration = pytestconfig.rootpath / "pyproject.toml"
    run(sys.executable, "-m", "mypy", "--strict", f"--config-file={configuration}", "--cache-dir=/dev/null", str(package))

"""The installed tree of driver/package/install.sh."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

_INSTALL = Path(__file__).resolve().parents[3] / "driver/package/install.sh"


@pytest.fixture(scope="module")
def built():
    """The folder of the built files, which run.sh names."""
    folder = os.environ.get("GAURAST_BUILD")
    if not folder:
        pytest.skip("GAURAST_BUILD is not set")
    return folder


@pytest.mark.parametrize("libraries", ["lib", "lib/x86_64-linux-gnu"])
def test_an_installed_tree_may_be_moved(built, tmp_path, libraries):
    variables = {**os.environ, "DESTDIR": str(tmp_path), "PREFIX": "/opt/gaurast", "LIBDIR": f"/opt/gaurast/{libraries}"}
    subprocess.run([_INSTALL, built], check=True, env=variables)
    root = tmp_path / "moved"
    shutil.move(str(tmp_path / "opt/gaurast"), root)
    layers = ["explicit_layer.d/gaurast_layer.json", "explicit_layer.d/gaurast_emulation.json"]
    for manifest in ["icd.d/gaurast_icd.json", *layers]:
        path = root / "share/vulkan" / manifest
        content = json.loads(path.read_text())
        library = content.get("ICD", content.get("layer"))["library_path"]
        assert (path.parent / library).resolve().parent == root / libraries and (path.parent / library).exists()
    printed = subprocess.run([root / "bin/gaurast", "icd"], check=True, capture_output=True, text=True).stdout
    assert f"VK_DRIVER_FILES='{root}/share/vulkan/icd.d/gaurast_icd.json'" in printed
    package = (root / libraries / "pkgconfig/gaurast.pc").read_text()
    prefix = package.splitlines()[0].removeprefix("prefix=${pcfiledir}/")
    header = root / libraries / "pkgconfig" / prefix / "include/vulkan/vulkan_gaurast.h"
    assert header.resolve() == root / "include/vulkan/vulkan_gaurast.h" and header.exists()
    for file in ["share/man/man1/gaurast.1", "share/bash-completion/completions/gaurast", "share/doc/gaurast/LICENSE-MIT"]:
        assert (root / file).stat().st_size > 100
    shutil.rmtree(root)


def test_wrong_uses_are_refused(built, tmp_path):
    for words, variables in [([], {}), ([str(tmp_path)], {}), ([built], {"PREFIX": "/usr", "LIBDIR": "/lib"})]:
        done = subprocess.run([_INSTALL, *words], env={**os.environ, "DESTDIR": str(tmp_path), **variables}, capture_output=True)
        assert done.returncode == 2
    assert not list(tmp_path.iterdir())

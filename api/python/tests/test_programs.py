"""The programs of docs/python.md, as they stand there. The longest has 15 lines."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import gaurast

_PAGE = Path(__file__).resolve().parents[3] / "docs/python.md"
_PROGRAMS = dict(re.findall(r"^### (.*?)\n.*?^```python\n(.*?)^```", _PAGE.read_text(), re.MULTILINE | re.DOTALL))


@pytest.fixture
def folder(tmp_path):
    gaurast.garden(1, 3000).write_ply(tmp_path / "scene.ply")
    camera = {"width": 64, "height": 48, "position": [0, 0, -4], "rotation": np.eye(3).tolist(), "fx": 50, "fy": 50}
    (tmp_path / "cameras.json").write_text(json.dumps([{**camera, "img_name": "a"}, {**camera, "img_name": "b"}]))
    return tmp_path


def run(name, folder):
    done = subprocess.run([sys.executable, "-c", _PROGRAMS[name]], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def needs(module):
    if not os.environ.get("GAURAST_TEST_LONG"):
        pytest.skip("GAURAST_TEST_LONG is not set")
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is missing")


def test_there_are_five_of_at_most_fifteen_lines():
    assert len(_PROGRAMS) == 5
    for name, program in _PROGRAMS.items():
        assert len([line for line in program.splitlines() if line.strip()]) <= 15, name


def test_a_picture(folder):
    assert run("A picture", folder) == "(1, 360, 640, 4) float32\n"
    assert (folder / "scene.png").stat().st_size > 1000


def test_the_views_of_a_dataset(folder):
    run("The views of a dataset", folder)
    views = np.load(folder / "views.npz")
    assert views["color"].shape == (2, 180, 320, 4) and views["ids"].max() < 3100
    assert (folder / "a.png").exists() and (folder / "b.png").exists()


def test_gsplats_call(folder):
    assert run("gsplat's call", folder) == "(1, 180, 320, 4) (1, 180, 320, 1) 20\n"


def test_a_mujoco_camera(folder):
    needs("mujoco")
    run("A MuJoCo camera beside splats", folder)
    assert (folder / "robot.png").stat().st_size > 500


def test_a_wgpu_program(folder):
    needs("wgpu")
    printed = run("A wgpu program on the package's driver", folder)
    assert "GauRast" in printed and printed.endswith("[0, 1, 4, 9, 16, 25, 36, 49]\n")

"""What the tests share."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest


class Arrays:
    """Random Gaussians before a camera that looks along +z."""

    def __init__(self, seed: int, count: int, channels: int = 3) -> None:
        random = np.random.default_rng(seed)
        self.means = random.normal(0.0, 1.0, (count, 3)) + [0.0, 0.0, 5.0]
        self.quats = random.normal(0.0, 1.0, (count, 4))
        self.scales = np.exp(random.uniform(-4.0, -1.0, (count, 3)))
        self.opacities = random.uniform(0.01, 1.0, count)
        self.colors = random.uniform(-0.5, 1.5, (count, channels))
        self.harmonics = random.normal(0.0, 0.4, (count, 16, 3))
        angle = random.uniform(-0.3, 0.3)
        self.viewmat = np.eye(4)
        self.viewmat[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        self.viewmat[:3, 3] = random.normal(0.0, 0.1, 3)
        self.size = (int(random.integers(40, 90)), int(random.integers(30, 70)))
        width, height = self.size
        self.K = np.array([[70.0, 0, width / 2 + 3.0], [0, 75.0, height / 2 - 2.0], [0, 0, 1]])
        for name in ("means", "quats", "scales", "opacities", "colors", "harmonics", "viewmat", "K"):
            setattr(self, name, getattr(self, name).astype(np.float32))


@pytest.fixture
def arrays():
    return Arrays


@pytest.fixture
def test_data() -> Path:
    """The folder of test data."""
    folder = os.environ.get("GAURAST_TEST_DATA")
    if not folder:
        pytest.skip("GAURAST_TEST_DATA is not set")
    return Path(folder)

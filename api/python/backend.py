"""Builds the Python package: maturin's backend (PEP 517), which first builds the driver, the layers and the command. The package
has one copy of the driver, which its module, its command and the Vulkan loader load.

`python backend.py wheel FOLDER` builds the wheel of a release: by zig, for manylinux2014, with a Vulkan loader if GAURAST_LOADER
names one's file, such as Debian 11's, since a newer one does not load on older systems. It needs maturin, cargo-zigbuild and ziglang
from PyPI. `python backend.py sdist FOLDER` makes the source archive.
"""

from __future__ import annotations

import io
import os
import platform
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

_HERE = Path(__file__).resolve().parent
# The source archive has this file in its own root.
_ROOT = _HERE if (_HERE / "Cargo.lock").exists() else _HERE.parent.parent
_PACKAGE = _ROOT / "api/python"
_TARGET = "x86_64-unknown-linux-gnu"
_LIBRARY_PACKAGES = ["gaurast-icd", "gaurast-layer", "gaurast-emulation-layer"]
_MANIFESTS = {
    "gaurast_icd.json": "driver/icd",
    "gaurast_layer.json": "api/layer",
    "gaurast_emulation.json": "api/emulation/layer",
}
# The C library of the oldest systems that the wheel of a release runs on. Its loader may need that of Debian 11.
_GLIBC = "2.17"
_GLIBC_OF_LOADER = 31
# The most megabytes of the wheel of a release.
_WHEEL_MEGABYTES = 12
_LIBRARIES = ["libvulkan_gaurast.so", "libVkLayer_gaurast_validation.so", "libVkLayer_gaurast_emulation.so"]


def _target_folder() -> Path:
    return Path(os.environ.get("CARGO_TARGET_DIR", _ROOT / "target"))


class _Build:
    """Builds of the profile `dist` by a subcommand of cargo."""

    def __init__(self, subcommand: str, target: list[str]) -> None:
        if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
            sys.exit("gaurast: the driver is built for Linux on x86-64 alone")
        self._cargo = ["cargo", subcommand, "--locked", "--profile", "dist", *target]
        self.folder = _target_folder() / (_TARGET if target else "") / "dist"

    def run(self, packages: list[str], *options: str) -> None:
        words = [word for package in packages for word in ("-p", package)]
        subprocess.run([*self._cargo, *words, *options], cwd=_ROOT, check=True)

    def run_for_wheel(self) -> None:
        """Builds the driver, the layers, and the command without a driver of its own."""
        self.run(_LIBRARY_PACKAGES)
        self.run(["gaurast-cli"], "--no-default-features")


def collect(built: Path, package: Path = _PACKAGE / "python/gaurast") -> None:
    """Copies what the module needs from `built` into the package: libraries, manifests beside them, the command, and the loader
    that GAURAST_LOADER names."""
    libraries, programs = package / "lib", package / "bin"
    for folder in (libraries, programs):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    for name in _LIBRARIES:
        shutil.copy(built / name, libraries)
    shutil.copy(built / "gaurast", programs)
    for name, folder in _MANIFESTS.items():
        text = (_ROOT / folder / name).read_text()
        (libraries / name).write_text(re.sub(r'("library_path": ")[^"]*/', r"\1./", text))
    loader = os.environ.get("GAURAST_LOADER")
    if loader:
        (libraries / "loader").mkdir()
        shutil.copy(loader, libraries / "loader/libvulkan.so.1")
        notice = "libvulkan.so.1 is the Vulkan loader of the Khronos Group and LunarG, under the Apache License 2.0.\n"
        (libraries / "loader/NOTICE").write_text(notice)


def _check_loader() -> None:
    """Refuses a Vulkan loader that older systems cannot load."""
    loader = os.environ.get("GAURAST_LOADER")
    if loader:
        versions = re.findall(rb"GLIBC_2\.(\d+)", Path(loader).read_bytes())
        newest = max(map(int, versions), default=0)
        if newest > _GLIBC_OF_LOADER:
            sys.exit(f"gaurast: GAURAST_LOADER: {loader} needs glibc 2.{newest}, and the wheel's is to run with 2.{_GLIBC_OF_LOADER}")


def _licences() -> None:
    if _ROOT != _PACKAGE:
        for name in ("LICENSE-MIT", "LICENSE-APACHE"):
            shutil.copy(_ROOT / name, _PACKAGE)


def _version() -> str:
    match = re.search(r'^version = "(.*)"', (_ROOT / "Cargo.toml").read_text(), re.MULTILINE)
    assert match is not None
    return match[1]


def _sources() -> list[str]:
    """The files of the source archive: the workspace without its pictures."""
    folders = ["api", "driver", "samples", "simdevice", "tests"]
    files = ["Cargo.toml", "Cargo.lock", "README.md", "LICENSE-MIT", "LICENSE-APACHE", "clippy.toml"]
    if (_ROOT / ".git").exists():
        listed = subprocess.run(["git", "ls-files", *folders], cwd=_ROOT, check=True, capture_output=True, text=True)
        names = listed.stdout.splitlines()
    else:
        names = [str(path.relative_to(_ROOT)) for folder in folders for path in (_ROOT / folder).rglob("*") if path.is_file()]
    built = ("api/python/python/gaurast/lib/", "api/python/python/gaurast/bin/", "samples/pictures/", "tests/fuzz/")
    return sorted(files + [name for name in names if not name.startswith(built)])


def build_sdist(sdist_directory: str, config_settings: object = None) -> str:
    """Makes the source archive. Its root has the package's pyproject.toml, with paths from there."""
    name = f"gaurast-{_version()}"
    project = (_PACKAGE / "pyproject.toml").read_text()
    project = project.replace('python-source = "python"', 'python-source = "api/python/python"\nmanifest-path = "api/python/Cargo.toml"')
    project = project.replace('path = "python/', 'path = "api/python/python/').replace('"README.md"', '"api/python/README.md"')
    project = project.replace('dynamic = ["version"]', f'version = "{_version()}"')
    metadata = f"Metadata-Version: 2.1\nName: gaurast\nVersion: {_version()}\nRequires-Python: >=3.9\nLicense: MIT OR Apache-2.0\n"
    path = Path(sdist_directory) / f"{name}.tar.gz"
    with tarfile.open(path, "w:gz", format=tarfile.PAX_FORMAT) as archive:
        for file in _sources():
            archive.add(_ROOT / file, f"{name}/{file}", recursive=False)
        texts = {"pyproject.toml": project, "PKG-INFO": metadata, "backend.py": (_PACKAGE / "backend.py").read_text()}
        for file, text in texts.items():
            data = text.encode()
            info = tarfile.TarInfo(f"{name}/{file}")
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return path.name


def build_wheel(wheel_directory: str, config_settings: object = None, metadata_directory: object = None) -> str:
    """Builds the wheel for this machine, as pip does."""
    import maturin

    _licences()
    build = _Build("build", [])
    build.run_for_wheel()
    collect(build.folder)
    name: str = maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
    return name


def get_requires_for_build_wheel(config_settings: object = None) -> list[str]:
    """Nothing more than what pyproject.toml requires."""
    return []


get_requires_for_build_sdist = get_requires_for_build_wheel


def release_wheel(folder: str) -> None:
    """Builds the wheel of a release, for glibc 2.17 or later. The build folder is left with the command that has the driver inside,
    for an archive or a package."""
    _check_loader()
    _licences()
    build = _Build("zigbuild", ["--target", f"{_TARGET}.{_GLIBC}"])
    build.run_for_wheel()
    collect(build.folder)
    build.run(["gaurast-cli"])
    command = ["maturin", "build", "--zig", "--locked", "--target", _TARGET, "--compatibility", "manylinux2014"]
    subprocess.run([*command, "--out", str(Path(folder).resolve())], cwd=_PACKAGE, check=True)
    for wheel in Path(folder).glob(f"gaurast-{_version()}-*.whl"):
        megabytes = wheel.stat().st_size / 1e6
        if megabytes > _WHEEL_MEGABYTES:
            sys.exit(f"gaurast: {wheel} has {megabytes:.1f} MB, and its budget is {_WHEEL_MEGABYTES}")


if __name__ == "__main__":
    kinds = {"wheel": release_wheel, "sdist": build_sdist}
    if len(sys.argv) != 3 or sys.argv[1] not in kinds:
        sys.exit(f"usage: {sys.argv[0]} wheel|sdist FOLDER")
    os.makedirs(sys.argv[2], exist_ok=True)
    kinds[sys.argv[1]](sys.argv[2])

"""`python -m gaurast env` prints the environment for Vulkan programs; other arguments are those of the command `gaurast`."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path

from ._env import environment


def command() -> None:
    """Becomes the command `gaurast`."""
    program = Path(__file__).resolve().parent / "bin" / "gaurast"
    if not program.exists():
        sys.exit("gaurast: this installation has no command")
    os.execv(program, ["gaurast", *sys.argv[1:]])


def main() -> None:
    """Runs `python -m gaurast`."""
    if sys.argv[1:] == ["env"]:
        for name, value in environment().items():
            print(f"export {name}={shlex.quote(value)}")
    else:
        command()


if __name__ == "__main__":
    main()

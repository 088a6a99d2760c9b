"""Arrays of other libraries as NumPy's, and back."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]

# The devices of DLPack whose memory the processor reads: its own, and pinned by CUDA or ROCm.
_READABLE = (1, 3, 11)


def floats(value: Any, name: str) -> Floats:
    """`value` as contiguous binary32: an array, anything that NumPy takes, or a tensor on the processor by DLPack."""
    if getattr(value, "requires_grad", False):
        raise NotImplementedError(
            f"{name} needs a gradient, and GauRast has the forward pass alone: train with gsplat on a GPU, or pass {name}.detach()"
        )
    if not isinstance(value, np.ndarray) and hasattr(value, "__dlpack_device__"):
        kind, _ = value.__dlpack_device__()
        if int(kind) not in _READABLE:
            raise ValueError(f"{name} is in a GPU's memory, and GauRast draws on the processor: pass {name}.cpu()")
        try:
            value = np.from_dlpack(value)
        except (AttributeError, BufferError, RuntimeError, TypeError):
            # NumPy before 1.23, and types that DLPack lacks, of which NumPy takes none of torch's.
            value = np.asarray(value.float() if _library(value) == "torch" else value)
    return np.ascontiguousarray(value, dtype=np.float32)


def _library(value: Any) -> str:
    return type(value).__module__.partition(".")[0]


def like(array: npt.NDArray[Any], example: Any) -> Any:
    """`array` as a tensor of the library that `example` is of."""
    library = _library(example)
    if library == "torch":
        return sys.modules["torch"].from_numpy(array)
    if library in ("jax", "jaxlib"):
        return sys.modules["jax"].numpy.asarray(array)
    return array

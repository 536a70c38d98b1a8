"""Array types used in signatures; the shape stands in the docstring."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]
AnyArray: TypeAlias = NDArray[Any]


def frozen(values: object, shape: tuple[int | None, ...], name: str) -> Array:
    """A read-only float64 copy of `values`; raises ValueError unless it is finite and of `shape`.

    shape: one entry per axis, None where any length is allowed.
    """
    array = np.array(values, dtype=np.float64)
    fits = array.ndim == len(shape)
    if fits and array.shape != shape:
        for wanted, length in zip(shape, array.shape, strict=True):
            fits = fits and (wanted is None or wanted == length)
    if not fits:
        want = "x".join("n" if n is None else str(n) for n in shape)
        have = "x".join(map(str, array.shape)) or "a single number"
        raise ValueError(f"{name} must have shape {want}, not {have}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite numbers")
    array.setflags(write=False)
    return array

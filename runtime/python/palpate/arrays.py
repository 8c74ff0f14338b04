"""Types of arrays, for annotations."""

from __future__ import annotations

import typing

import numpy

try:
    from numpy.typing import ArrayLike, NDArray
except ImportError:  # numpy before 1.21
    if not typing.TYPE_CHECKING:
        ArrayLike, NDArray = typing.Any, typing.List

Array = NDArray[numpy.float64]
Numbers = NDArray[numpy.int32]

"""Messages between processes: a line of JSON, which the bytes of the arrays in it follow.

Nothing is unpickled, as a process that has read a hostile file may send anything.
"""

from __future__ import annotations

import json
import math
from typing import Any, Literal

import numpy as np

# key of a JSON object that stands for an array: dtype, shape, order of its bytes
_ARRAY = "__array__"


def write_message(stream: Any, message: object) -> None:
    """Write a message to a buffered binary stream."""
    arrays: list[bytes] = []

    def encode(value: object) -> object:
        if isinstance(value, np.generic):
            return value.item()
        if not isinstance(value, np.ndarray):
            raise TypeError(f"{type(value).__name__} cannot be part of a message")
        order: Literal["C", "F"] = "C" if value.flags.c_contiguous else "F"
        arrays.append(value.tobytes(order))
        return {_ARRAY: [value.dtype.str, value.shape, order]}

    stream.write(json.dumps(message, default=encode).encode() + b"\n")
    for data in arrays:
        stream.write(data)
    stream.flush()


def read_message(stream: Any) -> Any:
    """Read a message from a binary stream; raises EOFError where it is not complete, and ValueError if it is none."""

    def decode(value: dict[str, Any]) -> Any:
        if value.keys() != {_ARRAY}:
            return value
        dtype, shape, order = value[_ARRAY]
        data = bytearray(math.prod(shape) * np.dtype(dtype).itemsize)
        rest = memoryview(data)
        while rest:
            count = stream.readinto(rest)
            if not count:
                raise EOFError
            rest = rest[count:]
        return np.ndarray(shape, dtype, data, order=order)

    line = stream.readline()
    if not line.endswith(b"\n"):
        raise EOFError
    return json.loads(line, object_hook=decode)

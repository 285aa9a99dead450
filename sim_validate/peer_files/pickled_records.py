"""Reads `.npy` files: arrays of numbers, or plain dictionaries that were saved as objects."""

import io
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.errors import InputError
from grasp_core.files.strict_json import shown
from grasp_core.files.text_files import read_bytes
from sim_validate.peer_files.pickled_values import pickled_value

MOST_BYTES = 256 * 2**20
MOST_HEADER = 10_000
"""Largest number of characters in an array's header, a limit of numpy's."""
BEGINNING = b"\x93NUMPY"


def read_npy(path: Path) -> Any:
    """Read an array of numbers, or the value that was saved as an object; nothing is executed.

    Raises:
        InputError: The file cannot be read, is too large, or holds anything but plain values.
    """
    data = read_bytes(path, MOST_BYTES)
    try:
        return npy_value(data)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def npy_value(data: bytes) -> Any:
    """Read the bytes of a `.npy` file as `read_npy` does."""
    if not data.startswith(BEGINNING):
        raise InputError("expected a .npy file; save it with numpy.save")
    stream = io.BytesIO(data)
    shape, by_columns, dtype = _header(stream)
    rest = data[stream.tell() :]
    if dtype.kind == "O":
        return pickled_value(rest)
    if dtype.kind not in "fiub" or dtype.subdtype is not None:
        raise InputError(f"expected an array of numbers, got {shown(str(dtype))}")
    count = 1
    for length in shape:
        count *= length
    if count * dtype.itemsize != len(rest):
        raise InputError(f"the array's shape {shape} does not fit its {len(rest)} bytes")
    found = np.frombuffer(rest, dtype)
    return found.reshape(shape, order="F" if by_columns else "C").astype(np.float64)


def _header(stream: io.BytesIO) -> tuple[tuple[int, ...], bool, "np.dtype[Any]"]:
    try:
        version = np.lib.format.read_magic(stream)
        readers = {(1, 0): np.lib.format.read_array_header_1_0,
                   (2, 0): np.lib.format.read_array_header_2_0}  # fmt: skip
        return readers[version](stream, max_header_size=MOST_HEADER)
    except Exception as error:  # a damaged header can make numpy raise anything
        raise InputError(
            f"the header of the array cannot be read ({shown(str(error))}); save it again"
        ) from error

"""Reads what `numpy.save` has pickled into a `.npy` file, and runs nothing that the file names.

`pickle.Unpickler` makes numbers, text and containers by itself, and asks `find_class` for all else.
Here it gets makers of plain arrays and numbers for the names that NumPy writes, or an error. Not
even NumPy's own functions are handed out, because its types and arrays trust the state that a file
gives them. The opcodes are counted before, so that no short file takes all memory or a deep stack.
"""

import io
import math
import pickle
import pickletools
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from grasp_core.arrays import Array
from grasp_core.errors import InputError
from grasp_core.files.json_text import shown
from grasp_core.files.text_files import read_bytes

MOST_BYTES = 16 * 2**20
"""Largest size of a file: a record has some thousand bytes."""
MOST_OPCODES = 10_000
"""Largest number of opcodes, and so of values: a record has some sixty."""
MOST_HEADER = 10_000
"""Largest number of characters in an array's header, a limit of numpy's."""
BEGINNING = b"\x93NUMPY"
OTHERS = {
    b"PK": "a zip archive, such as .npz", b"\x89HDF": "an HDF5 file", b"\x80": "a bare pickle",
    b"{": "JSON",
}  # fmt: skip
"""Other kinds of files, by their first bytes."""
GRASPNET_COLUMNS = 17
KINDS = "fiub"
"""Kinds of numbers in arrays: real, whole, truth values."""


class Numbers:
    """An array that a pickle makes: its values come later, as its state."""

    __slots__ = ("values",)

    def __init__(self, *_: Any) -> None:
        self.values: Array | list[Any] | None = None

    def __setstate__(self, state: Any) -> None:
        _, shape, kind, by_columns, data = state
        if kind.plain.kind == "O":
            self.values = list(data)
        else:
            self.values = _filled(data, kind, shape, "F" if by_columns else "C")


class _Kind:
    """The type of an array's entries."""

    __slots__ = ("plain",)

    def __init__(self, code: Any, *_: Any) -> None:
        self.plain = np.dtype(str(code))
        if self.plain.kind not in KINDS + "O":
            raise InputError(f"an array has the type {shown(str(code))}, expected numbers")

    def __setstate__(self, state: Any) -> None:
        self.plain = self.plain.newbyteorder(state[1])


def _filled(data: Any, kind: Any, shape: tuple[int, ...], order: Any) -> Array:
    if kind.plain.kind == "O" or math.prod(shape) * kind.plain.itemsize != len(data):
        raise InputError(f"an array has {len(data)} bytes, which do not fit the shape {shape}")
    return np.frombuffer(data, kind.plain).reshape(
        shape, order=order
    )  # no copy: files may say it often


def _scalar(kind: Any, data: Any) -> Any:
    return _filled(data, kind, (), "C").item()


ALLOWED: dict[str, Any] = {
    "numpy.ndarray": Numbers, "numpy.dtype": _Kind,
    **{
        f"numpy.{core}.{name}": make
        for core in ("core", "_core")
        for name, make in (("multiarray._reconstruct", Numbers), ("multiarray.scalar", _scalar),
                           ("numeric._frombuffer", _filled))
    },
}  # fmt: skip
"""What makes plain values in place of the functions that NumPy 1 and 2 name."""


class _Unpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str, /) -> Any:
        make = ALLOWED.get(f"{module}.{name}")
        if make is None:
            _refuse(f"the file names {shown(f'{module}.{name}')}, which is not looked up")

        def made(*given: Any) -> Any:  # a new one: files can set attributes of what they get
            return make(*given)

        return made


def _refuse(why: str) -> NoReturn:
    raise InputError(f"{why}; save plain dictionaries of arrays, numbers and text")


def read_pickled(path: Path) -> Any:
    """Read the value in a `.npy` file, or the list of values if it is an array of them.

    Arrays in it are `Numbers`.
    """
    data = read_bytes(path, MOST_BYTES)
    try:
        return _value(data)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _value(data: bytes) -> Any:
    if not data.startswith(BEGINNING):
        kind = next((name for first, name in OTHERS.items() if data.startswith(first)), "no array")
        raise InputError(f"expected a .npy file that numpy.save has written, got {kind}")
    stream = io.BytesIO(data)
    shape, dtype = _header(stream)
    if dtype.kind != "O":
        hint = ""
        if shape[-1:] == (GRASPNET_COLUMNS,):
            hint = ". Rows of 17 numbers are GraspNet's gripper poses, which are not read"
        raise InputError(f"expected a dictionary, got an array of numbers of shape {shape}{hint}")
    values = _unpickled(data[stream.tell() :])
    return values[0] if shape == () else values


def _header(stream: io.BytesIO) -> tuple[tuple[int, ...], "np.dtype[Any]"]:
    try:
        version = np.lib.format.read_magic(stream)
        readers = {(1, 0): np.lib.format.read_array_header_1_0,
                   (2, 0): np.lib.format.read_array_header_2_0}  # fmt: skip
        shape, _, dtype = readers[version](stream, max_header_size=MOST_HEADER)
    except Exception as error:  # a damaged header can make numpy raise anything
        raise InputError(
            f"the header of the array cannot be read ({shown(str(error))}); save it again"
        ) from error
    return shape, dtype


def _unpickled(data: bytes) -> list[Any]:
    try:
        _count(data)
        found = _Unpickler(io.BytesIO(data)).load()
    except InputError:
        raise
    except Exception as error:  # a damaged pickle can make each step raise anything
        _refuse(f"the pickle cannot be read as plain values ({shown(str(error))})")
    if not (isinstance(found, Numbers) and isinstance(found.values, list) and found.values):
        _refuse("the pickle holds no array of values")
    return found.values


def _count(data: bytes) -> None:
    """Refuse a pickle of many opcodes, or one that numbers its values beyond their count."""
    for count, (opcode, argument, _) in enumerate(pickletools.genops(data)):
        place = argument if "PUT" in opcode.name and argument is not None else 0
        if count >= MOST_OPCODES or int(place) > MOST_OPCODES:
            _refuse(f"the pickle holds more than {MOST_OPCODES} values")

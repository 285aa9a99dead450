"""Reads arrays from npz files, each checked before much memory is used.

An archive may claim any size, hold a name twice, or have members with wrong headers. Only arrays of
numbers and truth values are read, with exactly as many bytes as their shapes need.
"""

import io
import math
import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import shown
from grasp_core.files.text_files import read_bytes

MOST_BYTES = 256 * 2**20
"""Largest total size of the arrays in a file."""
MOST_MEMBERS = 256
MOST_HEADER = 10_000
"""Largest number of characters in an array's header, a limit of numpy's."""
KINDS = "biuf"
"""Kinds of arrays that are read: truth values and numbers."""
BEGINNING, ENDING = b"PK\x03\x04", ".npy"
"""First bytes of a zip archive, and ending of the array names inside it."""


def read_arrays(path: Path, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Read the named arrays of an npz file that exist; nothing in the file is executed."""
    data = read_bytes(path, MOST_BYTES)
    with about(path):
        return arrays_of(data, names)


def arrays_of(data: bytes, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Read the named arrays that exist from the bytes of an npz file."""
    if not data.startswith(BEGINNING):
        raise InputError(
            "expected an npz file, which begins as a zip archive does; save it with numpy.savez"
        )
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = _checked(archive.infolist())
            return {
                name: _array(archive, members[name + ENDING], name)
                for name in names
                if name + ENDING in members
            }
    except InputError:
        raise
    except Exception as error:  # a damaged file can make zipfile and numpy raise anything
        raise InputError(
            f"the file cannot be read as npz ({shown(str(error))}); save it again with numpy.savez"
        ) from error


def _checked(listed: list[zipfile.ZipInfo]) -> dict[str, zipfile.ZipInfo]:
    """Index the arrays of an archive by name, and refuse an archive that claims too much."""
    if len(listed) > MOST_MEMBERS:
        raise InputError(
            f"the npz file has {len(listed)} members, more than the {MOST_MEMBERS} arrays allowed"
        )
    claimed = sum(each.file_size for each in listed)
    if claimed > MOST_BYTES:
        raise InputError(
            f"the arrays of the npz file take {claimed} bytes, over the limit of {MOST_BYTES}; "
            "save fewer numbers"
        )
    members = {each.filename: each for each in listed}
    if len(members) < len(listed):
        raise InputError("two arrays of the npz file have the same name; write the file again")
    return members


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> NDArray[Any]:
    with archive.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        readers = {(1, 0): np.lib.format.read_array_header_1_0,
                   (2, 0): np.lib.format.read_array_header_2_0}  # fmt: skip
        if version not in readers:
            raise InputError(
                f"{name}: expected an array in npy format 1.0 or 2.0, got {version}; save it again"
            )
        shape, by_columns, dtype = readers[version](stream, max_header_size=MOST_HEADER)
        if dtype.kind not in KINDS or dtype.subdtype is not None:
            raise InputError(f"{name}: expected an array of numbers, got {shown(str(dtype))}")
        size = math.prod(shape) * dtype.itemsize
        if min(shape, default=0) < 0 or size > member.file_size:
            raise InputError(
                f"{name}: the array's shape {shown(str(shape))} does not fit its data; save it "
                "again"
            )
        held = stream.read(size)
        if len(held) < size or stream.read(1):
            raise InputError(
                f"{name}: the array does not hold as many numbers as its shape {shape} needs"
            )
    return np.ndarray(shape, dtype, held, order="F" if by_columns else "C")

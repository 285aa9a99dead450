"""Reads and writes named arrays in npz files.

An archive may claim any size, or hold a name twice: that is checked before anything is read. Only
arrays of numbers and truth values are read, or also of texts where they are asked for, and nothing
in a file is executed.
"""

import io
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError, about
from grasp_core.files.json_text import shown
from grasp_core.files.text_files import read_bytes, write_parts

MOST_ARRAY_BYTES = 256 * 2**20
MOST_MEMBERS = 256
MOST_HEADER = 10_000
"""Largest number of characters in an array's header, a limit of numpy's."""
ARRAY_KINDS, TEXT_KIND = "biuf", "U"
"""Kinds of arrays that are read, truth values and numbers, and of those of texts."""
ZIP_MAGIC, MEMBER_ENDING = b"PK\x03\x04", ".npy"


def read_arrays(path: Path, names: Collection[str]) -> dict[str, NDArray[Any]]:
    """Read the named arrays of an npz file that exist; nothing in the file is executed."""
    data = read_bytes(path, MOST_ARRAY_BYTES)
    with about(path):
        return arrays_of(data, names)


def arrays_of(
    data: bytes, names: Collection[str], *, kinds: str = ARRAY_KINDS
) -> dict[str, NDArray[Any]]:
    """Read the named arrays that exist from the bytes of an npz file."""
    if not data.startswith(ZIP_MAGIC):
        raise InputError(
            "expected an npz file, which begins as a zip archive does; save it with numpy.savez"
        )
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = _checked(archive.infolist())
            return {
                name: _array(archive, members[name + MEMBER_ENDING], name, kinds)
                for name in names
                if name + MEMBER_ENDING in members
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
    if claimed > MOST_ARRAY_BYTES:
        raise InputError(
            f"the arrays of the npz file take {claimed} bytes, over the limit of "
            f"{MOST_ARRAY_BYTES}; save fewer numbers"
        )
    members = {each.filename: each for each in listed}
    if len(members) < len(listed):
        raise InputError("two arrays of the npz file have the same name; write the file again")
    return members


def _array(
    archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str, kinds: str
) -> NDArray[Any]:
    with archive.open(member) as stream:
        found: NDArray[Any] = np.lib.format.read_array(
            stream, allow_pickle=False, max_header_size=MOST_HEADER
        )
        if found.dtype.kind not in kinds or stream.read(1):
            raise InputError(
                f"{name}: expected an array of numbers with nothing behind them, got one of "
                f"{shown(str(found.dtype))}; save it again"
            )
    return found


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> Path:
    """Write named arrays as `numpy.load` reads them; equal arrays give equal files."""
    held = io.BytesIO()
    np.savez(held, allow_pickle=False, **arrays)
    return write_parts(path, [held.getvalue()])

"""Files in and out: whole or not at all."""

import io
import shutil
import tempfile
import zipfile
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from scenes.whole_files import write_parts

MAX_TEXT_BYTES = 256 * 2**20


def read_text(path: Path) -> str:
    """The text of a file.

    Raises:
        InputError: It cannot be read, is too large, or is not UTF-8.
    """
    try:
        if path.stat().st_size > MAX_TEXT_BYTES:
            raise InputError(f"{path}: larger than {MAX_TEXT_BYTES} bytes")
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text ({error.reason})") from error


def write_text(path: Path, text: str) -> Path:
    """Write a file by renaming a complete one into place; folders are made as needed."""
    return write_parts(path, [text.encode()])


def write_bytes(path: Path, data: bytes) -> Path:
    """As `write_text`."""
    return write_parts(path, [data])


def write_lines(path: Path, lines: Iterable[str]) -> Path:
    """As `write_text`, of lines that are not all in memory; each ends with its line break."""
    return write_parts(path, (line.encode() for line in lines))


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> Path:
    """Write arrays by name, compressed, as `numpy.load` reads them."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            member = zipfile.ZipInfo(
                f"{name}.npy"
            )  # of no date, so that equal arrays give equal files
            with archive.open(member, "w") as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)
    return write_parts(path, [held.getvalue()])


def read_arrays(path: Path, names: Iterable[str]) -> dict[str, NDArray[Any]]:
    """Arrays of an npz file, those that are there; nothing in it is run.

    Raises:
        InputError: It cannot be read, is too large, or holds Python objects.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > MAX_TEXT_BYTES:
            raise InputError(f"{path}: larger than {MAX_TEXT_BYTES} bytes")
        with np.load(path, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in names if name in arrays}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: cannot be read as npz ({error})") from error


@contextmanager
def whole_folder(folder: Path) -> Generator[Path]:
    """A place to write to, which becomes the folder when everything is written, and else goes.

    Raises:
        InputError: The folder is there and not empty.
    """
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise InputError(f"{folder}: is there, and no empty folder; give another --out")
    named = folder.resolve()
    named.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(dir=named.parent, prefix=".unfinished-"))
    try:
        yield temporary
        temporary.chmod(0o755)
        temporary.replace(named)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise

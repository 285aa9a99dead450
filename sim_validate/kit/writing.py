"""Writes files and folders so that they are complete or absent."""

import fcntl
import io
import os
import shutil
import tempfile
import zipfile
from collections.abc import Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError
from grasp_core.files.text_files import SHOWN, UNFINISHED, write_parts


def write_lines(path: Path, lines: Iterable[str]) -> Path:
    """Write lines as `write_text` does, one at a time; each ends with its own line break."""
    return write_parts(path, (line.encode() for line in lines))


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]]) -> Path:
    """Write named arrays, compressed, as `numpy.load` reads them."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            # A member made this way has a fixed date, so that equal arrays give equal files.
            member = zipfile.ZipInfo(f"{name}.npy")
            with archive.open(member, "w") as stream:
                np.lib.format.write_array(stream, array, allow_pickle=False)
    return write_parts(path, [held.getvalue()])


@contextmanager
def whole_folder(folder: Path) -> Generator[Path]:
    """Yield a temporary folder that becomes `folder` on success, and is removed on failure."""
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise InputError(f"{folder}: exists and is not an empty folder; give another --out")
    named = folder.resolve()
    named.parent.mkdir(parents=True, exist_ok=True)
    prefix = f".{named.name[:SHOWN]}{UNFINISHED}"
    for path in named.parent.iterdir():
        if path.name.startswith(prefix):
            with suppress(OSError), _locked(path) as abandoned:
                if abandoned:
                    shutil.rmtree(path)
    temporary = Path(tempfile.mkdtemp(dir=named.parent, prefix=prefix))
    try:
        with _locked(temporary):
            yield temporary
            temporary.chmod(0o755)
            temporary.replace(named)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


@contextmanager
def _locked(folder: Path) -> Generator[bool]:
    """Lock a folder until the end of the block, or of the process; yield whether that worked."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            locked = True
        except OSError:  # another process has locked it, or the file system has no locks
            locked = False
        yield locked
    finally:
        os.close(handle)

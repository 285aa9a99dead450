"""A folder for results, to which one command at a time writes.

The folder itself is locked, with no file for it: the lock ends with the process, however it ends.
"""

import errno
import fcntl
import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.whole_files import remove_unfinished
from sim_validate.files.stale_results import CHARTS, CLIPS, GRASPS, PICTURES, REPORT

PAGES = ("", GRASPS, PICTURES, CHARTS, CLIPS)
PARTS = ("scenes", "traces", "proofs", *PAGES, *(f"{REPORT}/{part}" for part in PAGES))
"""Where in their folder commands write."""


@contextmanager
def alone_in(folder: Path | None) -> Generator[None]:
    """Keep others out of a folder, made where needed, and free it of what killed ones left half.

    To be entered before work begins, so that a folder that takes no files is refused at once, and
    not after the work. Without a folder there is nothing to do.

    Raises:
        InputError: There cannot be such a folder, no file can be written there, or another command
            is at work in it.
    """
    if folder is None:
        yield
        return
    with _locked(folder) as made:
        for part in PARTS:
            remove_unfinished(folder / part)
        try:
            yield
        finally:
            with suppress(OSError):  # one holds something
                for path in made:
                    path.rmdir()


def _make(folder: Path) -> list[Path]:
    """Make the folder, see that files can be written there, and say which folders are new."""
    try:
        missing = [path for path in (folder, *folder.parents) if not path.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as stream:
            stream.write(b"0")
    except (FileExistsError, NotADirectoryError) as error:
        raise InputError(
            f"{error.filename}: is there, and no folder; give another --out"
        ) from error
    except OSError as error:
        raise InputError(
            f"{folder}: no file can be written there ({error.strerror}); give another --out"
        ) from error
    return missing


@contextmanager
def _locked(folder: Path) -> Generator[list[Path]]:
    """Make the folder and lock it; the folders that are new."""
    handle, made = _taken(folder)
    try:
        yield made
    finally:
        os.close(handle)


def _taken(folder: Path) -> tuple[int, list[Path]]:
    """An open, locked folder, which is the one of that name, and the folders that are new."""
    made = list[Path]()
    while True:
        made += _make(folder)
        try:
            handle = os.open(folder, os.O_RDONLY)
        except FileNotFoundError:  # who had made it has just taken it away
            continue
        try:
            _lock(handle, folder)
            if folder.exists() and os.path.samestat(os.fstat(handle), folder.stat()):
                return handle, made
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)


def _lock(handle: int, folder: Path) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno == errno.EWOULDBLOCK:
            raise InputError(
                f"{folder}: another command is at work in it; wait for it, or give another --out"
            ) from error
        # else the file system has no locks, and who shares it must know what they do

"""Locks a folder of results, so that only one command at a time writes to it.

The folder itself is locked, without a lock file: the lock ends with the process, however that ends.
"""

import errno
import fcntl
import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.text_files import remove_unfinished
from sim_validate.files.stale_results import CHARTS, CLIPS, GRASPS, PICTURES, REPORT

PAGES = ("", GRASPS, PICTURES, CHARTS, CLIPS)
PARTS = ("scenes", "traces", "proofs", *PAGES, *(f"{REPORT}/{part}" for part in PAGES))
"""Subfolders into which commands write."""


@contextmanager
def alone_in(folder: Path | None) -> Generator[None]:
    """Lock a folder, making it if needed, and remove unfinished files of interrupted commands.

    Enter this context before work begins, so that a folder that takes no files is refused at once,
    and not after the work. Without a folder it does nothing.
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
            with suppress(OSError):  # a folder that holds something stays
                for path in made:
                    path.rmdir()


def _make(folder: Path) -> list[Path]:
    """Make the folder, check that files can be written there, and list the new folders."""
    try:
        missing = [path for path in (folder, *folder.parents) if not path.exists()]
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as stream:
            stream.write(b"0")
    except (FileExistsError, NotADirectoryError) as error:
        raise InputError(
            f"{error.filename}: exists and is not a folder; give another --out"
        ) from error
    except OSError as error:
        raise InputError(
            f"{folder}: no file can be written there ({error.strerror}); give another --out"
        ) from error
    return missing


@contextmanager
def _locked(folder: Path) -> Generator[list[Path]]:
    """Make the folder and lock it; yield the folders that are new."""
    handle, made = _taken(folder)
    try:
        yield made
    finally:
        os.close(handle)


def _taken(folder: Path) -> tuple[int, list[Path]]:
    """Open and lock a folder, making it if needed, and list the folders that are new.

    The loop repeats if another command removes the folder between the two steps.
    """
    made = list[Path]()
    while True:
        made += _make(folder)
        try:
            handle = os.open(folder, os.O_RDONLY)
        except FileNotFoundError:  # the command that had made it has just removed it
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
                f"{folder}: another command is writing to it; wait, or give another --out"
            ) from error
        # otherwise the file system has no locks, and its users must take care

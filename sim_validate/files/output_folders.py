"""Writes into folders: one command at a time, and whole folders or none."""

import shutil
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.text_files import (
    SHOWN,
    UNFINISHED,
    remove_unfinished,
)
from sim_validate.files.locks import locked
from sim_validate.files.results_folder import PARTS

MADE = "made"
"""Name of a folder that is being filled, inside its temporary folder."""


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
            with suppress(OSError), locked(path) as ended:
                if ended:
                    shutil.rmtree(path / MADE, ignore_errors=True)
            with suppress(OSError):  # it holds something while its command is at work
                path.rmdir()
    temporary = Path(tempfile.mkdtemp(dir=named.parent, prefix=prefix))
    try:
        with locked(temporary) as alone:
            if alone is False:
                raise _taken(folder)
            made = temporary / MADE
            made.mkdir()
            yield made
            with suppress(FileNotFoundError):  # Windows renames onto nothing
                named.rmdir()
            made.rename(named)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _taken(folder: Path) -> InputError:
    return InputError(f"{folder}: another command is writing to it; wait, or give another --out")


@contextmanager
def alone_in(folder: Path | None) -> Generator[None]:
    """Lock a folder, making it if needed, and remove unfinished files of interrupted commands.

    Enter this context before work begins, so that a folder that takes no files is refused at once,
    and not after the work. Without a folder it does nothing.
    """
    if folder is None:
        yield
        return
    made = _make(folder)
    try:
        with locked(folder) as alone:
            if alone is False:
                raise _taken(folder)
            for part in PARTS:
                remove_unfinished(folder / part)
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

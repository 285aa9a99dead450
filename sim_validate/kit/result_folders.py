"""Keeps a folder of results whole: one command at a time writes to it, and removes old results.

The folder itself is locked, without a lock file: the lock ends with the process, however that ends.
Results that would contradict new ones are removed first, so that old and new results never mix,
whatever ends a command. Files of other names are left alone.
"""

import errno
import fcntl
import os
import re
import shutil
import tempfile
from collections.abc import Generator, Iterable
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path
from typing import Literal, TypeAlias

from grasp_core.errors import InputError
from grasp_core.files.text_files import UNFINISHED, remove_unfinished, write_text

REPORT, INDEX, GRASPS = "report", "index.html", "grasps"
STYLE = "style.css"
STATIC = (STYLE, "gallery.js", "tables.js", "turntable.js")
BEST = ("best.json", "best-proof.npz")
REACHES = "reaches.json"
JUDGEMENTS = "judgements.json"
Kind: TypeAlias = Literal["verdicts", "regions", "executions", "reaches", "judgements", "grasps"]
FILES: dict[Kind, tuple[str, ...]] = {
    "verdicts": ("verdicts.json",), "regions": ("regions.json",),
    "executions": ("executions.json",), "reaches": (REACHES,), "judgements": (JUDGEMENTS,),
    "grasps": ("transfer.json", "grasps.json", *BEST),
}  # fmt: skip
OF_EACH_GRASP: dict[Kind, tuple[str, str, bytes]] = {
    "verdicts": ("traces", ".npz", b".times_s.npy"),
    "regions": ("proofs", ".npz", b"object_sha256.npy"),
    "grasps": ("scenes", ".xml", b"`graspproof scene"),
}
"""Folder, ending and distinctive bytes of those files of which each grasp has one."""
PICTURES, CLIPS = "pictures", "clips"
MARK = ".graspproof-report"
MARKED = "The pages here were written by graspproof, which may replace them.\n"
ID = re.compile(r"[bcprf](-\d+){4}[\w-]*", re.ASCII)
"""Pattern of a grasp's id, as plans name grasps; people give other ids to contacts of their own."""
PAGES = ("", GRASPS, PICTURES, CLIPS)
PARTS = ("scenes", "traces", "proofs", *PAGES, *(f"{REPORT}/{part}" for part in PAGES))
"""Subfolders into which commands write."""


def remove_results(folder: Path, kind: Kind = "grasps") -> None:
    """Remove results of one kind, and pages that show them; grasps take all other kinds along."""
    remove_report(folder / REPORT)
    for each in FILES if kind == "grasps" else (kind,):
        _remove(folder / name for name in FILES[each])
        if each in OF_EACH_GRASP:
            part, suffix, mark = OF_EACH_GRASP[each]
            _remove([
                path for path in (folder / part).glob(f"*{suffix}")
                if ID.fullmatch(path.stem) or (path.is_file() and mark in path.read_bytes())
            ])  # fmt: skip


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        path.unlink(missing_ok=True)


def require_report_folder(folder: Path) -> None:
    """Refuse to write pages into a folder that is neither empty nor a report."""
    if folder.is_dir() and any(folder.iterdir()) and not (folder / MARK).is_file():
        raise InputError(
            f"{folder}: this folder holds other files than a report; give another --out"
        )


@contextmanager
def new_pages(folder: Path) -> Generator[Path]:
    """Yield the folder to write the pages of a report to.

    That is the report's own folder if it has no pages. Otherwise it is one inside it, whose files
    replace the old pages at the end, so that these stay if the new ones are not finished.
    """
    earlier = (folder / INDEX).is_file()
    if not earlier:
        remove_pages(folder)
    write_text(folder / MARK, MARKED)
    if not earlier:
        try:
            yield folder
        except BaseException:
            remove_report(folder)
            raise
        return
    aside = Path(tempfile.mkdtemp(dir=folder, prefix=f".{REPORT}{UNFINISHED}"))
    try:
        yield aside
        remove_pages(folder)
        files = [path for path in aside.rglob("*") if path.is_file()]
        for path in sorted(files, key=lambda each: each.name == INDEX):
            place = folder / path.relative_to(aside)
            place.parent.mkdir(exist_ok=True)
            path.replace(place)
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def remove_report(folder: Path) -> None:
    """Remove a report, if there is one, and nothing else; its mark is removed last."""
    if not (folder / MARK).is_file():
        return
    remove_pages(folder)
    if [path.name for path in folder.iterdir()] == [MARK]:
        (folder / MARK).unlink()
        folder.rmdir()


def remove_pages(folder: Path) -> None:
    """Remove the pages of a report, the first page first; its mark stays."""
    _remove(
        chain(
            (folder / name for name in (INDEX, *STATIC)),
            folder.glob("object-*.js"),
            folder.glob(f"{GRASPS}/*.html"),
            folder.glob(f"{PICTURES}/*.svg"),
            folder.glob(f"{CLIPS}/*.webp"),
        )
    )
    for kind in (GRASPS, PICTURES, CLIPS):
        part = folder / kind
        if part.is_dir() and not any(part.iterdir()):
            part.rmdir()


@contextmanager
def alone_in(folder: Path | None) -> Generator[None]:
    """Lock a folder, making it if needed, and remove unfinished files of interrupted commands.

    Enter this context before work begins, so that a folder that takes no files is refused at once,
    and not after the work. Without a folder it does nothing.
    """
    if folder is None:
        yield
        return
    handle, made = _taken(folder)
    try:
        for part in PARTS:
            remove_unfinished(folder / part)
        try:
            yield
        finally:
            with suppress(OSError):  # a folder that holds something stays
                for path in made:
                    path.rmdir()
    finally:
        os.close(handle)


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
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:  # a file system may have no locks: then its users take care
                if error.errno == errno.EWOULDBLOCK:
                    raise InputError(
                        f"{folder}: another command is writing to it; wait, or give another --out"
                    ) from error
            if folder.exists() and os.path.samestat(os.fstat(handle), folder.stat()):
                return handle, made
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)

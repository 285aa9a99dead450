"""Removes the results of earlier commands from a folder before new ones are written.

Results that would contradict new ones are removed first, so that old and new results never mix,
whatever ends a command. Files of other names are left alone.
"""

import re
import shutil
import tempfile
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from itertools import chain
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.text_files import UNFINISHED, write_text

REPORT, INDEX, GRASPS = "report", "index.html", "grasps"
STYLE = "style.css"
STATIC = (STYLE, "gallery.js", "tables.js", "turntable.js")
CHARTS_OF_INDEX = ("fidelity.svg", "survival.svg")
"""Files that reports of earlier versions have; the charts now stand in the pages."""
OF_GRASPS = ("transfer.json", "grasps.json")
BEST = ("best.json", "best-proof.npz")
REACHES = "reaches.json"
JUDGEMENTS = "judgements.json"
PICTURES, CHARTS, CLIPS = "pictures", "charts", "clips"
MARK = ".graspproof-report"
MARKED = "The pages here were written by graspproof, which may replace them.\n"
ID = re.compile(r"[bcprf](-\d+){4}[\w-]*", re.ASCII)
"""Pattern of a grasp's id, as plans name grasps; people give other ids to contacts of their own."""


def remove_results(folder: Path) -> None:
    """Remove grasps and all results about them."""
    remove_verdicts(folder)
    remove_regions(folder)
    remove_executions(folder)
    remove_reaches(folder)
    remove_judgements(folder)
    _remove(
        [
            *_of_grasps(folder / "scenes", ".xml", b"`graspproof scene "),
            *(folder / name for name in (*OF_GRASPS, *BEST)),
        ]
    )


def remove_verdicts(folder: Path) -> None:
    """Remove verdicts, their traces, and pages that show them."""
    remove_report(folder / REPORT)
    _remove([folder / "verdicts.json", *_of_grasps(folder / "traces", ".npz", b".times_s.npy")])


def remove_regions(folder: Path) -> None:
    """Remove certified regions, their proofs, and pages that show them."""
    remove_report(folder / REPORT)
    _remove([folder / "regions.json", *_of_grasps(folder / "proofs", ".npz", b"object_sha256.npy")])


def remove_executions(folder: Path) -> None:
    """Remove the results of executed grasps, and pages that show them."""
    remove_report(folder / REPORT)
    _remove([folder / "executions.json"])


def remove_reaches(folder: Path) -> None:
    """Remove the poses of a hand in grasps, and pages that show them."""
    remove_report(folder / REPORT)
    _remove([folder / REACHES])


def remove_judgements(folder: Path) -> None:
    """Remove what published tests say of grasps, and pages that show it."""
    remove_report(folder / REPORT)
    _remove([folder / JUDGEMENTS])


def _of_grasps(folder: Path, suffix: str, mark: bytes) -> list[Path]:
    """List the files in a folder that are about grasps."""
    return [
        path for path in folder.glob(f"*{suffix}")
        if ID.fullmatch(path.stem) or (path.is_file() and mark in path.read_bytes())
    ]  # fmt: skip


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
            (folder / name for name in (INDEX, *CHARTS_OF_INDEX, *STATIC)),
            folder.glob("object-*.js"),
            folder.glob(f"{GRASPS}/*.html"),
            folder.glob(f"{PICTURES}/*.svg"),
            *(folder.glob(f"{kind}/*.webp") for kind in (PICTURES, CHARTS, CLIPS)),
        )
    )
    for kind in (GRASPS, PICTURES, CHARTS, CLIPS):
        _remove_if_empty(folder / kind)


def _remove_if_empty(folder: Path) -> None:
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()

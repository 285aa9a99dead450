"""Removes the results of earlier commands from a folder before new ones are written.

Results that would contradict new ones are removed first, so that old and new results never mix,
whatever ends a command. Files of other names are left alone.
"""

import re
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

from grasp_core.errors import InputError

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
ID = re.compile(r"[bcprf](-\d+){4}[\w-]*", re.ASCII)
"""Pattern of a grasp's id, as plans name grasps."""


def remove_results(folder: Path) -> None:
    """Remove grasps and all results about them."""
    remove_verdicts(folder)
    remove_regions(folder)
    remove_executions(folder)
    remove_reaches(folder)
    remove_judgements(folder)
    _remove(
        [*_of_grasps(folder / "scenes", ".xml"), *(folder / name for name in (*OF_GRASPS, *BEST))]
    )


def remove_verdicts(folder: Path) -> None:
    """Remove verdicts, their traces, and pages that show them."""
    remove_report(folder / REPORT)
    _remove([folder / "verdicts.json", *_of_grasps(folder / "traces", ".npz")])


def remove_regions(folder: Path) -> None:
    """Remove certified regions, their proofs, and pages that show them."""
    remove_report(folder / REPORT)
    _remove([folder / "regions.json", *_of_grasps(folder / "proofs", ".npz")])


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


def _of_grasps(folder: Path, suffix: str) -> list[Path]:
    """List the files in a folder that are named after grasps."""
    return [path for path in folder.glob(f"*{suffix}") if ID.fullmatch(path.stem)]


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        path.unlink(missing_ok=True)


def require_report_folder(folder: Path) -> None:
    """Refuse to write pages into a folder that is neither empty nor a report.

    Raises:
        InputError: The folder holds other files.
    """
    if folder.is_dir() and any(folder.iterdir()) and not (folder / MARK).is_file():
        raise InputError(
            f"{folder}: this folder holds other files than a report; give another --out"
        )


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

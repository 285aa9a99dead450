"""What earlier commands have told in a folder, removed before others tell it anew.

What contradicts new results goes before they come, so that whatever ends a command, a folder holds
no mixture; files of other names are left alone.
"""

from collections.abc import Iterable
from itertools import chain
from pathlib import Path

from grasp_core.errors import InputError

REPORT, INDEX, GRASPS = "report", "index.html", "grasps"
STATIC = ("style.css", "gallery.js", "turntable.js")
FIDELITY = "fidelity.svg"
PICTURES, CHARTS, CLIPS = "pictures", "charts", "clips"
MARK = ".graspproof-report"
ID = "*[cprf]-*-*-*-*"
"""Of a grasp."""


def remove_results(folder: Path) -> None:
    """Remove grasps and all that was told of them."""
    remove_verdicts(folder)
    remove_regions(folder)
    _remove([*folder.glob(f"scenes/{ID}.xml"), folder / "grasps.json"])


def remove_verdicts(folder: Path) -> None:
    """Remove verdicts, their traces, and pages that show them."""
    remove_report(folder / REPORT)
    _remove([folder / "verdicts.json", *folder.glob(f"traces/{ID}.npz")])


def remove_regions(folder: Path) -> None:
    """Remove certified regions, their proofs, and pages that show them."""
    remove_report(folder / REPORT)
    _remove([folder / "regions.json", *folder.glob(f"proofs/{ID}.npz")])


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        path.unlink(missing_ok=True)


def require_report_folder(folder: Path) -> None:
    """That pages may be written into a folder: there is nothing in it, or a report.

    Raises:
        InputError: It holds other things.
    """
    if folder.is_dir() and any(folder.iterdir()) and not (folder / MARK).is_file():
        raise InputError(f"{folder}: is there, and holds no report; give another --out")


def remove_report(folder: Path) -> None:
    """Remove a report, if there is one, and nothing else; its mark last."""
    if not (folder / MARK).is_file():
        return
    remove_pages(folder)
    if [path.name for path in folder.iterdir()] == [MARK]:
        (folder / MARK).unlink()
        folder.rmdir()


def remove_pages(folder: Path) -> None:
    """Remove the pages of a report, the first one first; its mark stays."""
    _remove(
        chain(
            (folder / name for name in (INDEX, FIDELITY, *STATIC)),
            folder.glob("object-*.js"),
            folder.glob(f"{GRASPS}/*.html"),
            *(folder.glob(f"{kind}/*.webp") for kind in (PICTURES, CHARTS, CLIPS)),
        )
    )
    for kind in (GRASPS, PICTURES, CHARTS, CLIPS):
        _remove_if_empty(folder / kind)


def _remove_if_empty(folder: Path) -> None:
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()

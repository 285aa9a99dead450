"""Names of what is in a folder of results, and how old results are removed.

Results that would contradict new ones are removed first, so that old and new results never mix,
whatever ends a command. Files of other names are left alone.
"""

import re
import shutil
import tempfile
from collections.abc import Generator, Iterable
from contextlib import contextmanager, suppress
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.file_kinds import BESIDE, GRASPS, REACHES, REGIONS, VERDICTS
from grasp_core.files.text_files import UNFINISHED, write_text
from sim_validate.files.locks import entries

REPORT, INDEX, GRASP_PAGES = "report", "index.html", "grasps"
STYLE = "style.css"
STATIC = (STYLE, "gallery.js", "tables.js", "turntable.js")
BEST_PROOF = "best-proof.npz"
NEAREST_PICTURE = "nearest-pose.svg"  # of a hand that does not stand in a grasp
OF_EACH_GRASP: dict[str, tuple[str, str, bytes]] = {
    VERDICTS: ("traces", ".npz", b".times_s.npy"),
    REGIONS: ("proofs", ".npz", b"object_sha256.npy"),
    GRASPS: ("scenes", ".xml", b"`graspproof scene"),
}
"""Folder, ending and distinctive bytes of those files of which each grasp has one, by the file of
results that they belong to."""
PICTURE_FOLDER, CLIP_FOLDER = "pictures", "clips"
REPORT_MARK = ".graspproof-report"
MARKED = "The pages here were written by graspproof, which may replace them.\n"
PLANNED_ID = re.compile(r"[bcprf](-\d+){4}[\w-]*", re.ASCII)
"""Pattern of a grasp's id, as plans name grasps; people give other ids to contacts of their own."""
OF_REPORT = (
    INDEX, *STATIC, "object-*.js", f"{GRASP_PAGES}/*.html", f"{PICTURE_FOLDER}/*.svg",
    f"{CLIP_FOLDER}/*.webp",
)  # fmt: skip
PAGE_FOLDERS = ("", GRASP_PAGES, PICTURE_FOLDER, CLIP_FOLDER)
RESULT_FOLDERS = (
    "scenes",
    "traces",
    "proofs",
    *PAGE_FOLDERS,
    *(f"{REPORT}/{part}" for part in PAGE_FOLDERS),
)


def remove_results(folder: Path, file: str = GRASPS) -> None:
    """Remove a file of results, and pages that show them; a grasps.json takes all others along."""
    remove_report(folder / REPORT)
    for each in (*BESIDE, GRASPS) if file == GRASPS else (file,):
        _remove([folder / each])
        if each in OF_EACH_GRASP:
            part, suffix, mark = OF_EACH_GRASP[each]
            _remove([
                path for path in (folder / part).glob(f"*{suffix}")
                if PLANNED_ID.fullmatch(path.stem) or (path.is_file() and mark in path.read_bytes())
            ])  # fmt: skip
    if file == GRASPS:
        _remove([folder / BEST_PROOF])
    if file in (GRASPS, REACHES):
        _remove([folder / NEAREST_PICTURE])


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        path.unlink(missing_ok=True)


def require_report_folder(folder: Path) -> None:
    """Refuse to write pages into a folder that is neither empty nor a report."""
    if folder.is_dir() and entries(folder) and not (folder / REPORT_MARK).is_file():
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
    write_text(folder / REPORT_MARK, MARKED)
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
    if not (folder / REPORT_MARK).is_file():
        return
    remove_pages(folder)
    if entries(folder) == [folder / REPORT_MARK]:
        (folder / REPORT_MARK).unlink()
        with suppress(OSError):  # a command is at work in it
            folder.rmdir()


def remove_pages(folder: Path) -> None:
    """Remove the pages of a report, the first page first; its mark stays."""
    for pattern in OF_REPORT:
        _remove(folder.glob(pattern))
    for kind in (GRASP_PAGES, PICTURE_FOLDER, CLIP_FOLDER):
        part = folder / kind
        if part.is_dir() and not any(part.iterdir()):
            part.rmdir()

"""Turns the folder of a run into a folder of pages that open from disk and need no network."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TypeAlias

from grasp_core.checked import function, path_of, whole
from grasp_core.files.text_files import write_text
from scenes.drawing.pages import as_text, object_data
from sim_validate.kit.files import (
    GRASPS,
    INDEX,
    REPORT,
    STATIC,
    STYLE,
    new_pages,
    require_report_folder,
)  # fmt: skip
from sim_validate.kit.processes import available_cores, each
from sim_validate.report.drawn_grasps import Drawn, Task, draw, tasks_of
from sim_validate.report.pages import (
    MIRRORED,
    ROTATED,
    Copy,
    Shown,
    asset,
    cards_of,
    grasp_page,
    index_page,
    style,
)
from sim_validate.report.run_folder import RunFolder, folder_of, runs_in

FIRST = 4
"""Number of cards that are drawn before the first page is written for the first time; it is written
again whenever twice as many are drawn, and at the end."""

Runs: TypeAlias = tuple[RunFolder, ...]


def _nothing(*_: object) -> None:
    """Take note of nothing."""


@dataclass(frozen=True, slots=True)
class Report:
    """The paths of a written report."""

    index: Path
    grasps: int
    no_clip: str
    """Reason why clips that were asked for are missing; empty if none is missing."""
    drawn: int


def write_report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    jobs: int | None = None,
    limit: int | None = None,
    clips: int = 0,
    progress: Callable[[int, int], object] = _nothing,
    ready: Callable[[Path, int, int], object] = _nothing,
) -> Report:
    """Write the results of a run as pages for a browser.

    Every grasp gets a page. Grasps that a symmetry of the object makes from one another share a
    card of the first page and one set of pictures, if their tests ended alike.

    Args:
        folder: Folder of a run, with its grasps.json; or a folder of such folders.
        out: Folder to write to; `report` in the folder if None.
        jobs: Largest number of processes; all cores if None.
        limit: Number of grasps to draw per run, those with problems before others; all if None.
        clips: Number of grasps per run of which trials are filmed, those with problems first, where
            there are graphics.
        progress: Called with (drawn, total) after each card.
        ready: Called with (first page, drawn, total) when the first page can be opened while more
            cards are drawn; not where an earlier report stays until the new one is complete.

    Returns:
        The paths of the report, and why clips are missing.

    Raises:
        InputError: The folder holds no run, a file in it is invalid, or the folder for the pages
            holds other files.
    """
    folder = folder_of(path_of(folder, "folder"))
    out = folder / REPORT if out is None else path_of(out, "out")
    for name, value in (("jobs", jobs), ("limit", limit)):
        if value is not None:
            whole(value, name, least=1)
    whole(clips, "clips")
    function(progress, "progress")
    function(ready, "ready")
    runs = tuple(run.first(limit) for run in runs_in(folder))
    require_report_folder(out)
    with new_pages(out) as place:
        cards = list(_cards(runs, place, clips))
        ready = ready if place == out else _nothing
        report = _written(cards, runs, place, jobs or available_cores(), progress, ready)
    return replace(report, index=out / INDEX)


@dataclass(frozen=True, slots=True)
class _Card:
    run: RunFolder
    script: str
    """Name of the script with the object's drawing."""
    task: Task
    copies: tuple[Copy, ...]

    @property
    def page(self) -> str:
        """Path of the page of the card's grasp, relative to the report's folder."""
        return f"{GRASPS}/{self.task.name}.html"


def _written(
    cards: Sequence[_Card], runs: Runs, out: Path, jobs: int,
    progress: Callable[[int, int], object], ready: Callable[[Path, int, int], object],
) -> Report:  # fmt: skip
    for name in STATIC:
        write_text(out / name, style() if name == STYLE else asset(name))
    for number, run in enumerate(runs):
        data = as_text(object_data(run.saved.body))
        write_text(out / f"object-{number}.js", f"window.graspproofObject = {data};\n")
    tasks = [card.task for card in cards]
    names = [None, *(f"{task.name}.html" for task in tasks), None]
    shown = list[Shown]()
    no_clip, next_index = "", min(FIRST, len(cards))
    results = chain(each(draw, tasks[:FIRST], jobs=1), each(draw, tasks[FIRST:], jobs=jobs))
    for card, drawn in zip(cards, results, strict=True):
        around = names[len(shown)], names[len(shown) + 2]
        shown.append(_pages_of(card, drawn, out, around))
        no_clip = no_clip or drawn.no_clip
        if len(shown) == next_index:
            waiting = len(cards) - len(shown)
            index = write_text(out / INDEX, index_page(runs, shown, waiting))
            if next_index == FIRST and waiting:
                ready(index, len(shown), len(cards))
            next_index = min(2 * next_index, len(cards))
        progress(len(shown), len(cards))
    grasps = sum(1 + len(card.copies) for card in cards)
    return Report(out / INDEX, grasps, no_clip, len(cards))


def _cards(runs: Runs, out: Path, clips: int) -> Iterator[_Card]:
    for number, run in enumerate(runs):
        prefix = f"{number}-" if len(runs) > 1 else ""
        grasps = run.saved.grasps
        classes = cards_of(run)
        firsts = [grasps[each.first] for each in classes]
        for found, task in zip(classes, tasks_of(run, firsts, out, prefix, clips), strict=True):
            copies = tuple(
                Copy(grasps[place].id, f"{GRASPS}/{prefix}{grasps[place].id}.html",
                     MIRRORED if place in found.mirrored else ROTATED)
                for place in found.places if place != found.first
            )  # fmt: skip
            yield _Card(run, f"object-{number}.js", task, copies)


def _pages_of(card: _Card, drawn: Drawn, out: Path, around: tuple[str | None, str | None]) -> Shown:
    """Write the page of a card's grasp, and those of its copies, which have no pictures."""
    grasps = {grasp.id: grasp for grasp in card.run.saved.grasps}
    first = grasps[card.task.saved.grasps[0].id]
    text = grasp_page(card.run, first, card.script, drawn, neighbours=around, copies=card.copies)
    write_text(out / card.page, text)
    for copy in card.copies:
        drawn_one = Copy(first.id, card.page, copy.kind)
        text = grasp_page(card.run, grasps[copy.id], card.script, first=drawn_one)
        write_text(out / copy.page, text)
    return Shown(card.run, first, card.page, drawn.hand or drawn.picture, card.copies)

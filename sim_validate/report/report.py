"""Turns the folder of a run into a folder of pages that open from disk and need no network."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TypeAlias

from grasp_core.files.text_files import write_text
from grasp_core.kinds import Count, Number, function, path_of, value_of
from scenes.drawing.pages import as_text, object_data
from sim_validate.kit import files
from sim_validate.kit.processes import available_cores, each
from sim_validate.report import pages
from sim_validate.report.cards import Card, cards_to_draw, draw
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
    out = folder / files.REPORT if out is None else path_of(out, "out")
    for name, value in (("jobs", jobs), ("limit", limit)):
        if value is not None:
            value_of(Count, value, name)
    value_of(Number, clips, "clips")
    function(progress, "progress")
    function(ready, "ready")
    runs = tuple(run.first(limit) for run in runs_in(folder))
    files.require_report_folder(out)
    with files.new_pages(out) as place:
        cards = list(_cards(runs, clips))
        ready = ready if place == out else _nothing
        report = _written(cards, runs, place, jobs or available_cores(), progress, ready)
    return replace(report, index=out / files.INDEX)


def _cards(runs: Runs, clips: int) -> Iterator[Card]:
    for number, run in enumerate(runs):
        prefix = f"{number}-" if len(runs) > 1 else ""
        yield from cards_to_draw(run, f"object-{number}.js", prefix, clips)


def _written(
    cards: Sequence[Card], runs: Runs, out: Path, jobs: int,
    progress: Callable[[int, int], object], ready: Callable[[Path, int, int], object],
) -> Report:  # fmt: skip
    for name in files.STATIC:
        write_text(out / name, pages.style() if name == files.STYLE else pages.asset(name))
    for number, run in enumerate(runs):
        data = as_text(object_data(run.saved.body))
        write_text(out / f"object-{number}.js", f"window.graspproofObject = {data};\n")
    tasks = [replace(card, copies=()) for card in cards]
    names = [None, *(f"{card.name}.html" for card in cards), None]
    shown = list[Card]()
    no_clip, next_index = "", min(FIRST, len(cards))
    drawing = partial(draw, out)
    results = chain(each(drawing, tasks[:FIRST], jobs=1), each(drawing, tasks[FIRST:], jobs=jobs))
    for card, drawn in zip(cards, results, strict=True):
        around = names[len(shown)], names[len(shown) + 2]
        shown.append(replace(card, drawn=drawn))
        write_text(out / card.page, pages.grasp_page(card.found, shown[-1], around))
        for copy in card.copies:
            write_text(out / copy.page, pages.grasp_page(copy.found, card, copy=copy))
        no_clip = no_clip or drawn.no_clip
        if len(shown) == next_index:
            waiting = len(cards) - len(shown)
            index = write_text(out / files.INDEX, pages.index_page(runs, shown, waiting))
            if next_index == FIRST and waiting:
                ready(index, len(shown), len(cards))
            next_index = min(2 * next_index, len(cards))
        progress(len(shown), len(cards))
    grasps = sum(1 + len(card.copies) for card in shown)
    return Report(out / files.INDEX, grasps, no_clip, len(cards))

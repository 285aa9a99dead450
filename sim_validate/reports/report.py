"""Turns the folder of a run into a folder of pages that open from disk and need no network."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from grasp_core.checked import function, path_of, whole
from scenes.drawing.canvas import write_figure
from sim_validate.files.reading import write_text
from sim_validate.files.stale_results import (
    FIDELITY,
    GRASPS,
    INDEX,
    MARK,
    REPORT,
    STATIC,
    SURVIVAL,
    remove_pages,
    remove_report,
    require_report_folder,
)  # fmt: skip
from sim_validate.parallel.processes import available_cores, each
from sim_validate.reports.drawn_grasps import Drawn, draw, tasks_of
from sim_validate.reports.fidelity_charts import fidelity_figure
from sim_validate.reports.grasp_page import Neighbours, grasp_page
from sim_validate.reports.index_page import (
    Shown,
    agreements,
    all_executions,
    all_verdicts,
    index_page,
)
from sim_validate.reports.pages import asset
from sim_validate.reports.run_folder import RunFolder, folder_of, runs_in
from sim_validate.reports.survival_charts import survival_figure
from sim_validate.reports.turntable import as_text, object_data

MARKED = "The pages here were written by graspproof, which may replace them.\n"


@dataclass(frozen=True, slots=True)
class Report:
    """The paths of a written report."""

    index: Path
    """Path of the report's first page."""
    grasps: int
    no_clip: str
    """Reason why clips that were asked for are missing; empty if none is missing."""


def write_report(
    folder: str | Path,
    out: str | Path | None = None,
    *,
    jobs: int | None = None,
    limit: int | None = None,
    clips: int = 0,
    progress: Callable[[int, int], None] = lambda _done, _total: None,
) -> Report:
    """Write the results of a run as pages for a browser.

    Args:
        folder: Folder of a run, with its grasps.json; or a folder of such folders.
        out: Folder to write to; `report` in the folder if None.
        jobs: Largest number of processes; all cores if None.
        limit: Number of grasps to draw per run, those with problems before others; all if None.
        clips: Number of grasps per run of which trials are filmed, those with problems first, where
            there are graphics.
        progress: Called with (drawn, total) after each grasp.

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
    runs = tuple(run.first(limit) for run in runs_in(folder))
    require_report_folder(out)
    remove_pages(out)
    write_text(out / MARK, MARKED)
    try:
        return _written(runs, out, jobs or available_cores(), clips, progress)
    except BaseException:
        remove_report(out)
        raise


def _written(
    runs: tuple[RunFolder, ...], out: Path, jobs: int, clips: int,
    progress: Callable[[int, int], None],
) -> Report:  # fmt: skip
    prefixes = [f"{place}-" if len(runs) > 1 else "" for place in range(len(runs))]
    tasks = [
        task for run, prefix in zip(runs, prefixes, strict=True)
        for task in tasks_of(run, out, prefix, clips)
    ]  # fmt: skip
    drawn = list[Drawn]()
    for found in each(draw, tasks, jobs=jobs):
        drawn.append(found)
        progress(len(drawn), len(tasks))
    pages = [f"{task.name}.html" for task in tasks]
    shown = list(_grasp_pages(runs, out, drawn, pages))
    for name in STATIC:
        write_text(out / name, asset(name))
    if verdicts := all_verdicts(runs):
        write_figure(fidelity_figure(agreements(verdicts)), out / FIDELITY)
    if executions := all_executions(runs):
        write_figure(survival_figure(executions), out / SURVIVAL)
    index = write_text(out / INDEX, index_page(runs, shown))
    return Report(index, len(tasks), next((each.no_clip for each in drawn if each.no_clip), ""))


def _grasp_pages(
    runs: tuple[RunFolder, ...], out: Path, drawn: list[Drawn], pages: list[str]
) -> Iterator[Shown]:
    """Write a page for each grasp, and a script with the drawing of each object."""
    place = 0
    for number, run in enumerate(runs):
        script = f"object-{number}.js"
        data = as_text(object_data(run.saved.body))
        write_text(out / script, f"window.graspproofObject = {data};\n")
        for grasp in run.saved.grasps:
            around = Neighbours(
                pages[place - 1] if place else None,
                pages[place + 1] if place + 1 < len(pages) else None,
            )
            text = grasp_page(run, grasp, drawn[place], script, around)
            path = write_text(out / GRASPS / pages[place], text)
            yield Shown(run, grasp, f"{GRASPS}/{path.name}", drawn[place].picture)
            place += 1

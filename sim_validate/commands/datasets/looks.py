"""Runs the commands that count what a dataset holds, show its rows, and draw depths."""

import math
from pathlib import Path

from grasp_core.by_value import counted
from grasp_core.errors import InputError
from scenes.drawing.depth.cameras import Lens
from sim_validate.cli import dataset_flags
from sim_validate.cli.console import Reporter
from sim_validate.cli.exit_codes import Exit
from sim_validate.datasets.describing.stats import Stats, stats_of
from sim_validate.datasets.exports.depths import AskedDepths, write_depths
from sim_validate.datasets.open_dataset import Selection, select
from sim_validate.reports.datasets.sample_page import write_sample
from sim_validate.reports.datasets.stats_page import write_stats


def count_dataset(command: dataset_flags.Stats, reporter: Reporter) -> int:
    """Count what a dataset holds, and write a page about it if asked to."""
    chosen = select(command.dataset, command.split)
    if command.out is not None:
        refuse_own(command.out, command.dataset)
    stats = stats_of(chosen)
    for line in _lines(stats):
        reporter.say(line)
    if command.out is not None:
        _say_page(write_stats(command.out, chosen.config().title, stats), reporter)
    reporter.document(stats.to_json())
    return Exit.GOOD


def write_page(folder: Path, chosen: Selection, reporter: Reporter) -> None:
    """Write a page about what a dataset holds, and say where it is."""
    _say_page(write_stats(folder, chosen.config().title, stats_of(chosen)), reporter)


def _say_page(page: Path, reporter: Reporter) -> None:
    reporter.say(f"open {page} in a browser to see how the rows spread")


def sample_dataset(command: dataset_flags.SampleRows, reporter: Reporter) -> int:
    """Write a page with some rows of a dataset and their pictures."""
    chosen = select(command.dataset, command.split)
    refuse_own(command.out, command.dataset)
    title = chosen.config().title
    count = write_sample(command.out, chosen, title, command.count, command.seed)
    reporter.say(f"{command.out}: {count} rows")
    reporter.document({"out": str(command.out), "rows": count})
    return Exit.GOOD


def draw_depths(command: dataset_flags.Depth, reporter: Reporter) -> int:
    """Draw depth images of the objects of a dataset."""
    chosen = select(command.dataset, command.split)
    refuse_own(command.out, command.dataset)
    lens = Lens(command.width, command.height, math.radians(command.field_deg))
    asked = AskedDepths(command.views, command.on_table, command.seed, lens)
    with reporter.progress("drawing") as steps:
        count = write_depths(command.out, chosen, asked, steps.update)
    reporter.say(
        f"{command.out}: {counted(count, 'object')} with {counted(command.views, 'image')} each"
    )
    reporter.document({"out": str(command.out), "objects": count, "views": command.views})
    return Exit.GOOD


def _lines(stats: Stats) -> list[str]:
    lines = [", ".join(f"{count} {name}" for name, count in stats.rows.items())]
    for name, counts in stats.counts.items():
        total = sum(counts.values())
        each = sorted(counts.items(), key=lambda pair: (-pair[1], pair[0]))
        shares = ", ".join(f"{word} {count} ({count / total:.0%})" for word, count in each)
        lines.append(f"{name}: {shares}")
    for kind, counts in stats.survival.items():
        outcomes = ", ".join(f"{count} {outcome}" for outcome, count in sorted(counts.items()))
        lines.append(f"{kind}: {outcomes}")
    return lines


def refuse_own(out: Path, dataset: Path) -> None:
    """Refuse to write into the dataset, which would then have a file that is not its own."""
    if out.resolve().is_relative_to(dataset.resolve()):
        raise InputError(f"{out}: this folder is in the dataset {dataset}; give another --out")

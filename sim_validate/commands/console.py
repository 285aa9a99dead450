"""Writes console output: results on standard output, everything else on standard error.

It also collects what long work gives, so that an interrupt loses nothing that is done.
"""

import importlib
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event, Thread
from typing import Any, TypeVar

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from grasp_core.figures import table
from grasp_core.files.json_text import text_of
from grasp_core.files.records import RecordFile
from grasp_core.files.text_files import write_text
from grasp_core.stopping import never, until
from sim_validate.processes.interrupts import check_interrupted

Result = TypeVar("Result")
File = TypeVar("File", bound=RecordFile)
PLAIN_EVERY_S = 5.0
"""Time between two lines of progress if the output is no terminal [s]."""
RECENT = 7
"""Number of lines of progress over which the rate is taken: half a minute, as that of bars."""
EARLIEST, ENOUGH = 0.02, 20
"""Share of the work, or number of steps, that must be done before the remaining time is estimated.
"""
UNITS = ((172_800.0, 86_400.0, "days"), (7200.0, 3600.0, "h"), (120.0, 60.0, "min"))
"""Times from which on a longer unit is used, the unit [s], and its name."""


def printable(text: str) -> str:
    """Replace control characters, so that a file's name cannot steer the terminal."""
    return "".join(c if c.isprintable() else "?" for c in text)


def duration(seconds: float) -> str:
    """Write a time in the unit that people would use for it."""
    for least, unit, name in UNITS:
        if seconds >= least:
            return f"{seconds / unit:.1f} {name}"
    return f"{seconds:.0f} s"


GAP, MARGIN = 2, 1
"""Widths of the space behind a column of a table, and before the first one, in characters."""
TABLE_ROWS = 20
"""Largest number of rows shown in a table; files and JSON documents have all of them."""


@dataclass(slots=True)
class Reporter:
    """Writes a command's output; with `json_only`, standard output gets only one JSON document."""

    quiet: bool = False
    verbose: bool = False
    json_only: bool = False
    out: Console = field(default_factory=lambda: Console(highlight=False))
    err: Console = field(default_factory=lambda: Console(stderr=True, highlight=False))

    def say(self, text: str) -> None:
        """Print a line of results: on standard output or, with --json, on standard error."""
        if not self.quiet:
            console = self.err if self.json_only else self.out
            console.print(Text(printable(text)), soft_wrap=True)

    def detail(self, text: str) -> None:
        """Print a line only with --verbose."""
        if self.verbose:
            self.err.print(Text(printable(text)), soft_wrap=True)

    def warn(self, text: str) -> None:
        """Print a line on standard error, even when quiet."""
        self.err.print(Text(printable(text)), soft_wrap=True)

    def document(self, value: Mapping[str, object]) -> None:
        """Print the one JSON document of a command run with --json."""
        if self.json_only:
            self.text(text_of(value))

    def text(self, text: str) -> None:
        """Print the text of the one JSON document of a command run with --json."""
        if self.json_only:
            print(text, end="")  # noqa: T201 - the document itself; a closed stream takes nothing

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Print a table on the same stream as lines of results.

        A table that would have to break words or numbers is divided: the columns that do not fit
        follow below, again beside the first one.
        """
        if self.quiet:
            return
        console = self.err if self.json_only else self.out
        for part in _parts(columns, rows, console.width):
            table = Table(
                title=Text(printable(title)),
                title_justify="left",
                box=SIMPLE_HEAD,
                padding=(0, 1, 0, 0),
            )
            for place in part:
                side = "left" if place == part[0] else "right"
                last = place == part[-1]
                table.add_column(columns[place], justify=side, overflow="fold", no_wrap=not last)
            for row in rows:
                table.add_row(*(Text(printable(row[place])) for place in part))
            console.print(table)

    def records(self, title: str, records: Sequence[object]) -> None:
        """Print the figures of records of one class as a table."""
        if records:
            self.table(title, *table(records[:TABLE_ROWS], type(records[0])))
            say_cut(len(records), self)

    def counted(
        self, title: str, results: Iterable[Result], total: int, word: str,
        is_good: Callable[[Result], bool], stop: Callable[[], bool] = never,
    ) -> Iterator[Result]:  # fmt: skip
        """Yield results, and show how many of all have come and how many of them are good.

        When told to stop, those that have not come are left out.
        """
        good = 0
        with self.progress(title) as steps:
            for done, result in enumerate(until(stop, results), 1):
                good += is_good(result)
                yield result
                steps.update(done, total, f"({good} {word})")

    def collected(
        self, title: str, results: Iterable[Result], total: int,
        good: tuple[str, Callable[[Result], bool]], collect: Callable[..., File],
        folder: Path | None = None, stop: Callable[[], bool] = never,
    ) -> File:  # fmt: skip
        """Collect results in the record of a file, and write it even if the work ends early.

        Shows how many of all have come, and how many of them are good, with the word for that.
        Without a result nothing is written.
        """
        done = list[Result]()
        try:
            for result in self.counted(title, results, total, *good, stop):
                done.append(result)
        finally:
            complete = len(done) == total
            found = collect(tuple(done), complete=complete)
            if folder and done:
                path = write_text(folder / found.FILE, found.text())
                self.say(f"wrote {path}" if complete else f"wrote what is done to {path}")
        return found

    def progress(self, title: str) -> "Steps":
        """Show progress of long work: a bar on a terminal, plain lines elsewhere."""
        return Steps(title, self.err, shown=not self.quiet)


def _parts(
    columns: Sequence[str], rows: Sequence[Sequence[str]], width: int
) -> list[list[int]]:  # fmt: skip
    """Divide the columns of a table, by their places, into parts that fit; each has the first one.

    The last column may break its lines between words, so it needs as much as its longest word.
    """
    texts = [[name, *(row[place] for row in rows)] for place, name in enumerate(columns)]
    needed = [max(map(len, each)) + GAP for each in texts]
    needed[-1] = max(len(word) for text in texts[-1] for word in text.split() or [""]) + GAP
    parts = [[0]]
    for place in range(1, len(columns)):
        used = sum(needed[each] for each in parts[-1])
        if len(parts[-1]) > 1 and MARGIN + used + needed[place] > width:
            parts.append([0])
        parts[-1].append(place)
    return parts


class Steps:
    """Shows the progress of long work in a `with` block, also while no step ends."""

    def __init__(self, title: str, console: Console, *, shown: bool) -> None:
        self.title: str = title
        self.console, self.shown = console, shown
        self.bar: Any = None
        self.task: Any = None
        self._begun = time.monotonic()
        self._done, self._note = 0, ""
        self._total: int | None = None
        self._before = deque[tuple[float, int]]([(self._begun, 0)], maxlen=RECENT)
        self._over, self._beats = Event(), Thread(target=self._beat, daemon=True)

    def __enter__(self) -> "Steps":
        if self.shown and self.console.is_terminal:
            bars: Any = importlib.import_module("rich.progress")  # for terminals only
            self.bar = bars.Progress(
                bars.TextColumn("{task.description}"),
                bars.BarColumn(),
                bars.MofNCompleteColumn(),
                bars.TimeElapsedColumn(),
                bars.TimeRemainingColumn(),
                console=self.console,
                transient=True,
            )
            self.bar.start()
            self.task = self.bar.add_task(self.title, total=None)
        elif self.shown:
            self._beats.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        if self.bar is not None:
            self.bar.stop()
        elif self.shown:
            self._beats.join()

    def update(self, done: int, total: int | None, note: str = "", title: str = "") -> None:
        """Show how many steps are done, of None if nobody can know; another title begins anew.

        An interrupt that was swallowed is raised here.
        """
        check_interrupted()
        if title not in ("", self.title):
            self.title, self._begun = title, time.monotonic()
            self._before.clear()
            self._before.append((self._begun, done))
        self._done, self._total, self._note = done, total, note
        if self.bar is not None:
            shown = f"{self.title} {note}" if note else self.title
            self.bar.update(self.task, completed=done, total=total, description=shown)

    def _beat(self) -> None:
        """Print a line of progress now and then until the work is over."""
        while not self._over.wait(PLAIN_EVERY_S):
            self.console.print(Text(printable(self._line())), soft_wrap=True)

    def _line(self) -> str:
        done, total, now = self._done, self._total, time.monotonic()
        of = "" if total is None else f"/{total}"
        parts = [f"{self.title} {done}{of}" if done or of else self.title, self._note]
        then, before = self._before[0]
        self._before.append((now, done))
        rate = (done - before) / max(now - then, PLAIN_EVERY_S)
        if rate > 0.0 and total is not None:
            parts.append(f"{rate:.3g}/s")
        parts.append(f"after {duration(now - self._begun)}")
        line = " ".join(filter(None, parts))
        if total is not None and rate > 0.0 and done > min(EARLIEST * total, ENOUGH):
            line += f", some {duration((total - done) / rate)} left"
        return line


def warn_of(lines: Sequence[str], file: str, reporter: Reporter) -> None:
    """Print the first lines of warnings, and say which file has all of them."""
    for line in lines[:TABLE_ROWS]:
        reporter.warn(line)
    if len(lines) > TABLE_ROWS:
        left = len(lines) - TABLE_ROWS
        reporter.warn(f"and {left} more: {file} (--out DIR) has all of them")


def say_cut(count: int, reporter: Reporter) -> None:
    """Say how many rows a table left out."""
    if count > TABLE_ROWS:
        reporter.say(f"... and {count - TABLE_ROWS} more")

"""Builds a dataset in a folder; work finished by an earlier, interrupted build is not repeated.

An engine submits a unit of work to a worker process and returns a future. A unit whose worker dies,
or that takes too long, is tried once more when nothing else is under way; then it is quarantined:
left out, with the reason recorded. A unit that fails with an error of this project is quarantined
at once, because it would fail again. A failure that would befall every unit - a full disk, a worker
with other packages - ends the build. A worker process must run the same code and packages as the
process that started it, or its rows could differ. A timer beside Python ends a process in which a
unit takes too long, also inside a call that never comes back.

Finished units are kept in a staging folder: one subfolder per unit, renamed in one step, so every
subfolder is complete, and a resumed build repeats only the units that were under way.

Rows are sorted by object, then by their table's key, so the files do not depend on when, where or
in which run each unit was computed. Only the rows of one object, and rows that wait to be written,
are in memory. The manifest, which lists all files, is written last; then the staging folder is
removed.

The README.md describes the dataset to people and to the Hugging Face Hub, a website for datasets
that calls this page a card; `card.md.jinja` holds its sentences. A user's own words are escaped: in
the header as quoted strings, in the text as Markdown.
"""

import errno
import faulthandler
import inspect
import os
import re
import shutil
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import groupby, product
from pathlib import Path
from threading import TIMEOUT_MAX
from typing import Any, NamedTuple, TypeAlias

from grasp_core.declared import declared
from grasp_core.errors import GraspError, InputError
from grasp_core.files.file_kinds import UNIT
from grasp_core.files.records import RecordFile
from grasp_core.files.text_files import read_text, write_text
from grasp_core.messages import FieldError, shown
from grasp_core.processes import Processes
from grasp_core.provenance import arithmetic
from scenes.drawing.pages import filled
from sim_validate.datasets.clusters import Cluster
from sim_validate.datasets.columns import ROWS, dataset_tables
from sim_validate.datasets.config import (
    KEYS,
    REFERENCES,
    SPLITS,
    DatasetConfig,
    Name,
    SplitName,
    config_to_toml,
    quoted,
    settings_text,
)
from sim_validate.datasets.open_dataset import (
    CONFIG,
    MANIFEST,
    QUARANTINE,
    LeftOut,
    Listed,
    Manifest,
    left_out_text,
    listed,
    read_manifest,
    write_manifest,
)
from sim_validate.datasets.parquet import joined, parquet_bytes, pyarrow, write_files
from sim_validate.datasets.work_units import (
    Making,
    WorkerError,
    WorkUnit,
    body_of,
    given_text,
    made_of,
    provenance,
    units_of,
    units_sha256,
)
from sim_validate.engine.gate import ClosureCase
from sim_validate.engine.known_cases import checked
from sim_validate.engine.setup import Setup
from sim_validate.files.locks import entries
from sim_validate.files.named_paths import path_inside
from sim_validate.files.output_folders import alone_in, whole_folder
from sim_validate.processes.interrupts import check_interrupted

HASH = re.compile(r"[0-9a-f]{64}")
OTHERS = "others"
"""Subfolder for those files of a unit that are not tables."""


@declared
class UnitRecord(RecordFile):
    """Record of a finished unit of work: where its rows belong, or why it has none."""

    FILE = UNIT
    SCHEMA = 2

    object: str
    friction: float
    files: tuple[Listed, ...]
    """Files of the unit's folder."""
    object_id: str | None = None
    """Hash of the object's mesh, in whose table its row is; None if there are no rows."""
    split: SplitName | None = None
    reason: str | None = None
    """Why there are no rows; None if there are."""

    def _check_together(self) -> None:
        there = (self.object_id is not None, self.split is not None, self.reason is None)
        if len(set(there)) > 1:
            raise InputError(
                "expected an object_id and a split, or else a reason for having no rows; remove "
                "the folder and build again"
            )
        if self.object_id is not None and not HASH.fullmatch(self.object_id):
            raise FieldError("object_id", f"must be a SHA-256 hash, got {shown(self.object_id)}")


@dataclass(frozen=True, slots=True)
class Staging:
    """The folder that holds finished units of work until the dataset is complete."""

    folder: Path

    def remove(self) -> None:
        """Remove the whole staging folder, once a finished dataset holds its contents."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def write(self, unit: WorkUnit, made: Making) -> None:
        """Keep the rows and files of a finished unit."""
        kinds = dataset_tables(unit.config.groups)
        tables = {
            _file(name): parquet_bytes(name, made.rows.cells(name, columns), kinds)
            for name, columns in kinds.items()
        }
        others = {f"{OTHERS}/{path}": text.encode() for path, text in made.files.items()}
        (row,) = made.rows.objects
        self._put(unit, {**tables, **others}, object_id=row.object_id, split=row.split)

    def quarantine(self, unit: WorkUnit, reason: str) -> None:
        """Record that a unit cannot be computed, with the reason, which names no folder."""
        self._put(unit, {}, reason=reason.replace(str(unit.path or unit.label), unit.label))

    def record(self, unit: WorkUnit) -> UnitRecord:
        """Look up how a unit ended: with its object and split, or with a reason for no rows."""
        return UnitRecord.read(self.of(unit) / UnitRecord.FILE)

    def done(self, unit: WorkUnit) -> bool:
        """Tell whether a unit is finished or quarantined, and all its files are as written."""
        try:
            return not any(each.fault(self.of(unit)) for each in self.record(unit).files)
        except (OSError, InputError):
            return False

    def table(self, unit: WorkUnit, name: Name) -> Path:
        """Return the path of a finished unit's rows in one of the tables."""
        return self.of(unit) / _file(name)

    def of(self, unit: WorkUnit) -> Path:
        """Return the folder of a finished unit, with its rows or the reason why it has none."""
        return self.folder / unit.id

    def _put(self, unit: WorkUnit, files: Mapping[str, bytes], **more: Any) -> None:
        try:
            with whole_folder(self.of(unit)) as made:
                kept = tuple(listed(made, _kept(made / name, data)) for name, data in files.items())
                record = UnitRecord(unit.object, unit.friction, kept, **more)
                _kept(made / record.FILE, record.text().encode())
        except (OSError, InputError):
            if not self.done(unit):  # otherwise another attempt was faster and wrote the same rows
                raise


def _file(name: Name) -> str:
    return f"{name}.parquet"


def _kept(path: Path, data: bytes) -> Path:
    """Write a file so that it outlasts a loss of power."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    return path


Engine: TypeAlias = Processes | Cluster
"""What computes units of work: processes of this machine, or a Ray or Dask cluster."""
AHEAD = 3
"""Number of units submitted per worker process, so that no worker waits for the next unit."""
LOOK_S = 1.0
"""Time between two checks for an interrupt [s]."""


Work: TypeAlias = Callable[[WorkUnit, Staging], None]


def do_unit(unit: WorkUnit, staging: Staging) -> None:
    """Compute the rows of a unit and keep them, or the reason why there are none."""
    try:
        staging.write(unit, made_of(unit, body_of(unit)))
    except WorkerError:
        raise
    except GraspError as error:
        staging.quarantine(unit, str(error))
    except (MemoryError, OSError) as error:
        if isinstance(error, OSError) and error.errno != errno.ENOMEM:
            raise
        staging.quarantine(unit, "out of memory")
    except Exception as error:  # a bug that one object triggers must not stop the others
        staging.quarantine(unit, f"internal error: {type(error).__name__}: {error}")


@dataclass(frozen=True, slots=True)
class Task:
    """A unit of work, with all that a worker process needs to compute it."""

    unit: WorkUnit
    staging: Staging
    provenance: Mapping[str, str]
    """Versions of packages, and the hash of the code, that the worker process must have, too."""
    timeout_s: float | None = None
    """Time that the unit may take [s]; None where the process that runs the build computes it."""
    work: Work = do_unit


def do_task(task: Task) -> None:
    """Compute a unit in a worker process, and keep its rows."""
    own = provenance()
    for name, wanted in task.provenance.items():
        if own.get(name) != wanted:
            raise WorkerError(
                f"a worker process has another version of {name}: {own.get(name)} instead of "
                f"{wanted}; install the same version everywhere"
            )
    if not task.staging.folder.is_dir():
        raise WorkerError(
            f"{task.staging.folder}: a worker process cannot see this folder; --out must be on a "
            "file system that all processes share"
        )
    with _ending_after(task.timeout_s):
        task.work(task.unit, task.staging)


@contextmanager
def _ending_after(timeout_s: float | None) -> Generator[None]:
    """End this process, whatever it does, when the block takes longer [s]."""
    if timeout_s is None:
        yield
        return
    with Path(os.devnull).open("w") as unread:
        # a thread that needs nothing of Python: also calls that never give it back are ended
        faulthandler.dump_traceback_later(min(timeout_s, TIMEOUT_MAX), exit=True, file=unread)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


def drive(
    units: Sequence[WorkUnit],
    staging: Staging,
    engine: Engine,
    report: Callable[[int, int], None],
    timeout_s: float | None = None,
    work: Work = do_unit,
) -> None:
    """Have all units computed; each one is kept or quarantined in the end.

    Takes `report` (finished, total).
    """
    own, finished, again = dict(provenance()), 0, list[Task]()
    tasks = [Task(unit, staging, own, timeout_s, work) for unit in units]
    report(finished, len(units))
    for task, good in _ended(tasks, engine, AHEAD * engine.workers):
        again += [] if good else [task]
        finished += good
        report(finished, len(units))
    for task in again:  # with no other unit under way
        began = time.monotonic()
        ((_, good),) = _ended([task], engine, 1)
        if not good:
            late = timeout_s is not None and time.monotonic() - began >= timeout_s
            reason = "took too long, twice" if late else "its worker ended, twice"
            staging.quarantine(task.unit, reason)
        finished += 1
        report(finished, len(units))


def _ended(tasks: Sequence[Task], engine: Engine, ahead: int) -> Iterator[tuple[Task, bool]]:
    """Yield each task when it has ended, with whether it is done or its worker process has died."""
    waiting, under_way = deque(tasks), dict[Future[None], Task]()
    while waiting or under_way:
        while waiting and len(under_way) < ahead:
            task = waiting.popleft()
            under_way[engine.submit(do_task, task)] = task
        for future in wait(under_way, timeout=LOOK_S, return_when=FIRST_COMPLETED).done:
            task = under_way.pop(future)
            yield task, _succeeded(future, task, engine)
        check_interrupted()


def _succeeded(future: "Future[None]", task: Task, engine: Engine) -> bool:
    error = future.exception()
    if error is None:
        if task.staging.of(task.unit).is_dir():
            return True
        raise WorkerError(
            f"{task.staging.folder}: a worker process has computed rows that do not appear here; "
            "--out must be on a file system that all processes share"
        )
    if type(error).__name__ in engine.ended:
        return False
    if isinstance(error, WorkerError | OSError | KeyboardInterrupt):
        raise error
    name = type(error).__name__
    raise WorkerError(
        f"a worker process cannot compute units of work ({name}: {error}); check that all worker "
        "processes have the same packages"
    ) from error


CARD = "README.md"
SIZES = ("1K", "10K", "100K", "1M", "10M", "100M", "1B", "10B", "100B")
"""Powers of ten, from a thousand, as the Hugging Face Hub names sizes of datasets."""
MARKS = frozenset("\\`*_[]<>|~&#!$@")
"""Characters that can begin Markdown or HTML within a line."""
SPDX = re.compile(r"[A-Za-z0-9.+-]+")
"""Pattern of a licence's name in SPDX; in small letters it is that of the Hugging Face Hub, but for
a few such as ODbL-1.0, there `odbl`."""
ADDRESS = re.compile(r"https?://[^\s<>\"'`\\|{}^]+")
"""Pattern of a web address that can stand in Markdown as a link unchanged."""
DATA = "data"
TWIN = "the same object as"
"""First words of the reason why an object with the same mesh as another has no rows."""
CONTACTS = "contacts.json"
"""Name of the file with the given contacts, if there are any; its normals point into the object."""
EXTRAS = ("meshes", "scenes")
"""Folders of the files that units make besides their rows."""
OWN = ("staging", DATA, *EXTRAS, CONTACTS, CONFIG, QUARANTINE, CARD, MANIFEST)
"""Names of all files and folders that the folder of a dataset may hold."""


Finished: TypeAlias = tuple[WorkUnit, UnitRecord]
"""A unit of work that has rows, with its record."""


class Built(NamedTuple):
    """The result of a build."""

    manifest: Manifest
    made: int
    """Number of units of work that were computed in this run."""


def build(
    config: DatasetConfig,
    folder: Path,
    engine: Engine,
    report: Callable[[int, int], None],
    timeout_s: float | None = None,
) -> Built:
    """Build a dataset, or resume an interrupted build; `report` takes (finished, total)."""
    pyarrow()  # before any work, so that a missing library is named at once
    units = units_of(config)
    _refuse_sources_inside(units, config, folder)
    with alone_in(folder):
        _refuse_others(folder, config)
        staging = Staging(folder.resolve() / "staging")
        if (folder / MANIFEST).is_file():
            staging.remove()
            return _as_built(folder, units)
        write_text(folder / CONFIG, config_to_toml(config))
        staging.folder.mkdir(exist_ok=True)
        left = [unit for unit in units if not staging.done(unit)]
        for unit in left:
            shutil.rmtree(staging.of(unit), ignore_errors=True)  # its files are damaged
        for friction in config.frictions if left else ():
            # a gate that fails at one object's size only leaves that object out
            checked(ClosureCase.of(Setup(), friction))
        drive(left, staging, engine, report, timeout_s)
        _finish(config, units, staging, folder)
        return _as_built(folder, units, len(left))


def _refuse_sources_inside(units: Sequence[WorkUnit], config: DatasetConfig, folder: Path) -> None:
    sources = [unit.path for unit in units if unit.path is not None]
    sources += [Path(config.contacts).resolve()] if config.contacts else []
    for path in sources:
        if path.is_relative_to(folder.resolve()):
            raise InputError(
                f"{path}: this input lies in the output folder {folder}; give another --out"
            )


SCHEMA_LINE = re.compile(r"\A#:schema .*\n")
"""Pattern of the first line of a configuration, which decides nothing."""


def _refuse_others(folder: Path, config: DatasetConfig) -> None:
    """Refuse a folder with other files, and remove half-written files of a killed build."""
    stated = folder / CONFIG
    own = OWN if stated.is_file() else ()
    half_written = tuple(f".{name}." for name in OWN)
    for path in entries(folder):
        if path.name.startswith(half_written):
            path.unlink()
        elif path.name not in own:
            raise InputError(
                f"{path}: this file is not part of the dataset to write; give an empty or new "
                "folder as --out"
            )
    if stated.is_file() and SCHEMA_LINE.sub("", read_text(stated)) != settings_text(config):
        raise InputError(
            f"{folder}: the folder holds a dataset made with other settings (see its {CONFIG}); "
            "give another --out, or the same settings to resume that dataset"
        )


def _as_built(folder: Path, units: Sequence[WorkUnit], made: int = 0) -> Built:
    """Describe a finished dataset, after a check that it is the one asked for."""
    manifest = read_manifest(folder)
    if manifest.units_sha256 != units_sha256(units):
        raise InputError(
            f"{folder}: this dataset is finished, but its meshes, contacts or package versions "
            "have changed since then; give another --out to make it again"
        )
    for each in manifest.files:
        path = path_inside(folder, each.path)
        if not path.is_file() or path.stat().st_size != each.bytes:
            raise InputError(
                f"{path}: this file of a finished dataset is missing or damaged (see `dataset "
                "verify`); give another --out to make it again"
            )
    return Built(manifest, made)


def _finish(
    config: DatasetConfig, units: Sequence[WorkUnit], staging: Staging, folder: Path
) -> None:
    """Write the rows of all units into tables, list all files, and remove the staging folder."""
    for name in (DATA, *EXTRAS):
        shutil.rmtree(folder / name, ignore_errors=True)
    good, quarantined = _sorted_out(units, staging)
    tables = _write_tables(config, good, staging, folder)
    for unit, _ in good:
        shutil.copytree(staging.of(unit) / OTHERS, folder, dirs_exist_ok=True)
    given = {each.id: each for unit in units for each in unit.given}
    if given:
        in_order = [given[name] for name in sorted(given)]
        write_text(folder / CONTACTS, given_text(in_order))
    others = [
        write_text(folder / CONFIG, config_to_toml(config)),
        write_text(folder / QUARANTINE, left_out_text(quarantined)),
        *([folder / CONTACTS] if given else []),
        *(path for name in EXTRAS for path in sorted((folder / name).glob("*"))),
    ]
    manifest = Manifest(
        config_sha256=config.sha256,
        versions=dict(provenance()),
        arithmetic=arithmetic(),
        units=len(units),
        units_sha256=units_sha256(units),
        quarantined=len(quarantined),
        groups=config.groups,
        files=(*tables, *(listed(folder, path) for path in others)),
    )
    card = write_text(folder / CARD, card_text(config, manifest))
    write_manifest(folder, replace(manifest, files=(*manifest.files, listed(folder, card))))
    staging.remove()


def _sorted_out(
    units: Sequence[WorkUnit], staging: Staging
) -> tuple[list[Finished], list[LeftOut]]:
    """List units with rows of their own, sorted by object, and the reasons why others have none."""
    good, quarantined = list[Finished](), list[LeftOut]()
    first: dict[tuple[str | None, float], WorkUnit] = {}
    for unit in sorted(units, key=lambda each: (each.label, each.source_sha256, each.friction)):
        record = staging.record(unit)
        reason = record.reason
        if reason is None:
            other = first.setdefault((record.object_id, unit.friction), unit)
            if other.object == unit.object:
                good.append((unit, record))
                continue
            reason = f"{TWIN} {other.label}"
        given = tuple(each.id for each in unit.given)
        quarantined.append(LeftOut(unit.label, unit.source_sha256, unit.friction, given, reason))
    return sorted(good, key=lambda each: (str(each[1].object_id), each[0].friction)), quarantined


def _write_tables(
    config: DatasetConfig, good: Sequence[Finished], staging: Staging, folder: Path
) -> list[Listed]:
    tables, found = dataset_tables(config.groups), list[Listed]()
    about = {"schema": str(Manifest.SCHEMA), "config_sha256": config.sha256}
    objects = groupby(good, key=lambda each: (each[1].object_id, each[1].split))
    units = [(split, [unit for unit, _ in same]) for (_, split), same in objects]
    for name, (split, _) in product(tables, SPLITS):
        parts = (
            joined([staging.table(unit, name) for unit in chosen], name, tables)
            for own, of_object in units if own == split
            for chosen in [of_object[:1] if name == "objects" else of_object]
        )  # fmt: skip
        found += [
            replace(listed(folder, path), table=name, split=split, rows=rows)
            for path, rows in write_files(folder / DATA / name, split, parts, about)
        ]
    return found


def card_text(config: DatasetConfig, manifest: Manifest) -> str:
    """Write the README.md of a dataset."""
    rows, tables = manifest.rows, list(_tables(manifest))
    (of_grasps,) = (table["splits"] for table in tables if table["name"] == "grasps")
    chances = [
        f"{name} {upto - before:.0%}"
        for (name, upto), before in zip(SPLITS, (0.0, *(upto for _, upto in SPLITS)), strict=False)
    ]
    return filled(
        "card.md.jinja",
        Path(__file__).parent,
        config=config,
        settings=settings_text(config),
        manifest=manifest,
        rows=rows,
        tables=tables,
        executed=config.execution,
        hub_license=config.license.lower() if SPDX.fullmatch(config.license) else "",
        credits={
            "Creator": _as_markdown(config.creator),
            "Address": _as_address(config.url),
            "Published": _as_markdown(config.published),
            "Licence": _as_address(config.license),
        },
        size=_size(sum(rows.values())),
        chances=", ".join(reversed(chances)),
        split=next(iter(of_grasps), "train"),
        quoted=quoted,
        markdown=_as_markdown,
        references=REFERENCES,
    )


def _size(rows: int) -> str:
    """Return the name that the Hugging Face Hub has for datasets of about as many rows."""
    place = min(max(len(str(rows)) - 3, 0), len(SIZES) - 1)
    return f"{SIZES[place - 1]}<n<{SIZES[place]}" if place else f"n<{SIZES[0]}"


def _tables(manifest: Manifest) -> Iterator[Mapping[str, Any]]:
    for name, columns in manifest.tables.items():
        splits = {
            split: manifest.count(name, split)
            for split, _ in reversed(SPLITS)
            if manifest.of_table(name, split)
        }
        yield {
            "name": name,
            "row": inspect.getdoc(ROWS[name]),
            "splits": splits,
            "sorted_by": " and ".join(f"`{key}`" for key in KEYS[name]),
            "columns": columns,
        }


def _as_address(text: str) -> str:
    """Write a web address as a link, and any other text of a user as Markdown."""
    if text.isprintable() and ADDRESS.fullmatch(text) is not None:
        return f"<{text}>"
    return _as_markdown(text)


def _as_markdown(text: str) -> str:
    """Write a user's text on one line, with all Markdown and HTML escaped."""
    line = "".join(letter if letter.isprintable() else " " for letter in text).strip()
    return "".join(f"\\{letter}" if letter in MARKS else letter for letter in line)

"""From a configuration to a finished dataset in a folder; what was done before is not done again.

The manifest is written last: a folder without one is no dataset yet. Once it is there, the staging
folder goes. No file but the manifest knows when or on how many processes it was made, nor does the
manifest: the same configuration, meshes and versions give the same bytes.
"""

import fcntl
import hashlib
import json
import shutil
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from grasp_core.errors import InputError
from sim_validate.datasets.columns import TABLES, Name
from sim_validate.datasets.config import DatasetConfig, config_to_toml
from sim_validate.datasets.driver import Engine, drive
from sim_validate.datasets.rows import SPLITS, Row
from sim_validate.datasets.staging import Staging
from sim_validate.datasets.tables import parquet_bytes, require_pyarrow
from sim_validate.datasets.tasks import Limits
from sim_validate.datasets.units import WorkUnit, provenance, units_of
from sim_validate.files import read_text, write_bytes, write_text
from sim_validate.gate import require_faithful
from sim_validate.setup import Setup

SCHEMA = 1
MANIFEST = "manifest.json"
OWN = ("staging", "data", "config.toml", "quarantine.jsonl", MANIFEST, ".lock")
"""What a dataset's folder holds, and nothing else."""


@dataclass(frozen=True, slots=True)
class Built:
    """What came of a build."""

    units: int
    made: int
    """Units that were not done before."""
    quarantined: int
    rows: dict[Name, int]


def build(
    config: DatasetConfig,
    folder: Path,
    engine: Engine,
    report: Callable[[int, int], None],
    limits: Limits | None = None,
) -> Built:
    """Make a dataset, or go on making it.

    Args:
        config: What it is made of.
        folder: Where; it may hold an unfinished or finished dataset of the same configuration.
        engine: Where units are done.
        report: Told how many units are finished, and of how many.
        limits: What each unit may take; only for engines with processes of their own.

    Raises:
        InputError: An object is nowhere, the folder holds something else, or another build is at
            work in it.
        UnfaithfulError: The simulator fails the gate.
        WorkerError: A worker cannot do units for this driver.
    """
    require_pyarrow()
    units = units_of(config)
    with _alone(folder):
        _refuse_others(folder, config)
        if (folder / MANIFEST).is_file():
            return _as_built(folder, len(units))
        write_text(folder / "config.toml", config_to_toml(config))
        staging = Staging(folder.resolve() / "staging")
        staging.clear_unfinished()
        left = [unit for unit in units if not staging.done(unit)]
        for unit in left:
            staging.forget(unit)
        for friction in config.frictions if left else ():
            require_faithful(Setup(), friction)  # what fails at one object's size leaves it out
        drive(left, staging, engine, report, limits)
        _finish(config, units, staging, folder)
        return _as_built(folder, len(units), len(left))


@contextmanager
def _alone(folder: Path) -> Generator[None]:
    """Keep other builds out of a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise InputError(f"{folder}: another build is at work in it") from error
        yield


def _refuse_others(folder: Path, config: DatasetConfig) -> None:
    """Refuse a folder of something else.

    Raises:
        InputError: It holds other files, or a dataset of another configuration.
    """
    if others := sorted({path.name for path in folder.iterdir()} - set(OWN)):
        raise InputError(f"{folder}: holds {others[0]}, which no dataset does; give another --out")
    stated = folder / "config.toml"
    if stated.is_file() and read_text(stated) != config_to_toml(config):
        raise InputError(
            f"{folder}: holds a dataset of another configuration (see its config.toml); give "
            "another --out, or the same settings to go on"
        )


def _finish(
    config: DatasetConfig, units: Sequence[WorkUnit], staging: Staging, folder: Path
) -> None:
    """Put the rows of all units into tables, a file per table and split, and list the files."""
    good, quarantined = _sorted_out(units, staging)
    about = {"schema": str(SCHEMA), "config_sha256": config.sha256}
    listed: list[dict[str, Any]] = []
    shutil.rmtree(folder / "data", ignore_errors=True)
    rows: dict[Name, list[Row]] = {name: _all_rows(good, staging, name) for name in TABLES}
    parts = {row["grasp_id"]: row["split"] for row in rows["grasps"]}
    for name in TABLES:
        by_part: dict[str, list[Row]] = {part: [] for part, _ in SPLITS}
        for row in rows[name]:
            by_part[row["split"] if "split" in row else parts[row["grasp_id"]]].append(row)
        for part, some in by_part.items():
            if some:
                path = folder / "data" / name / f"{part}-00000-of-00001.parquet"
                write_bytes(path, parquet_bytes(name, some, about))
                listed.append(_listed(folder, path) | {"table": name, "rows": len(some)})
    lines = "".join(json.dumps(each, sort_keys=True) + "\n" for each in quarantined)
    files = [folder / "config.toml", write_text(folder / "quarantine.jsonl", lines)]
    manifest = {
        "schema": SCHEMA,
        "config_sha256": config.sha256,
        "versions": dict(provenance()),
        "units": len(units),
        "quarantined": len(quarantined),
        "files": sorted(
            [*listed, *(_listed(folder, path) for path in files)], key=lambda each: each["path"]
        ),
    }
    write_text(folder / MANIFEST, json.dumps(manifest, indent=1, sort_keys=True) + "\n")
    shutil.rmtree(staging.folder)


def _sorted_out(
    units: Sequence[WorkUnit], staging: Staging
) -> tuple[list[WorkUnit], list[dict[str, object]]]:
    """Units with rows of their own, and why others have none."""
    good, quarantined = list[WorkUnit](), list[dict[str, object]]()
    first: dict[tuple[str, float], str] = {}
    for unit in sorted(units, key=lambda each: (each.object, each.friction)):
        reason = staging.reason(unit)
        if reason is None:
            ((body,), key) = staging.rows(unit, "objects"), unit.friction
            other = first.setdefault((body["object_id"], key), unit.object)
            reason = None if other == unit.object else f"the same object as {other}"
        if reason is None:
            good.append(unit)
        else:
            quarantined.append({"object": unit.object, "friction": unit.friction, "reason": reason})
    return good, quarantined


def _all_rows(units: Sequence[WorkUnit], staging: Staging, name: Name) -> list[Row]:
    rows = [row for unit in units for row in staging.rows(unit, name)]
    if name != "objects":
        return rows
    return list({row["object_id"]: row for row in reversed(rows)}.values())


def _listed(folder: Path, path: Path) -> dict[str, Any]:
    data = path.read_bytes()
    return {
        "path": path.relative_to(folder).as_posix(),
        "bytes": len(data),
        "sha256": hashlib.sha256(data).hexdigest(),
    }


def _as_built(folder: Path, units: int, made: int = 0) -> Built:
    """What a manifest says."""
    manifest = read_manifest(folder)
    rows = dict.fromkeys(TABLES, 0)
    for each in manifest["files"]:
        if "table" in each:
            rows[cast("Name", each["table"])] += int(each["rows"])
    return Built(units, made, int(manifest["quarantined"]), rows)


def read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest of a dataset.

    Raises:
        InputError: There is none, or it is not as this version writes them.
    """
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(f"{folder}: no dataset, or one that is not finished: no {MANIFEST}")
    try:
        found: object = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not JSON ({error})") from error
    if not isinstance(found, dict):
        raise InputError(f"{path}: expected an object")
    manifest = cast("dict[str, Any]", found)
    if manifest.get("schema") != SCHEMA or not isinstance(manifest.get("files"), list):
        raise InputError(f"{path}: expected schema {SCHEMA}, got {manifest.get('schema')!r}")
    return manifest

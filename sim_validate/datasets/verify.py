"""Checks whether a dataset is as its manifest says, and computes a sample of it again."""

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.files.file_kinds import MANIFEST, QUARANTINE
from sim_validate.datasets.columns import DatasetRows, ObjectRow
from sim_validate.datasets.config import SPLITS
from sim_validate.datasets.hand_files import HandFiles, joint_names
from sim_validate.datasets.layout import CONFIG, HAND_FOLDER, STAGING_FOLDER
from sim_validate.datasets.open_dataset import Dataset, select
from sim_validate.datasets.parquet import pyarrow
from sim_validate.datasets.quarantine import read_quarantine
from sim_validate.datasets.recomputing import Recomputing
from sim_validate.datasets.row_checks import RowChecks
from sim_validate.files.locks import LOCK


def verify(folder: Path, share: float = 0.0, seed: int = 0) -> list[str]:
    """List what is wrong with a dataset, one line each; an empty list means that all is well.

    Checked are hashes, sizes and page checksums of all files; counts, keys and references of rows;
    for each contact set its normals, its closure (proved again), and that its trials agree with its
    row; for each execution what its squeeze carries (proved again), and that its trials agree with
    the row; and for a share of all objects at frictions, drawn by a seed, whether planning and
    simulating again gives the same rows: for one at least, unless the share is zero.
    """
    pyarrow()  # before any work, so that a missing library is named at once
    dataset, faults = select(folder), list[str]()
    try:
        if faults := list(_file_faults(dataset)):
            return faults
        faults += _manifest_faults(dataset)
        for part, rows in _parts(dataset):
            faults += RowChecks(part, rows).faults()
        if share > 0.0 and not faults:
            faults += _sample_faults(dataset, share, seed)
    except InputError as error:
        faults.append(str(error))
    return faults


def _parts(dataset: Dataset) -> Iterator[tuple[Dataset, DatasetRows]]:
    for split, _ in SPLITS:
        part = replace(dataset, split=split)
        yield from ((part, rows) for rows in part.by_object())


def _file_faults(dataset: Dataset) -> Iterator[str]:
    folder, files = dataset.folder, dataset.manifest.files
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    more = there - {MANIFEST, LOCK, *(each.path for each in files)}
    # staged files no longer matter
    yield from (
        f"{path}: this file is not listed in the manifest"
        for path in sorted(more) if not path.startswith(f"{STAGING_FOLDER}/")
    )  # fmt: skip
    for each in files:
        if fault := each.fault(folder):
            yield f"{each.path}: {fault}"


def _manifest_faults(dataset: Dataset) -> Iterator[str]:
    manifest, config = dataset.manifest, dataset.config
    if config.sha256 != manifest.config_sha256:
        yield f"{CONFIG}: the file is not the configuration that the manifest names"
    hand = dataset.hand_folder
    if (hand is None) != (config.hand is None):
        yield f"{HAND_FOLDER}: the dataset keeps a hand, or none, unlike {CONFIG}"
    elif hand is not None and HandFiles.kept(hand).sha256 != hand.name:
        yield f"{HAND_FOLDER}/{hand.name}: the files are others than the name of their folder says"
    if manifest.groups != config.groups(len(joint_names(hand))):
        yield f"{MANIFEST}: `groups` is {manifest.groups}, unlike {CONFIG}"
    lines = len(read_quarantine(dataset.folder / QUARANTINE))
    if lines != manifest.quarantined:
        yield (
            f"{QUARANTINE}: the file has {lines} lines, but the manifest says "
            f"{manifest.quarantined}"
        )
    for each in manifest.files:
        if each.table and not Path(each.path).name.startswith(f"{each.split}-"):
            yield (
                f"{each.path}: the manifest lists this file under the split {each.split}, unlike "
                "its name"
            )


def _sample_faults(dataset: Dataset, share: float, seed: int) -> Iterator[str]:
    recomputing = Recomputing(dataset)
    if fault := recomputing.hand_fault():
        yield fault
    units = [
        (row.object_id, friction)
        for row in dataset.rows(ObjectRow)
        for friction in recomputing.frictions(row)
    ]
    chosen = {*_drawn(sorted(units), share, seed)}
    for _, rows in _parts(dataset):
        for row in rows.objects:
            yield from recomputing.faults(row, rows, chosen)


def _drawn(units: Sequence[tuple[str, float]], share: float, seed: int) -> list[tuple[str, float]]:
    """Choose units at random, in an order that only the seed decides."""

    def place(unit: tuple[str, float]) -> bytes:
        return hashlib.sha256(f"{seed} {unit}".encode()).digest()

    return sorted(units, key=place)[: math.ceil(share * len(units))]

"""Reads recorded grasps from files and folders, in every format of one table.

A file that cannot be read is one bad record, and so is each record that is wrong: neither loses any
other.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from grasp_core.allowed_values import one_of
from grasp_core.errors import InputError
from grasp_core.files.file_kinds import REACHES, kind_of
from grasp_core.files.json_text import json_of
from grasp_core.files.text_files import read_bytes, text_of
from sim_validate.files.numpy_pickles import MOST_PICKLE_BYTES, unpickled
from sim_validate.judge.formats import bodex, contacts, dexgraspbench, dexgraspnet, reaches, table
from sim_validate.judge.formats.fields import Source
from sim_validate.judge.records import BadRecord, GraspRecord

MOST_TABLE_BYTES = 128 * 2**20
MOST_JSON_BYTES = 24 * 2**20
"""Largest JSON file: values take up to 25 times the size of their text."""


@dataclass(frozen=True, slots=True)
class RecordFormat:
    """A format of recorded grasps."""

    meaning: str
    """Whose records these are."""
    endings: tuple[str, ...]
    """Endings of its files."""
    keys: tuple[str, ...]
    """Keys by which it is known: dictionaries have one of them, lists in their first dictionary."""
    read: Callable[[Any, Source], Iterator[GraspRecord]]
    """Make records of what a file holds."""

    def recognises(self, found: Any, ending: str) -> bool:
        """Return whether what a file holds is in this format."""
        listed = cast("list[Any]", found) if isinstance(found, list) else [found]
        tables = (cast("dict[str, Any]", each) for each in listed if isinstance(each, dict))
        keys = next(tables, dict[str, Any]())
        known = ending == PARQUET or any(key in keys for key in self.keys)
        return ending in self.endings and known


NUMPY, NPZ, PARQUET, JSON = ".npy", ".npz", ".parquet", ".json"
CONTENTS: Mapping[str, tuple[int, Callable[[bytes], Any]]] = {
    NUMPY: (MOST_PICKLE_BYTES, unpickled),
    NPZ: (MOST_TABLE_BYTES, table.columns_of_npz),
    PARQUET: (MOST_TABLE_BYTES, table.parquet_file),
    JSON: (MOST_JSON_BYTES, lambda data: json_of(text_of(data))),
}
"""For each ending of a file, its largest size [bytes], and what makes values of its bytes."""
FORMATS: Mapping[str, RecordFormat] = {
    "dexgraspbench": RecordFormat(
        "DexGraspBench, Dexonomy and DexLearn", (NUMPY,), ("grasp_qpos",), dexgraspbench.read
    ),
    "bodex": RecordFormat("BODex", (NUMPY,), ("robot_pose",), bodex.read),
    "dexgraspnet": RecordFormat("DexGraspNet", (NUMPY,), ("qpos",), dexgraspnet.read),
    "table": RecordFormat(
        "a table that any tool can write", (NPZ, PARQUET, JSON), ("joints_rad",), table.read
    ),
    "reaches": RecordFormat("graspproof reach", (JSON,), ("reaches",), reaches.read),
    "contacts": RecordFormat("contacts alone", (JSON,), ("contacts", "grasps"), contacts.read),
}  # fmt: skip
"""Every format by its name, in the order in which a file is tried."""


def read_records(
    paths: Sequence[Path],
    format: str | None = None,  # noqa: A002 - the word of users
    objects: Path | None = None,
) -> Iterator[GraspRecord]:
    """Read the records of files, and of all files in folders, in order.

    Args:
        paths: Files and folders. Of folders, hidden files are left out, as are results of
            graspproof other than `reaches.json`.
        format: A name in `FORMATS`; None to find the format of each file.
        objects: Folder of the objects, near which scenes of Dexonomy are looked for.

    Returns:
        An iterator over records, one file after another. Ids differ. A record or a file that
        cannot be read is a `BadRecord`.

    Raises:
        InputError: The format has no name in the table, or a path is neither a file nor a folder,
            or there is no file.
    """
    if format is not None:
        one_of(format, FORMATS, "format")
    chosen = {format: FORMATS[format]} if format else FORMATS
    files = _files(paths, {ending for each in chosen.values() for ending in each.endings})
    return (
        record
        for path, (name, given) in files.items()
        for record in _records(
            Source(path, name if name.isprintable() else ascii(name), objects), chosen, given
        )
    )


def _files(paths: Sequence[Path], endings: set[str]) -> Mapping[Path, tuple[str, bool]]:
    """Return the name of each file in ids, and whether the file itself was given."""
    found: dict[Path, tuple[str, bool]] = {}
    for path in paths:
        if not path.exists():
            raise InputError(f"{path}: there is no such file or folder; give one with records")
        if not path.is_dir():
            found[path] = path.name, True
            continue
        for each in sorted(path.rglob("*")):
            own = each.relative_to(path)
            hidden = any(part.startswith(".") for part in own.parts)
            if each.suffix.lower() in endings and each.is_file() and not hidden:
                found.setdefault(each, (own.as_posix(), False))
    if not found:
        raise InputError(f"no file ends in {', '.join(sorted(endings))}; give files with records")
    differ = len({name for name, _ in found.values()}) == len(found)
    return {path: (name if differ else path.as_posix(), given)
            for path, (name, given) in found.items()}  # fmt: skip


def _records(
    source: Source, chosen: Mapping[str, RecordFormat], given: bool
) -> Iterator[GraspRecord]:
    ending = source.path.suffix.lower()
    try:
        if ending not in CONTENTS:
            raise InputError(f"expected a file that ends in one of {', '.join(CONTENTS)}")
        most, content = CONTENTS[ending]
        found = content(read_bytes(source.path, most))
        if not given and _is_result(found):
            return
        fitting = [each for each in chosen.values() if each.recognises(found, ending)]
        if not fitting:
            raise InputError(
                f"the file is in none of the formats {', '.join(chosen)}; write its grasps as a "
                "table"
            )
        yield from fitting[0].read(found, source)
    except InputError as error:
        yield BadRecord(source.name, str(error))


def _is_result(found: Any) -> bool:
    """Return whether a JSON file is one that graspproof writes, other than poses of hands."""
    if not isinstance(found, dict) or "schema" not in found:
        return False
    return kind_of(cast("dict[str, Any]", found)) not in (None, REACHES)

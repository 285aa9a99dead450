"""Changes rows of a dataset as someone would who also adapts the hashes."""

import dataclasses
import hashlib

from sim_validate.datasets.manifest import listed, read_manifest, write_manifest
from sim_validate.datasets.parquet import parquet_bytes, read_table


def first(where=lambda _: True, **cells):
    """A change of the first row that is as it is looked for."""
    return lambda rows: next(row for row in rows if where(row)).update(cells)


def forged(folder, name, change):
    """Change rows of one table of a dataset, and write the hashes that match.

    The rows are those of the first file in which the change finds what it looks for.
    """
    for path in folder.glob(f"data/{name}/*.parquet"):
        rows = read_table(path, name, read_manifest(folder).tables).to_pylist()
        try:
            change(rows)
        except StopIteration:
            continue
        break
    else:
        raise LookupError(f"no row of {name} is as the change wants it")
    data = parquet_bytes(name, rows, read_manifest(folder).tables)
    path.write_bytes(data)
    manifest, name = read_manifest(folder), path.relative_to(folder).as_posix()
    others = [each for each in manifest.files if each.path != name]
    (entry,) = [each for each in manifest.files if each.path == name]
    changed = dataclasses.replace(
        entry, bytes=len(data), sha256=hashlib.sha256(data).hexdigest(), rows=len(rows)
    )
    write_manifest(folder, dataclasses.replace(manifest, files=(*others, changed)))


def relisted(folder, path, **changes):
    """Write the manifest with the hash that a file has now, and with other changes."""
    manifest = read_manifest(folder)
    kept = [each for each in manifest.files if each.path != path.relative_to(folder).as_posix()]
    files = (*kept, listed(folder, path))
    write_manifest(folder, dataclasses.replace(manifest, files=files, **changes))

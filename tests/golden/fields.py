"""The files of a folder as fields, each a list of values, whatever the format of a file.

A field is named after its file and its path in it, with `*` for the places of a list. Files in one
folder that are named after grasps count as one file, in the order of their names.
"""

import hashlib
import html
import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

ASIDE = re.compile(
    r"(^|\.)versions\.|seconds|\.mujoco$|proof\.sha256$|^files\.\*\.(sha256|bytes)$"
    r"|(^|\.)(\w+_sha256|arithmetic)$"
)
"""Fields that tell of the machine, the moment, or of code; what is hashed is all here."""

NAMED_AFTER_GRASPS = re.compile(r"^([0-9a-f]{16}-[\d.]+-)?[cprfbs]-[\w-]+$")
DIGEST = re.compile(r"\b[0-9a-f]{12,}\b")
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def fields_of(folder, given=()):
    """Return the values of all files but those that were given, by field."""
    found = {}
    paths = sorted(path for path in Path(folder).rglob("*") if path.is_file())
    for path in (path for path in paths if path.name not in given):
        name = path.relative_to(folder).as_posix()
        if NAMED_AFTER_GRASPS.match(path.stem):
            name = path.with_name(f"*{path.suffix}").relative_to(folder).as_posix()
        for field, value in _values(path):
            if not ASIDE.search(field):
                found.setdefault(f"{name} {field}", []).append(value)
    return found


def _values(path):
    """Yield each value of a file with the name of its field."""
    yield from READERS.get(path.suffix, _of_bytes)(path)


def _of_json(path):
    yield from _flat(json.loads(path.read_text()), "")


def _of_table(path):
    from pyarrow import parquet

    yield from _flat(parquet.read_table(path).to_pylist(), "")


def _of_arrays(path):
    with np.load(path) as arrays:
        for name in sorted(arrays):
            yield from _flat(arrays[name].tolist(), re.sub(r"^.*[:/.]", "*.", name))


def _of_elements(path):
    text = re.sub(r"<!--.*?-->", "", path.read_text(), flags=re.DOTALL)
    for element in ET.fromstring(text).iter():  # noqa: S314 -- this project's own files
        tag = element.tag.rpartition("}")[2]
        yield from _words(f"{tag}.text", element.text or "")
        for name, value in element.items():
            yield from _words(f"{tag}.{name}", value)


def _of_text(path):
    text = html.unescape(re.sub(r"<svg.*?</svg>", "", path.read_text(), flags=re.DOTALL))
    yield from _words("text", text)


def _of_bytes(path):
    yield "bytes", hashlib.sha256(path.read_bytes()).hexdigest()


def _flat(value, name):
    if isinstance(value, dict):
        for key, part in value.items():
            yield from _flat(part, f"{name}.{'*' if name.endswith('controls') else key}".strip("."))
    elif isinstance(value, list):
        for part in value:
            yield from _flat(part, f"{name}.*")
    else:
        yield name, value


def _words(name, text):
    """Yield the words of a text and, as another field, its numbers."""
    text = DIGEST.sub("-", text)
    words = NUMBER.sub("#", text).split()
    if words:
        yield name, " ".join(words)
    for number in NUMBER.findall(text):
        yield f"{name} numbers", float(number)


READERS = {
    ".json": _of_json, ".parquet": _of_table, ".npz": _of_arrays, ".xml": _of_elements,
    ".svg": _of_elements, ".html": _of_text, ".md": _of_text, ".yaml": _of_text,
    ".toml": _of_text, ".js": _of_text, ".usda": _of_text,
}  # fmt: skip

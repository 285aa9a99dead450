"""Files changed as people and attackers change them: values, keys and nesting, not only bytes."""

import io
import json
import random
import zipfile
from collections.abc import Callable
from typing import Any

Mutate = Callable[[bytes, int], bytes]
"""Changes bytes, up to a size."""

RAW = (
    "NaN", "-Infinity", "1e999", "-1e999", "-0", "-0.0", "1e-400", "1E3", "0.1e1", "1.0", "01",
    "+1", "9223372036854775807", "9223372036854775808", "18446744073709551616", "9" * 400,
    "9" * 5000,
    "1e308", "2", "-1", "null", "true", "{}", "[]", '""', "[" * 3000, '{"a":' * 300, "[" * 100_000,
    '"\\ud800"', '"\\u0000"', '"\\u001b[2J"', '"../../x"', '"/etc/passwd"', '"a\\nb"',
    '"%s"' % ("x" * 5000), '"\\ud83d\\ude00"', '"0.5"', "[null]", "[1e999]", "[[[]]]",
)  # fmt: skip
"""Values as JSON writes them, or must not."""
TOML_RAW = (
    "nan", "-inf", "1e999", "-0.0", "9223372036854775808", "9" * 5000, "-1", "2", "1.5", "true",
    '""', '"../../x"', '"/etc/passwd"', '"\\u0000"', '"\\u001b[2J"', "[]", "{}", "[[1]]", "{a = 1}",
    "1979-05-27", "07:32:00", "[" * 3000, "[" * 900 + "]" * 900, "0x10", "1_000", "'''a\nb'''",
)  # fmt: skip
MOST_CHANGED = 1e300
"""Larger numbers are left as they are."""
HOLE = "\u2603hole\u2603"
"""Stands in a document where raw text is to be put."""


def json_changed(data: bytes, rng: random.Random) -> bytes | None:
    """A JSON text with some values and keys changed; None where it is none."""
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        return None
    raw: list[str] = []
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        document = _changed(document, rng, raw)
    try:
        text = json.dumps(document)
    except (ValueError, RecursionError):
        return None
    mark = json.dumps(HOLE)
    for value in raw:
        text = text.replace(mark, value, 1)
    if rng.random() < 0.05 and text.startswith("{"):
        text = text[:-1] + "," + text[1:]  # every key twice
    return text.encode()


def _changed(document: Any, rng: random.Random, raw: list[str]) -> Any:
    places = list(_places(document))
    if not places:
        raw.append(rng.choice(RAW))
        return HOLE
    holder, key = rng.choice(places)
    kind = rng.randrange(8)
    value = holder[key]
    if kind <= 2:
        raw.append(rng.choice(RAW))
        holder[key] = HOLE
    elif kind == 3:
        del holder[key]
    elif kind == 4 and isinstance(holder, dict):
        holder[rng.choice([str(key) + "x", "", "schema", "object", "a.b", "\x1b[2J"])] = holder.pop(
            key
        )
    elif kind == 5 and isinstance(holder, list):
        holder.insert(rng.randrange(len(holder) + 1), value)
    elif kind == 6:
        other, place = rng.choice(places)  # the value of another place
        holder[key] = other[place] if not isinstance(other[place], dict | list) else value
    elif isinstance(value, int | float) and abs(value) < MOST_CHANGED:  # truth values, too
        holder[key] = rng.choice([-value, value + 1, value * 1e9, value * (1 + 1e-9), float(value)])
    else:
        holder[key] = [value]
    return document


def _places(document: Any) -> Any:
    """Every value but the document itself, as its holder and key."""
    todo = [document] if isinstance(document, dict | list) else []
    while todo:
        holder = todo.pop()
        keys = holder.keys() if isinstance(holder, dict) else range(len(holder))
        for key in list(keys):
            yield holder, key
            if isinstance(holder[key], dict | list):
                todo.append(holder[key])


def toml_changed(data: bytes, rng: random.Random) -> bytes | None:
    """A TOML text with a line's value changed, or a line twice, gone, or moved."""
    lines = data.decode("utf-8", "replace").split("\n")
    at = rng.randrange(len(lines))
    kind = rng.randrange(6)
    if kind <= 2 and "=" in lines[at]:
        lines[at] = lines[at].split("=", 1)[0] + "= " + rng.choice(TOML_RAW)
    elif kind == 3:
        lines.insert(rng.randrange(len(lines) + 1), lines[at])
    elif kind == 4:
        del lines[at]
    else:
        lines.insert(at, rng.choice(["[a.b]", "[[a]]", "a." * 500 + "a = 1", "x = 1", "[physics]"]))
    return "\n".join(lines).encode()


def npz_changed(data: bytes, rng: random.Random, mutate: Mutate) -> bytes | None:
    """An archive of arrays with a member's bytes changed, or gone, twice, or called otherwise."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = [(each.filename, archive.read(each)) for each in archive.infolist()]
    except Exception:  # whatever a mutated archive makes zipfile raise
        return None
    if not members:
        return None
    at = rng.randrange(len(members))
    name, held = members[at]
    kind = rng.randrange(6)
    if kind == 0:
        del members[at]
    elif kind == 1:
        members.append((name, held))
    elif kind == 2:
        members[at] = (rng.choice(["../" + name, "/" + name, name + "x", "", "a\0b"]), held)
    else:
        head, body = held[:128], held[128:]
        head, body = (mutate(head, 160), body) if kind < 5 else (head, mutate(body, len(body) + 8))
        members[at] = (name, head + body)
    made = io.BytesIO()
    how = rng.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
    with zipfile.ZipFile(made, "w", how) as archive:
        for each, content in members:
            archive.writestr(zipfile.ZipInfo(each), content, how)
    return made.getvalue()

"""Files changed as people and attackers change them: values, keys, words and lines, not bytes."""

import io
import json
import random
import zipfile
from typing import Any

RAW = (
    "NaN", "-Infinity", "1e999", "-1e999", "-0", "-0.0", "1e-400", "1E3", "0.1e1", "1.0", "01",
    "+1", "9223372036854775807", "9223372036854775808", "18446744073709551616", "9" * 400,
    "9" * 5000,
    "1e308", "2", "-1", "null", "true", "{}", "[]", '""', "[" * 3000, '{"a":' * 300, "[" * 100_000,
    '"\\ud800"', '"\\u0000"', '"\\u001b[2J"', '"../../x"', '"/etc/passwd"', '"a\\nb"',
    '"%s"' % ("x" * 5000), '"\\ud83d\\ude00"', '"0.5"', "[null]", "[1e999]", "[[[]]]",
)  # fmt: skip
"""Values as JSON writes them, or must not."""
WORDS = (
    b"nan", b"inf", b"-inf", b"1e999", b"1e308", b"1e-400", b"-0", b"0", b"-1", b"3", b"4", b"99",
    b"4294967295", b"9223372036854775808", b"0.1.2", b"1_0", b"1e", b"1-e3", b"0x1", b"1,5", b"f",
    b"v", b"vn", b"OFF", b"COFF", b"vertex", b"normal", b"solid", b"endsolid", b"facet",
    b"element", b"property", b"list", b"uchar", b"int", b"double", b"1/2/3", b"1//", b"/1", b"#",
    b"\\", b"curv", b"o", b"g", b"l", b"s", b"vertex_index", b"x", b"\xc2\x85", b"\x0c",
    b"\xef\xbb\xbf",
)  # fmt: skip
"""Words that mean something in some mesh file, or look as if they did."""
HOLE = "\u2603hole\u2603"
"""Stands in a document where raw text is to be put."""


def changed(written: str, data: bytes, rng: random.Random) -> bytes | None:
    """An input changed in the way of its kind; None where bytes are to be changed."""
    ways = {
        "json": json_changed,
        "words": words_changed,
        "glb": glb_changed,
        "3mf": archive_changed,
    }
    return ways[written](data, rng) if written in ways and rng.random() < 0.85 else None


def json_changed(data: bytes, rng: random.Random) -> bytes | None:
    """A JSON text with some values and keys changed; None where it is none."""
    raw: list[str] = []
    try:
        document = json.loads(data)
        for _ in range(rng.choice((1, 1, 1, 2, 4))):
            document = _changed(document, rng, raw)
        text = json.dumps(document)
    except (ValueError, RecursionError, OverflowError):
        return None
    for value in raw:
        text = text.replace(json.dumps(HOLE), value, 1)
    if rng.random() < 0.05 and text.startswith("{"):
        text = text[:-1] + "," + text[1:]  # every key twice
    return text.encode()


def _changed(document: Any, rng: random.Random, raw: list[str]) -> Any:
    places = list(_places(document))
    if not places:
        raw.append(rng.choice(RAW))
        return HOLE
    holder, key = rng.choice(places)
    kind, value = rng.randrange(8), holder[key]
    if kind <= 2:
        raw.append(rng.choice(RAW))
        holder[key] = HOLE
    elif kind == 3:
        del holder[key]
    elif kind == 4 and isinstance(holder, dict):
        other = rng.choice([str(key) + "x", "", "schema", "object", "a.b", "\x1b[2J"])
        holder[other] = holder.pop(key)
    elif kind == 5 and isinstance(holder, list):
        holder.insert(rng.randrange(len(holder) + 1), value)
    elif kind == 6:
        other, place = rng.choice(places)  # the value of another place
        holder[key] = other[place] if not isinstance(other[place], dict | list) else value
    elif isinstance(value, int | float):  # truth values, too
        holder[key] = rng.choice([-value, value + 1, value * 1e9, value * (1 + 1e-9), float(value)])
    else:
        holder[key] = [value]
    return document


def _places(document: Any) -> Any:
    """Every value but the document itself, as its holder and key."""
    todo = [document] if isinstance(document, dict | list) else []
    while todo:
        holder = todo.pop()
        for key in list(holder) if isinstance(holder, dict) else range(len(holder)):
            yield holder, key
            if isinstance(holder[key], dict | list):
                todo.append(holder[key])


def words_changed(data: bytes, rng: random.Random) -> bytes | None:
    """A text with a word changed, gone or twice, or a line gone, twice, moved or cut."""
    lines = data.split(b"\n")
    at = rng.randrange(len(lines))
    words, kind = lines[at].split(b" "), rng.randrange(8)
    if kind <= 3:
        place = rng.randrange(len(words))
        words[place : place + rng.randrange(2)] = [rng.choice(WORDS)]
        lines[at] = b" ".join(words)
    elif kind == 4:
        lines.insert(rng.randrange(len(lines) + 1), lines[at])
    elif kind == 5:
        del lines[at]
    elif kind == 6:
        lines[at : at + 1] = [b" ".join(words[:1]), b" ".join(words[1:])]
    else:
        lines.append(lines.pop(at))
    return rng.choice([b"\n", b"\n", b"\n", b"\r\n", b"\r"]).join(lines)


def glb_changed(data: bytes, rng: random.Random) -> bytes | None:
    """A GLB with its tree changed, and all lengths as they must be."""
    if len(data) < 20:
        return None
    size = int.from_bytes(data[12:16], "little")
    tree = json_changed(data[20 : 20 + size], rng)
    if tree is None:
        return None
    tree += b" " * (-len(tree) % 4)
    rest = len(tree).to_bytes(4, "little") + b"JSON" + tree + data[20 + size :]
    return data[:8] + (12 + len(rest)).to_bytes(4, "little") + rest


XML_WORDS = (
    b"", b"2", b"3", b"inch", b"model", b"other", b"&#48;", b"&a;", b"<", b">", b"1 0 0 0 1",
    b"1 0 0 0 1 0 0 0 1 5 0 0", b"0 0 0 0 0 0 0 0 0 0 0 0",
)  # fmt: skip
"""Values of attributes in 3MF files, besides `WORDS`."""


def archive_changed(data: bytes, rng: random.Random) -> bytes | None:
    """An archive with some XML changed: a value, or a tag gone, twice or moved."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            parts = {name: archive.read(name) for name in archive.namelist()}
    except Exception:  # no archive any more
        return None
    name = rng.choice(list(parts))
    for _ in range(rng.choice((1, 1, 2, 4))):
        values, tags = parts[name].split(b'"'), parts[name].split(b"<")
        kind, at = rng.randrange(6), rng.randrange(len(tags))
        if kind <= 2:
            place = rng.randrange(len(values) // 2 + 1) * 2 - 1
            values[place] = rng.choice(XML_WORDS + WORDS)
            parts[name] = b'"'.join(values)
            continue
        if kind == 3:
            tags.insert(rng.randrange(len(tags) + 1), tags[at])
        elif kind == 4:
            del tags[at]
        else:
            tags.append(tags.pop(at))
        parts[name] = b"<".join(tags)
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w") as archive:
        for name, text in parts.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return held.getvalue()

"""Mesh files changed by words, or by their trees, so that most stay readable."""

import random

from tests.fuzzing.mutations import json_changed

WORDS = (
    b"nan", b"inf", b"-inf", b"1e999", b"1e308", b"1e-400", b"-0", b"0", b"-1", b"3", b"4", b"99",
    b"4294967295", b"9223372036854775808", b"0.1.2", b"1_0", b"1e", b"1-e3", b"0x1", b"1,5", b"f",
    b"v", b"vn", b"OFF", b"COFF", b"vertex", b"normal", b"solid", b"endsolid", b"facet",
    b"element", b"property", b"list", b"uchar", b"int", b"double", b"1/2/3", b"1//", b"/1", b"#",
    b"\\", b"curv", b"o", b"g", b"l", b"s", b"vertex_index", b"x", b"\xc2\x85", b"\x0c",
    b"\xef\xbb\xbf",
)  # fmt: skip
"""Words that mean something in some mesh file, or look as if they did."""


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

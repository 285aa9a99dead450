"""trimesh's reading of mesh files, as a judge of ours: what it reads without complaint must agree.

Its text readers know no comments amid lines and no lines that go on, so that they are given words
with one space between them. What it is known to misread is left out, each by a rule of its own.
"""

import io
import re
import warnings

import numpy as np
from trimesh.exchange.load import load_scene

COMMENT = re.compile(rb"#[^\n]*")


def tidied(kind, data):
    """Text as words with one space between them; binary data as it is."""
    if kind not in {"obj", "off"}:
        return data
    text = data.removeprefix(b"\xef\xbb\xbf").translate(bytes(range(128)) + b"?" * 128)
    text = COMMENT.sub(b"", text.replace(b"\r\n", b"\n").replace(b"\r", b"\n"))
    if kind == "obj":
        text = text.replace(b"\\\n", b"")
    return b"\n".join(b" ".join(line.split()) for line in text.split(b"\n"))


def by_trimesh(kind, data):
    """Triangles of three points (t, 3, 3); None where trimesh finds none or complains."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            scene = load_scene(
                io.BytesIO(tidied(kind, data)), file_type=kind, process=False, skip_materials=True
            )
            whole = scene.to_mesh() if scene.geometry else None
            found = np.asarray(whole.vertices, dtype=float)[np.asarray(whole.faces)]
    except Exception:  # its parsers raise whatever the bytes lead them to
        return None
    return found if np.isfinite(found).all() and len(found) else None


def is_misread(kind, data):
    """Whether trimesh is known to take the file for another without a complaint."""
    text = tidied("obj", data)
    if kind != "glb" and re.search(rb"[\x0b\x0c]", data):
        return True  # they end a line there
    if kind == "obj":
        return _relative_amid_the_file(text) or _of_differing_forms(text)
    if kind == "stl":
        lines = [line.lower().split() for line in text.split(b"\n")]
        names = b" ".join(b" ".join(line[1:]) for line in lines if line[:1] != [b"vertex"])
        parted = any(b"vertex" in line and len(line) != 4 for line in lines)
        said = names + b" ".join(COMMENT.findall(data.lower()))
        return parted or b"vertex" in said or b"solid" in said
    return False


def _relative_amid_the_file(text):
    """trimesh counts relative corners back from the last vertex of the file."""
    lines = [line.split() for line in text.split(b"\n")]
    above, whole = 0, sum(line[:1] == [b"v"] for line in lines)
    for line in lines:
        above += line[:1] == [b"v"]
        if line[:1] == [b"f"] and above < whole and any(word[:1] == b"-" for word in line[1:]):
            return True
    return False


def _of_differing_forms(text):
    """trimesh reads the corners of a face such as `f 1 2/3/4 5` as if all were of one form."""
    faces = [line.split()[1:] for line in text.split(b"\n") if line.split()[:1] == [b"f"]]
    return any(len({re.sub(rb"[+-]?\d+", b"1", word) for word in face}) > 1 for face in faces)

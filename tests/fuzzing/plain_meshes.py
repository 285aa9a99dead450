"""Mesh files read once more, in the plainest way: lists of triangles of three points."""

import io
import json
import math
import re
import struct
import zipfile
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

Point = tuple[float, float, float]
Triangle = tuple[Point, Point, Point]


def unmarked(data):
    """Bytes without their byte-order mark, in UTF-8."""
    if data[:2] in {b"\xff\xfe", b"\xfe\xff"}:
        return data.decode("utf-16", "replace").encode()
    return data[3:] if data[:3] == b"\xef\xbb\xbf" else data


def text_of(data):
    """Text of which only ASCII means anything, with the line ends of any system, as `\n`.

    The `#` of `1.#QNAN` is that of a number.
    """
    text = "".join(chr(byte) if byte < 128 else "?" for byte in unmarked(data))
    text = text.rstrip("\0\x1a").replace(".#", ".?")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def fan(corners):
    return [(corners[0], corners[i], corners[i + 1]) for i in range(1, len(corners) - 1)]


def of_obj(data: bytes) -> list[Triangle]:
    points, corners = [], []
    lines = re.sub("#[^\n]*", "", text_of(data)).replace("\\\n", "").split("\n")
    for words in (line.split() for line in lines):
        if words[:1] == ["v"]:
            points.append(tuple(map(float, words[1:4])))
        elif words[:1] == ["f"]:
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            corners.append([n - 1 if n > 0 else len(points) + n for n in numbers])
    assert all(n >= 0 for each in corners for n in each)
    return [each for face in corners for each in fan([points[n] for n in face])]


def of_stl(data: bytes) -> list[Triangle]:
    if len(data) != 84 + 50 * int.from_bytes(data[80:84], "little"):
        data = unmarked(data)
    count = int.from_bytes(data[80:84], "little")
    if len(data) == 84 + 50 * count:
        rows = [struct.unpack_from("<12f", data, 84 + 50 * i)[3:] for i in range(count)]
        return [(row[:3], row[3:6], row[6:]) for row in rows]
    words = []
    for line in re.sub("#[^\n]*", "", text_of(data).lower()).split("\n"):
        before, _, _ = line.partition("endsolid")
        words += [] if line.split() and line.split()[0][:5] == "solid" else before.split()
    places = [i for i, word in enumerate(words) if word == "vertex"]
    points = [tuple(map(float, words[i + 1 : i + 4])) for i in places]
    assert len(points) % 3 == 0
    return [tuple(points[i : i + 3]) for i in range(0, len(points), 3)]


def of_off(data: bytes) -> list[Triangle]:
    lines = [line.split("#")[0].split() for line in text_of(data).split("\n")]
    lines = [line for line in lines if line]
    head = [word for word in [re.sub("^[A-Za-z]*", "", lines[0][0]), *lines[0][1:]] if word]
    rows = lines[1:] if head else lines[2:]
    head = head or lines[1]
    vertices, faces = int(head[0]), int(head[1])
    points = [tuple(map(float, row[:3])) for row in rows[:vertices]]
    assert len(rows) == vertices + faces
    indices = [[int(word) for word in row[1 : 1 + int(row[0])]] for row in rows[vertices:]]
    assert all(n >= 0 for row in indices for n in row)
    return [each for row in indices for each in fan([points[n] for n in row])]


PLY_CODES = {
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f",
    "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "float32": "f", "float64": "d", "int64": "q", "uint64": "Q", "float16": "e",
}  # fmt: skip


def number(word):
    """Of a word; nan in a column that is not used, or the file would be refused."""
    try:
        return float(word)
    except ValueError:
        return math.nan


def of_ply(data: bytes) -> list[Triangle]:
    data = unmarked(data)
    ended = re.search(rb"\n[ \t]*end_header[ \t]*\r?\n|\r[ \t]*end_header[ \t]*\r", data)
    header = [line.split() for line in data[: ended.start()].decode("latin-1").splitlines()]
    body, kind = data[ended.end() :], next(w[1] for w in header if w[:1] == ["format"])
    words = re.sub(rb"#[^\n]*", b"", body.rstrip(b"\0\x1a")).split()
    place = 0

    def one(code):
        nonlocal place
        if kind == "ascii":
            place += 1
            word = words[place - 1]
            value = number(word)
            return struct.unpack(code, struct.pack(code, value))[0] if code in "ef" else value
        form = ("<" if kind == "binary_little_endian" else ">") + code
        place += struct.calcsize(form)
        return struct.unpack_from(form, body, place - struct.calcsize(form))[0]

    points, triangles = [], []
    elements = []
    for line in header:
        if line[:1] == ["element"]:
            elements.append((line[1], int(line[2]), []))
        elif line[:1] == ["property"]:
            elements[-1][2].append(line[1:])
    for name, count, properties in elements:
        for _ in range(count):
            row = {}
            for said in properties:
                code = PLY_CODES[said[-2]]
                if said[0] == "list":
                    row[said[-1]] = [one(code) for _ in range(int(one(PLY_CODES[said[1]])))]
                else:
                    row[said[-1]] = one(code)
            if name == "vertex":
                points.append((row["x"], row["y"], row["z"]))
            elif name == "face":
                corners = row.get("vertex_indices", row.get("vertex_index"))
                assert all(n >= 0 for n in corners)
                triangles += fan([int(n) for n in corners])
    assert place == (len(words) if kind == "ascii" else len(body))
    return [tuple(points[n] for n in each) for each in triangles]


def of_glb(data: bytes) -> list[Triangle]:
    size = struct.unpack_from("<I", data, 12)[0]
    tree, binary = json.loads(data[20 : 20 + size]), data[28 + size :]
    found = []

    def row(number, i, code, count):
        accessor = tree["accessors"][number]
        view = tree["bufferViews"][accessor["bufferView"]]
        width = struct.calcsize("<" + code) * count
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        assert 0 <= i < accessor["count"]
        return struct.unpack_from(
            f"<{count}{code}", binary, start + i * view.get("byteStride", width)
        )

    def primitive(given, place):
        position = given["attributes"]["POSITION"]
        count = tree["accessors"][position]["count"]
        if "indices" in given:
            number = given["indices"]
            code = {5121: "B", 5123: "H", 5125: "I"}[tree["accessors"][number]["componentType"]]
            order = [row(number, i, code, 1)[0] for i in range(tree["accessors"][number]["count"])]
        else:
            order = list(range(count))
        points = [place(row(position, n, "f", 3)) for n in order]
        if given.get("mode", 4) == 5:
            strips = [points[i : i + 3] for i in range(len(points) - 2)]
            return [tuple(t) if i % 2 == 0 else (t[1], t[0], t[2]) for i, t in enumerate(strips)]
        assert len(points) % 3 == 0
        return [tuple(points[i : i + 3]) for i in range(0, len(points), 3)]

    def node(number, above):
        given = tree["nodes"][number]
        here = above @ matrix_of(given)
        if "mesh" in given:
            for each in tree["meshes"][given["mesh"]]["primitives"]:
                made = primitive(each, lambda point: tuple((here @ (*point, 1.0))[:3].tolist()))
                mirrored = np.linalg.det(here[:3, :3]) < 0
                found.extend([t[::-1] for t in made] if mirrored else made)
        for child in given.get("children", []):
            node(child, here)

    for root in tree["scenes"][tree.get("scene", 0)].get("nodes", []):
        node(root, np.eye(4))
    return found


def matrix_of(node):
    """Where a node puts what is below it, (4, 4)."""
    if "matrix" in node:
        return np.reshape(node["matrix"], (4, 4)).T
    made = np.eye(4)
    made[:3, :3] = Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix()
    made[:3, :3] *= node.get("scale", (1, 1, 1))
    made[:3, 3] = node.get("translation", (0, 0, 0))
    return made


def of_3mf(data: bytes) -> list[Triangle]:
    core = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = {name.lower(): name for name in archive.namelist()}
        named = "3d/3dmodel.model"
        if "_rels/.rels" in parts:
            relations = ElementTree.fromstring(archive.read(parts["_rels/.rels"]))  # noqa: S314
            (relation,) = (r for r in relations.iter() if r.get("Type", "").endswith("/3dmodel"))
            named = relation.get("Target").removeprefix("/").lower()
        # the reader has refused entities before
        root = ElementTree.fromstring(archive.read(parts[named]))  # noqa: S314
    objects = {int(each.get("id")): each for each in root.iter(f"{core}object")}
    found = []

    def placed(said, above):
        rows = np.eye(4)
        if said.get("transform") is not None:
            rows[:, :3] = np.reshape([float(x) for x in said.get("transform").split()], (4, 3))
        here, given = rows @ above, objects[int(said.get("objectid"))]
        points = [
            tuple((np.array([*(float(each.get(axis)) for axis in "xyz"), 1.0]) @ here)[:3].tolist())
            for each in given.findall(f"{core}mesh/{core}vertices/{core}vertex")
        ]
        for each in given.findall(f"{core}mesh/{core}triangles/{core}triangle"):
            corners = [int(each.get(name)) for name in ("v1", "v2", "v3")]
            assert min(corners) >= 0
            made = tuple(points[n] for n in corners)
            found.append(made[::-1] if np.linalg.det(here[:3, :3]) < 0 else made)
        for part in given.findall(f"{core}components/{core}component"):
            placed(part, here)

    for item in root.findall(f"{core}build/{core}item"):
        placed(item, np.eye(4))
    return found


PLAIN = {"obj": of_obj, "stl": of_stl, "off": of_off, "ply": of_ply, "glb": of_glb, "3mf": of_3mf}

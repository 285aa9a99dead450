"""What is written is what is read, in every format and style; what is damaged is refused."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.mesh_files import glb as glb_files
from grasp_core.mesh_files import threemf as threemf_files
from grasp_core.mesh_files.limits import MeshLimits
from grasp_core.mesh_files.polygons import TextPoints
from grasp_core.mesh_files.reading import read_triangles
from tests.bad_input.mesh_texts import CORNERS, TRIANGLES, off, ply, ply_binary, stl, stl_text
from tests.bad_input.mesh_texts import obj as obj_text
from tests.bad_input.of_binary_meshes import glb, tree
from tests.bad_input.of_threemf import threemf
from tests.fuzzing.mesh_files import same_triangles, triangles_of

MOST = 1000
SINGLE = st.floats(-1e3, 1e3, width=32).map(float)
DOUBLE = st.floats(-1e30, 1e30)


@st.composite
def meshes(draw, number=SINGLE):
    count = draw(st.integers(3, 9))
    points = draw(st.lists(st.tuples(number, number, number), min_size=count, max_size=count))
    corner = st.integers(0, count - 1)
    return points, draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=9))


@st.composite
def obj_texts(draw):
    """A mesh, and an OBJ text of it in some style."""
    points, faces = draw(meshes(DOUBLE))
    form = draw(st.sampled_from(["{!r}", "{:.17e}", "{:+.17g}", "{:.17G}"]))
    gap = draw(st.sampled_from([" ", "  ", "\t", " \t "]))
    end = draw(st.sampled_from(["\n", "\r\n", " \n", "\n\n", "\n# a comment\n"]))
    after = draw(st.sampled_from(["", "/1", "//2", "/3/4"]))
    colour = draw(st.sampled_from(["", " 1.0", " 0.5 0.5 0.5"]))
    lines = ["mtllib a.mtl", "o part"]
    lines += ["v" + gap + gap.join(map(form.format, point)) + colour for point in points]
    lines += ["f" + gap + gap.join(f"{i + 1}{after}" for i in face) for face in faces]
    return (points, faces), (end.join(lines) + draw(st.sampled_from(["", end]))).encode()


def exact(kind, data, points, faces):
    found, corners = triangles_of(kind, data, MOST)
    assert found[corners].tolist() == [[list(points[i]) for i in face] for face in faces]


@settings(max_examples=60)
@given(obj_texts())
def test_obj_in_any_style(case):
    (points, faces), text = case
    exact("obj", text, points, faces)


PRISM = """\
%s
%s
0 0 0
4 0 0
5 2 0 %s
2 4 0
-1 2 0
0 0 1 # a comment
4 0 1

5 2 1
2 4 1
-1 2 1
5 4 3 2 1 0
5 5 6 7 8 9 %s
4 0 1 6 5
4 1 2 7 6
4 2 3 8 7
3 3 4 9
3 3 9 8
4 4 0 5 9
"""
"""On a pentagon, with counts, the rest of a vertex's line and that of a face's to fill in."""


@pytest.mark.parametrize(
    "style",
    [
        ("OFF", "10 8 15", "", ""),
        ("OFF 10 8 15", "", "", ""),
        ("# by hand\nOFF", "# vertices, faces\n10 8", "", ""),
        ("COFF", "10 8 0", "255 0 0 255", ""),
        ("OFF", "10 8 0", "", "0.5 0.5 0.5"),
    ],
)
def test_off_of_polygons_in_any_style(style, tmp_path):
    """The area of the pentagon is 16."""
    path = tmp_path / "prism.off"
    path.write_text(PRISM % style)
    body = gc.load_polyhedron(path)
    assert len(body.faces) == 7
    assert body.volume == pytest.approx(16.0, rel=1e-12)


@settings(max_examples=30)
@given(meshes())
def test_both_kinds_of_stl(mesh):
    exact("stl", stl(*mesh), *mesh)
    exact("stl", stl_text(*mesh).encode(), *mesh)


@settings(max_examples=30)
@given(meshes(DOUBLE))
def test_off(mesh):
    points, faces = mesh
    exact("off", off(f"{len(points)} {len(faces)} 0", points, faces).encode(), points, faces)


@settings(max_examples=30)
@given(meshes(), st.sampled_from(["ascii", "binary_little_endian", "binary_big_endian"]))
def test_ply_of_every_kind(mesh, form):
    points, faces = mesh
    order = ">" if "big" in form else "<"
    rows = [struct.pack(order + "3f", *point) for point in points]
    rows += [struct.pack(order + "B3i", 3, *face) for face in faces]
    if form == "ascii":
        texts = [" ".join(map(repr, each)) for each in points]
        texts += [" ".join(map(str, (3, *each))) for each in faces]
        rows = [("\n".join(texts) + "\n").encode()]
    data = ply(len(points), len(faces), form=form, body=b"".join(rows))
    exact("ply", data, points, faces)


UNIT = st.floats(-1.0, 1.0).filter(lambda x: abs(x) > 1e-3)


@settings(max_examples=30)
@given(st.lists(UNIT, min_size=10, max_size=10), st.booleans())
def test_glb_with_nodes_that_move_turn_stretch_and_mirror(numbers, nested):
    turn = np.array(numbers[:4]) / np.linalg.norm(numbers[:4])
    node = {"rotation": turn.tolist(), "translation": numbers[4:7], "scale": numbers[7:]}
    moved = {"nodes": [{**node, "children": [1]}, {**node, "mesh": 0}]} if nested else {}
    data = glb({**tree(), "nodes": [{**node, "mesh": 0}], **moved})
    same_triangles("glb", data, triangles_of("glb", data, MOST))


FILES = {
    "obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
    "off": off().encode(),
    "ply": ply(),
    "stl": stl_text().encode(),
}
ALL_FILES = {**FILES, "glb": glb(tree()), "3mf": threemf()}


@pytest.mark.parametrize("kind", FILES)
@settings(max_examples=80)
@given(data=st.data())
def test_a_word_that_is_damaged_is_refused_or_read_as_it_is(kind, data):
    """By the plain reading of the fuzzer, which knows nothing of ours."""
    words = FILES[kind].split(b" ")
    place = data.draw(st.integers(0, len(words) - 1))
    odd = b"|nan|-1|1e999|9|0.5|1_0|1e|\x0c|1/|--1|\xa0".split(b"|")
    words[place] = data.draw(st.sampled_from(odd))
    text = b" ".join(words)
    try:
        found = triangles_of(kind, text, MOST)
    except gc.MeshError:
        return
    same_triangles(kind, text, found)


@pytest.mark.parametrize("kind", ALL_FILES)
def test_a_file_cut_anywhere_is_never_read_as_another_whole(kind):
    whole = ALL_FILES[kind]
    refused = 0
    for size in range(len(whole)):
        try:
            found = triangles_of(kind, whole[:size], MOST)
        except gc.MeshError:
            refused += 1
            continue
        same_triangles(kind, whole[:size], found)
    assert refused > 0.5 * len(whole)


WHOLE = [[list(CORNERS[i]) for i in face] for face in TRIANGLES]
LINES = obj_text().split("\n")
"""Four vertices, four faces and nothing."""
AMID = [*LINES[:3], "v 9 9 9", "f -4 -2 -3", LINES[3], "f 1 2 5", "f 1 5 3", "f 2 3 5", ""]
MIXED_FACES = (
    struct.pack("<B4i", 4, 0, 2, 3, 1) + struct.pack("<B3i", 3, 0, 1, 4)
    + struct.pack("<B3i", 3, 1, 3, 4) + struct.pack("<B3i", 3, 3, 2, 4)
    + struct.pack("<B3i", 3, 2, 0, 4)
)  # fmt: skip
"""A pyramid on a square."""
MIXED_POINTS = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 0, 1))
LISTED_VERTICES = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty list uchar uchar seen\n"
    b"property float x\nproperty float y\nproperty float z\nelement face 4\n"
    b"property list uchar int vertex_indices\nend_header\n"
)
MARK = b"\xef\xbb\xbf"
COLOURED = off().replace("OFF", "COFF")


def coloured(values):
    """An OBJ text with values behind each vertex."""
    return "\n".join(f"{line} {values}" if line[:1] == "v" else line for line in LINES)


def ply_coloured(value):
    """A PLY text with one more column of vertices."""
    text = ply().decode().replace("float z\n", "float z\nproperty float red.1\n")
    head, rows = text.split("end_header\n")
    rows = [f"{row} {value}" if i < 4 else row for i, row in enumerate(rows.split("\n"))]
    return head + "end_header\n" + "\n".join(rows)


RIGHT = {
    "an OBJ with colours of nan": ("obj", coloured("nan nan nan")),
    "an OBJ with colours of nan, as old Windows does": ("obj", coloured("1.#QNAN -1.#IND 1.#INF")),
    "an OBJ with four numbers of a colour": ("obj", coloured("0.5 0.5 0.5 1")),
    "an OBJ with comments of C": ("obj", "// by hand\n; v 1 2 3\n" + obj_text()),
    "an OBJ with form feeds": ("obj", obj_text().replace("f 1 3", "\f\nf 1\v3")),
    "an OBJ with an end mark": ("obj", obj_text() + "\x1a"),
    "an OBJ in UTF-16": ("obj", obj_text().encode("utf-16")),
    "a binary STL whose header is a mark and solid": ("stl", stl(head=MARK + b"solid")),
    "an STL with comments": ("stl", "# solid 1\n\n# b\n" + stl_text().replace("\nv", " # c\nv")),
    "an STL with the name against its word": ("stl", stl_text().replace("solid ", "solid")),
    "an STL without the word normal": ("stl", stl_text().replace(" normal 0 0 0", "")),
    "an OFF with a mark": ("off", MARK + off().encode()),
    "an OFF with a mark, the word against its counts": (
        "off", MARK + COLOURED.replace("OFF\n", "OFF").replace("\n", "\r\n").encode()),
    "an OFF with colours of nan": ("off", COLOURED.replace(" 0.0\n", " 0.0 nan -nan(ind) inf\n")),
    "a binary PLY with a mark": (
        "ply", MARK + ply(form="binary_little_endian", body=ply_binary())),
    "a PLY with the line ends of old": ("ply", ply().replace(b"\n", b"\r")),
    "a binary PLY with the line ends of old": (
        "ply", ply(form="binary_little_endian", body=b"").replace(b"\n", b"\r") + ply_binary()),
    "a PLY with spaces before its lines": ("ply", ply().replace(b"\n", b"\n ")),
    "a PLY with colours of nan": ("ply", ply_coloured("-nan(ind)")),
    "a PLY with corners of 64 bits": ("ply", ply().replace(b"uchar int", b"uint64 int64")),
    "a PLY with a table of no columns": (
        "ply", ply().replace(b"element face", b"element edge 0\nelement face")),
    "relative corners amid an OBJ": ("obj", "\n".join(AMID)),
    "corners with a plus sign": ("obj", obj_text().replace("f 1 3 2", "f +1 +3 +2")),
    "OBJ faces before their vertices": ("obj", "\n".join([*LINES[4:], *LINES[:4]])),
    "corners of differing forms": ("obj", obj_text().replace("f 1 3 2", "f 1/1 3 2//7")),
    "a comment that ends in a backslash": ("obj", "# in C:\\\no a\n" + obj_text()),
    "an OFF comment that ends in a backslash": ("off", off().replace("OFF", "OFF # in C:\\")),
    "an OFF with normals": (
        "off", off().replace("OFF", "NOFF").replace(" 0.1\n", " 0.1 1 0 0\n")),
    "an STL that is called solid": ("stl", stl_text().replace("hand", "endsolid solid facet")),
    "an STL without normals": ("stl", stl_text().replace("normal 0 0 0", "normal")),
    "STL words in other lines": (
        "stl", stl_text().replace("\nouter", " outer").replace("endloop\n", "endloop ")),
    "vertices with lists that differ": (
        "ply",
        LISTED_VERTICES
        + b"".join(bytes([i, *[7] * i]) + struct.pack("<3f", *CORNERS[i]) for i in range(4))
        + b"".join(struct.pack("<B3i", 3, *face) for face in TRIANGLES),
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", RIGHT)
def test_what_is_right_by_its_format_is_read_as_it_says(case):
    kind, text = RIGHT[case]
    data = text if isinstance(text, bytes) else text.encode()
    points, corners = triangles_of(kind, data, MOST)
    same_triangles(kind, data, (points, corners))
    found = sorted(points[corners].tolist())
    if kind == "ply" or "binary" in case:
        np.testing.assert_array_equal(found, sorted(np.float32(WHOLE).tolist()))
    else:
        assert found == sorted(WHOLE)


def test_binary_ply_faces_may_differ_in_their_numbers_of_corners():
    rows = b"".join(struct.pack("<3f", *point) for point in MIXED_POINTS)
    data = ply(5, 5, form="binary_little_endian", body=rows + MIXED_FACES)
    points, corners = triangles_of("ply", data, MOST)
    assert corners.tolist() == [[0, 2, 3], [3, 1, 0], [0, 1, 4], [1, 3, 4], [3, 2, 4], [2, 0, 4]]
    same_triangles("ply", data, (points, corners))
    for size in range(len(data)):
        with pytest.raises(gc.MeshError):
            triangles_of("ply", data[:size], MOST)


@pytest.mark.parametrize("kind", ALL_FILES)
def test_bytes_and_triangles_are_bounded_by_their_limits(kind, tmp_path):
    path = tmp_path / f"part.{kind}"
    data = ALL_FILES[kind]
    path.write_bytes(data)
    room = max(len(data), 1000)  # unpacked, a 3MF file is longer
    just = MeshLimits(max_mesh_bytes=room, max_triangles=4)
    mesh = read_triangles(path, just)
    assert (len(mesh.triangles), mesh.data) == (4, data)
    assert np.isfinite(mesh.vertices).all()
    for flag, most in (("max-mesh-bytes", len(data) - 1), ("max-triangles", 3)):
        with pytest.raises(gc.MeshError, match=rf"part\.{kind}: .*limit.*--{flag}") as caught:
            read_triangles(path, MeshLimits(**{flag.replace("-", "_"): most}))
        assert caught.value.reason is MeshRefusal.TOO_MANY


def test_too_little_memory_is_a_refusal(tmp_path, monkeypatch):
    def full(*_):
        raise MemoryError

    held = {
        "obj": (TextPoints, "add"),
        "glb": (glb_files, "_scene"),
        "3mf": (threemf_files, "_parse"),
    }
    for kind, (patched, name) in held.items():
        path = tmp_path / f"part.{kind}"
        path.write_bytes(ALL_FILES[kind])
        with monkeypatch.context() as short:
            short.setattr(patched, name, full)
            with pytest.raises(gc.MeshError, match=rf"part\.{kind}: .*memory") as caught:
                gc.load_polyhedron(path)
        assert caught.value.reason is MeshRefusal.LIMIT

"""What is written is what is read, in every format and style; what is damaged is refused."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import grasp_core as gc
from grasp_core.mesh_files.reading import triangles_of
from tests.bad_input.mesh_texts import off, ply, stl, stl_text
from tests.bad_input.of_binary_meshes import glb, tree
from tests.fuzzing.mesh_files import same_triangles

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


def test_off_with_a_line_too_many_or_too_few_is_still_refused(tmp_path):
    path, refused = tmp_path / "prism.off", 0
    for counts in ("10 7 0", "10 9 0", "9 8 0", "11 8 0"):
        path.write_text(PRISM % ("OFF", counts, "", ""))
        with pytest.raises(gc.MeshError, match=r"line|end"):
            gc.load_polyhedron(path)
        refused += 1
    assert refused == 4


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


@pytest.mark.parametrize("kind", FILES)
@settings(max_examples=150)
@given(data=st.data())
def test_a_word_that_is_damaged_is_refused_or_read_as_it_is(kind, data):
    """By the plain reading of the fuzzer, which knows nothing of ours."""
    words = FILES[kind].split(b" ")
    place = data.draw(st.integers(0, len(words) - 1))
    odd = [
        b"",
        b"nan",
        b"-1",
        b"1e999",
        b"9",
        b"0.5",
        b"1_0",
        b"1e",
        b"\x0c",
        b"1/",
        b"--1",
        b"\xa0",
    ]
    words[place] = data.draw(st.sampled_from(odd))
    text = b" ".join(words)
    try:
        found = triangles_of(kind, text, MOST)
    except gc.MeshError:
        return
    same_triangles(kind, text, found)


@pytest.mark.parametrize("kind", [*FILES, "glb"])
def test_a_file_cut_anywhere_is_never_read_as_another_whole(kind):
    whole = FILES.get(kind) or glb(tree())
    refused = 0
    for size in range(len(whole)):
        try:
            found = triangles_of(kind, whole[:size], MOST)
        except gc.MeshError:
            refused += 1
            continue
        same_triangles(kind, whole[:size], found)
    assert refused > 0.5 * len(whole)

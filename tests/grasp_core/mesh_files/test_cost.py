"""Reading costs time and memory in proportion to a file's bytes, whatever stands in it."""

import contextlib
import time
import tracemalloc

import pytest

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.mesh_files.reading import mesh_of_bytes
from tests.bad_input.mesh_texts import off, ply
from tests.bad_input.of_binary_meshes import changed
from tests.grasp_core.mesh_files.hostile import FILES

MOST = 20_000
SMALL, TIMES = 2**12, 16
SLOWEST_GROWTH = 4 * TIMES
"""Linear time grows by 16, quadratic time by 256; between them lies a factor of four both ways."""
SHORTEST_S = 1e-4
"""Shorter times count as this one: they are mostly those of the clock and of Python itself."""
BILLIONS = {
    "off vertices": ("off", off("4000000000 4 6").encode()),
    "off faces": ("off", off("4 4000000000 6").encode()),
    "off corners": ("off", off().replace("3 0 2 1", "4000000000 0 2 1").encode()),
    "stl": ("stl", bytes(80) + b"\xff\xff\xff\xee" + bytes(16)),
    "ply text vertices": ("ply", ply(vertices=4_000_000_000)),
    "ply text corners": ("ply", ply().replace(b"3 0 2 1", b"4000000000 0 2 1")),
    "ply vertices": ("ply", ply(vertices=4_000_000_000, form="binary_little_endian")),
    "ply faces": ("ply", ply(faces=4_000_000_000, form="binary_big_endian", body=bytes(99))),
    "ply corners": (
        "ply",
        ply(form="binary_little_endian", body=bytes(48) + b"\xff" * 99).replace(b"uchar", b"uint"),
    ),
    "glb numbers": ("glb", changed("accessors.0.count", 4_000_000_000)),
    "glb corners": ("glb", changed("accessors.1.count", 4_000_000_000)),
    "glb stride": ("glb", changed("bufferViews.0.byteStride", 4_000_000_000)),
}


def seconds(kind, data):
    """The processor time of one reading, in which other processes do not count."""
    begun = time.process_time()
    with contextlib.suppress(gc.MeshError):
        mesh_of_bytes(kind, data, MOST)
    return time.process_time() - begun


@pytest.mark.parametrize("name", FILES)
def test_time_grows_as_bytes_do(name):
    """One of three readings of the large file, as caches are shared with other processes."""
    kind, make = name.partition(":")[0], FILES[name]
    small, large = make(SMALL), make(TIMES * SMALL)
    before = max(SHORTEST_S, min(seconds(kind, small) for _ in range(5)))
    assert any(seconds(kind, large) < SLOWEST_GROWTH * before for _ in range(3))


@pytest.mark.parametrize("case", BILLIONS)
def test_announced_billions_are_refused_before_they_are_allocated(case):
    kind, data = BILLIONS[case]
    with pytest.raises(gc.MeshError):
        mesh_of_bytes(kind, data, MOST)  # imports, and tables of regular expressions
    tracemalloc.start()
    with pytest.raises(gc.MeshError) as caught:
        mesh_of_bytes(kind, data, 10**10)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert caught.value.reason is MeshRefusal.UNREADABLE
    assert peak < 2**18


def test_parts_of_a_glb_share_vertices_without_copies_of_them():
    """Each part keeps the vertices of its own triangle only."""
    data = FILES["glb: parts among shared vertices"](2**17)
    mesh = mesh_of_bytes("glb", data, MOST)
    assert len(mesh.triangles) > 1000
    assert len(mesh.vertices) <= 3 * len(mesh.triangles)


def test_a_json_part_of_millions_of_values_is_refused_before_it_is_parsed():
    data = FILES["glb: empty lists"](13 * 2**20)
    tracemalloc.start()
    with pytest.raises(gc.MeshError, match="values, the limit") as caught:
        mesh_of_bytes("glb", data, MOST)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert caught.value.reason is MeshRefusal.TOO_MANY
    assert peak < 2 * len(data)

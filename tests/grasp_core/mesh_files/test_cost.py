"""Reading costs work and memory in proportion to a file's bytes, whatever stands in it."""

import contextlib
import tracemalloc

import pytest

import grasp_core as gc
from grasp_core.errors import MeshRefusal
from grasp_core.mesh_files.reading import mesh_of_bytes
from tests.bad_input.mesh_texts import off, ply
from tests.bad_input.of_binary_meshes import changed
from tests.bad_input.of_threemf import ARCHIVES
from tests.grasp_core.mesh_files.hostile import FILES
from tests.work import calls_of

MOST = 20_000
SMALL, TIMES = 2**12, 16
MOST_GROWTH = 2 * TIMES
"""Linear work grows by 16, quadratic work by 256; small files need some calls for themselves."""
BILLIONS = {
    "off vertices": ("off", off("4000000000 4 6").encode()),
    "off corners": ("off", off().replace("3 0 2 1", "4000000000 0 2 1").encode()),
    "stl": ("stl", bytes(80) + b"\xff\xff\xff\xee" + bytes(16)),
    "ply text vertices": ("ply", ply(vertices=4_000_000_000)),
    "ply vertices": ("ply", ply(vertices=4_000_000_000, form="binary_little_endian")),
    "ply corners": (
        "ply",
        ply(form="binary_little_endian", body=bytes(48) + b"\xff" * 99).replace(b"uchar", b"uint"),
    ),
    "glb numbers": ("glb", changed("accessors.0.count", 4_000_000_000)),
    "glb stride": ("glb", changed("bufferViews.0.byteStride", 4_000_000_000)),
}


@pytest.mark.parametrize("name", FILES)
def test_functions_are_called_in_proportion_to_bytes(name):
    kind, make = name.partition(":")[0], FILES[name]
    _read(kind, make(SMALL))  # imports, and tables of regular expressions
    before, after = (calls_of(_read, kind, make(size)) for size in (SMALL, TIMES * SMALL))
    assert after <= MOST_GROWTH * before


def _read(kind, data):
    with contextlib.suppress(gc.MeshError):
        mesh_of_bytes(kind, data, MOST)


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


@pytest.mark.parametrize(
    "case", ["a zip bomb", "a model that announces less than it is", "laughter"]
)
def test_a_packed_model_takes_the_memory_that_it_may(case):
    """A hundred megabytes of spaces, of which no more than a piece is ever there."""
    data, _ = ARCHIVES[case]
    tracemalloc.start()
    with pytest.raises(gc.MeshError):
        mesh_of_bytes("3mf", data, MOST)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < len(data) + 2**20


def test_a_json_part_of_millions_of_values_is_refused_before_it_is_parsed():
    data = FILES["glb: empty lists"](13 * 2**20)
    tracemalloc.start()
    with pytest.raises(gc.MeshError, match="values, the limit") as caught:
        mesh_of_bytes("glb", data, MOST)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert caught.value.reason is MeshRefusal.TOO_MANY
    assert peak < 2 * len(data)

"""Group 2: OBJ texts that a lenient reader takes for something else."""

from tests.bad_input.cases import read, refused
from tests.bad_input.mesh_texts import CORNERS, obj

GOOD = obj()


def _with(old: str, new: str) -> str:
    assert old in GOOD
    return GOOD.replace(old, new, 1)


X = "v 0.1 0.0 0.0"
DENT = [(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0.05, 0.02, 0), (0, 0.1, 0)]
BAD = {
    "nan": (_with(X, "v nan 0 0"), "finite|repair"),
    "inf": (_with(X, "v inf 0 0"), "finite|repair"),
    "1e400": (_with(X, "v 1e400 0 0"), "finite"),
    "1e300": (_with(X, "v 1e300 0 0"), "GP-MESH-SIZE|unit"),
    "1e-300 everywhere": (GOOD.replace("0.1", "1e-300"), "GP-MESH-SIZE|unit"),
    "a coordinate missing": (_with(X, "v 0.1 0"), "three numbers"),
    "five coordinates": (_with(X, "v 0.1 0 0 1 1"), "three numbers"),
    "a weight": (_with(X, "v 0.1 0 0 2"), "weight"),
    "a comma": (_with(X, "v 0,1 0 0"), "export"),
    "an underscore": (_with(X, "v 0_1 0 0"), "export"),
    "another alphabet's digits": (_with(X, "v \u0661 0 0"), "export"),
    "index 0": (_with("f 1 3 2", "f 0 3 2"), "vertex 0"),
    "index 99": (_with("f 1 3 2", "f 99 3 2"), "4"),
    "index 2^63": (_with("f 1 3 2", "f 9223372036854775808 3 2"), "export"),
    "index -99": (_with("f 1 3 2", "f -99 3 2"), "-99"),
    "an index that is no whole number": (_with("f 1 3 2", "f 1.5 3 2"), "whole number"),
    "a relative index before its vertices": ("f -3 -2 -1\n" + GOOD, "vertex -3"),
    "a face of two corners": (_with("f 1 3 2", "f 1 3"), "three corners"),
    "a face of none": (_with("f 1 3 2", "f"), "three corners"),
    "a face with a dent": (obj(DENT, [(1, 2, 3, 4, 0)]), "dent|triangles"),
    "a face of 5000 corners that crosses itself": (
        obj(CORNERS, [tuple(i % 4 for i in range(5000))]), "dent"),
    "a curved surface": (GOOD + "cstype bezier\nsurf 0 1 0 1 1 2 3\n", "cstype|polygons"),
    "an unknown word": (GOOD + "extrude 1\n", "extrude"),
    "a comment that may go on": ("# in C:\\\n" + GOOD, "comment"),
    "many digits and no number": (GOOD + "v " + "1" * 10**4 + "x 0 0\n", "export"),
    "many hashes": (GOOD + "#" * 10**4 + "\nx\n", "polygons"),
    "a zero byte": (GOOD + "# \0\n", "control character"),
    "a line of two megabytes": (GOOD + "#" + "x" * 2**21 + "\n", "longer"),
    "comments only": ("# nothing here\n" * 100, "no triangles"),
    "vertices only": (GOOD.split("f ")[0], "no triangles"),
    "lines only": (GOOD.split("f ")[0] + "l 1 2 3 4\n", "no triangles"),
    "all in one line": (GOOD.replace("\n", " "), "export"),
    "UTF-16 without a mark": (GOOD.encode("utf-16-le"), "control character"),
    "UTF-32": (GOOD.encode("utf-32"), "control character"),
}  # fmt: skip
GOOD_TEXTS = {
    "a continued line": _with("f 1 3 2", "f 1 \\\n3 2").encode(),
    "a library of materials elsewhere": ("mtllib ../../etc/passwd\nusemtl a\n" + GOOD).encode(),
    "a library of materials with a pipe": ("mtllib |id\n" + GOOD).encode(),
    "names in any script": "o деталь\ng 部品\n".encode() + GOOD.encode(),
}
"""Texts that must be read; `tests/grasp_core/mesh_files/test_reading.py` has more of them."""
CASES = [refused(name, "part.obj", *said) for name, said in BAD.items()]
CASES += [read(f"{name}.obj", data) for name, data in GOOD_TEXTS.items()]

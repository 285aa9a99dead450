"""Group 4: archives and XML, which are never opened, and npz, which is with bounds."""

import io
import zipfile
from functools import partial
from pathlib import Path

import numpy as np

from tests.bad_input.cases import Case, file_case

GROUP = "archives"
POSITIONS_NPY, NORMALS_NPY = "contact_points_m.npy", "contact_normals.npy"
IMPORT = "dataset import FILE tetrahedron --friction 0.5 --out made"
POSITIONS, NORMALS = np.zeros((1, 4, 3)), np.ones((1, 4, 3)) / np.sqrt(3.0)


def zipped(*members: tuple[str, bytes]) -> bytes:
    """An archive; names may come twice."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members:
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return held.getvalue()


def npy(array: np.ndarray) -> bytes:
    """An array as numpy writes it."""
    held = io.BytesIO()
    np.lib.format.write_array(held, array, allow_pickle=True)
    return held.getvalue()


def header(shape: str, kind: str = "<f8") -> bytes:
    """The head of an array that is not there."""
    said = f"{{'descr': {kind!r}, 'fortran_order': False, 'shape': {shape}, }}".encode()
    said = said.ljust(117) + b"\n"
    return b"\x93NUMPY\x01\0" + len(said).to_bytes(2, "little") + said


def arrays(**more: np.ndarray) -> bytes:
    """An npz of contacts, with some arrays otherwise."""
    held = {"contact_points_m": POSITIONS, "contact_normals": NORMALS} | more
    return zipped(*((f"{name}.npy", npy(array)) for name, array in held.items()))


BOMB = zipped(
    (POSITIONS_NPY, header("(100000000,)") + bytes(800_000_000)), (NORMALS_NPY, npy(NORMALS))
)
ENTITIES = '<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><l>&b;</l>'
OUTSIDE = '<?xml version="1.0"?><!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><r>&x;</r>'
MESHES = {
    "a bomb called 3mf": ("part.3mf", zipped(("3dmodel.model", bytes(50_000_000))), "ending"),
    "a zip bomb called obj": ("part.obj", zipped(("part.obj", bytes(50_000_000))), "zip|unpack"),
    "a name that climbs": ("part.obj", zipped(("../../part.obj", b"v")), "zip|unpack"),
    "10^4 entries": ("part.obj", zipped(*((str(i), b"") for i in range(10_000))), "zip|unpack"),
    "entities called off": ("part.off", ENTITIES, "XML|convert"),
    "an entity outside": ("part.x3d", OUTSIDE, "ending"),
    "an entity outside called ply": ("part.ply", OUTSIDE, "XML|convert"),
    "a compressed OFF": ("part.off.gz", b"\x1f\x8b\x08", "ending"),
}  # fmt: skip
NPZS = {
    "no archive": (b"PK nothing", "npz"),
    "cut": (arrays()[:-30], "npz"),
    "an array of 800 MB in 800 kB": (BOMB, "over the limit"),
    "a claim of 10^12 numbers": (
        zipped((POSITIONS_NPY, header("(1000000000000,)")), (NORMALS_NPY, npy(NORMALS))),
        "contact_points_m"),
    "a claim that overflows": (
        zipped((POSITIONS_NPY, header(f"({2**62}, 4, 3)")), (NORMALS_NPY, npy(NORMALS))),
        "contact_points_m"),
    "objects": (arrays(contact_points_m=np.array([print], dtype=object)), "contact_points_m"),
    "a claim of objects": (
        zipped((POSITIONS_NPY, header("(1,)", "|O") + b"cos\nsystem\n(S'id'\ntR."),
               (NORMALS_NPY, npy(NORMALS))), "contact_points_m"),
    "a climbing name": (zipped(("../" + POSITIONS_NPY, npy(POSITIONS))), "contact_points_m"),
    "no array of numbers": (zipped((POSITIONS_NPY, b"text"), (NORMALS_NPY, b"")), "npz"),
    "words": (arrays(contact_points_m=np.full((1, 4, 3), "a")), "contact_points_m"),
    "nan": (arrays(contact_points_m=np.full((1, 4, 3), np.nan)), "contact_points_m|finite"),
    "two numbers a point": (arrays(contact_points_m=np.zeros((1, 4, 2))), "contact_points_m"),
    "other counts": (arrays(contact_normals=np.ones((2, 4, 3))), "equal length"),
    "normals of no length": (arrays(contact_normals=np.zeros((1, 4, 3))), "contacts"),
    "no normals": (zipped((POSITIONS_NPY, npy(POSITIONS))), "contact_normals"),
    "complex numbers": (arrays(contact_points_m=np.ones((1, 4, 3)) * 1j), "contact_points_m"),
}  # fmt: skip


def _yaml(folder: Path) -> list[str]:
    (folder / "grasps.yaml").write_text("a: !!python/object/apply:os.system ['touch owned']\n")
    return ["dataset", "import", "grasps.yaml", "tetrahedron", "--friction", "0.5", "--out", "made"]


def cases() -> list[Case]:
    """All of the group."""
    found = [file_case(GROUP, name, *said) for name, said in MESHES.items()]
    found += [
        file_case(GROUP, f"npz: {name}", "contacts.npz", data, says, command=IMPORT)
        for name, (data, says) in NPZS.items()
    ]
    return [*found, Case(GROUP, "YAML that runs", partial(_yaml), 4, ("grasps.yaml",))]

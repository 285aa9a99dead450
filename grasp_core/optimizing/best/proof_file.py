"""Writes and reads the proof of a best grasp's bound as an npz file, which needs no pickles.

The arrays are those of `CutTree` and of its `Grounds`, by name, and three more: `format` is the
text "graspproof cut tree", `bound` is what the proof shows, for readers that do not compute it, and
`schema` is 1 for the Ferrari-Canny quality. For other measures it is 2, and two arrays say which
loads count: `measure`, a text, and `loads`, those of a task.
"""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grasp_core.errors import InputError, about
from grasp_core.files.text_files import read_bytes, write_parts
from grasp_core.optimizing.best.grounds import Grounds
from grasp_core.optimizing.best.support_cuts import CutTree
from grasp_core.quality.measures import Measure

USUAL, OTHER, FORMAT = 1, 2, "graspproof cut tree"
"""Schema of files for the Ferrari-Canny quality, and for other measures; what both say they are."""
MOST_BYTES = 2**30
OF_GROUNDS = ("faces", "normals", "origins", "frames", "corners", "counts")
OF_TREE = ("friction", "maps", "threshold", "deeds", "asked", "twists", "lines")
OF_LOADS = ("measure", "loads")
SMALL = {"deeds": np.uint8, "asked": np.int32, "faces": np.int32, "counts": np.int32}
"""Types that hold the whole numbers of the tree in less room."""


def write_proof(path: Path, proof: CutTree) -> Path:
    """Write a proof to an npz file."""
    if proof.owners is not None:
        raise InputError(
            f"{path}: expected a proof about all contacts of an object, as best_grasp makes, got "
            "one about four faces, which has no file"
        )
    arrays: dict[str, Any] = {name: getattr(proof.grounds, name) for name in OF_GROUNDS}
    arrays |= {name: getattr(proof, name) for name in OF_TREE}
    arrays |= {name: arrays[name].astype(kind) for name, kind in SMALL.items()}
    if proof.measure.is_usual:
        arrays |= {"schema": USUAL}
    else:
        arrays |= {"schema": OTHER, "measure": proof.measure.name, "loads": proof.measure.loads}
    arrays |= {"format": FORMAT, "bound": proof.bound}
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return write_parts(path, [stream.getvalue()])


def read_proof(path: Path) -> CutTree:
    """Read a proof that `write_proof` has written; `CutTree.verify` then checks what it claims."""
    arrays = _arrays(path)
    schemas = [kind for kind in (USUAL, OTHER) if np.array_equal(arrays["schema"], kind)]
    if str(arrays["format"]) != FORMAT or not schemas:
        raise InputError(
            f"{path}: expected the text {FORMAT!r} and schema {USUAL} or {OTHER}; write it again"
        )
    grounds = Grounds(**{name: arrays[name] for name in OF_GROUNDS})
    parts: dict[str, Any] = {name: arrays[name] for name in OF_TREE}
    for name in ("friction", "threshold"):
        if parts[name].shape != () or parts[name].dtype.kind != "f":
            raise InputError(f"{path}: {name} must be one number, got {parts[name].shape}")
        parts[name] = float(parts[name])
    if schemas == [OTHER]:
        parts["measure"] = _measure(path, arrays)
    proof = CutTree(grounds, **parts)
    if not np.array_equal(arrays["bound"], proof.bound):
        raise InputError(f"{path}: bound must be the {proof.bound:.17g} that the threshold proves")
    return proof


def _measure(path: Path, arrays: dict[str, NDArray[Any]]) -> Measure:
    name: Any = str(arrays["measure"])
    with about(path):
        found = Measure(name, arrays["loads"])
        if found.is_usual:
            raise InputError(f"expected measure 'weight' or 'task' with schema {OTHER}, got {name}")
    return found


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    data = read_bytes(path, MOST_BYTES)
    wanted = (*OF_GROUNDS, *OF_TREE, "schema", "format", "bound")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            claimed = sum(each.file_size for each in archive.infolist())
        if claimed > MOST_BYTES:
            raise InputError(f"{path}: its arrays take {claimed} bytes, over {MOST_BYTES}")
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            found = {name: archive[name] for name in wanted}
            if np.array_equal(found["schema"], OTHER):
                found |= {name: archive[name] for name in OF_LOADS}
            return found
    except InputError:
        raise
    except Exception as error:  # a damaged file can make zipfile and numpy raise anything
        raise InputError(
            f"{path}: expected an npz file with the arrays {', '.join(wanted)}, got: {error!r}"[
                :300
            ]
        ) from error

"""Writes and reads certified regions: one proof file per grasp, and one `regions.json`.

Type checking holds the writer to the fields of `regions.json`, which reports read.
"""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NotRequired

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.arrays import Array, frozen, frozen_indices, frozen_units
from grasp_core.checked import path_of
from grasp_core.closure.contacts import contacts_sha256
from grasp_core.errors import InputError, SolverError, about
from grasp_core.files.json_text import record_of, text_of
from grasp_core.files.text_files import write_text
from grasp_core.geometry.polygons import FEWEST_CORNERS
from grasp_core.objects.face_pieces import inscribed_disc_radius_of
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.provenance import versions
from grasp_core.regions.certificates import CertifiedRegions
from grasp_core.regions.proof import TwistCover
from grasp_core.values import FINGERS, ContactRegion, Grasp, four
from sim_validate.kit.fields import Finite, ObjectRecord, Positive
from sim_validate.kit.npz import read_arrays
from sim_validate.kit.writing import write_arrays
from sim_validate.planning.certifying import Asked, Found

SCHEMA = 1
REGIONS, PROOFS = "regions.json", "proofs"
POLYGONS = tuple(f"region{i}_m" for i in range(FINGERS))
BORDERS = tuple(f"border{i}_m" for i in range(FINGERS))
SHAPES: Mapping[str, tuple[int | None, ...]] = {
    "axes": (6, 6), "codes": (None,), "forces": (None, FINGERS, 3), "normals": (FINGERS, 3),
    "friction": (FINGERS,), "origin_m": (3,), "depths_m": (FINGERS,), "centers_m": (FINGERS, 3),
    "open_choice_m": (None, 3), "open_wrench": (None,), "scale_m": (), "disc_radius_m": (),
    "open_radius_m": (),
    **dict.fromkeys((*POLYGONS, *BORDERS), (None, 3)),
}  # fmt: skip
"""Shape of each array in a proof file; None stands for any length."""
MOST_CORNERS = 1000
"""Largest number of corners of a region's polygon in a file."""
SMALLEST_SCALE, LARGEST = 1e-6, 1e6
"""Smallest and largest unit of length of a proof, and largest coordinate in it [m]."""


class RegionRecord(TypedDict):
    """Fields about the region of one finger."""

    kind: NotRequired[str]
    polygon_m: Annotated[list[tuple[Finite, Finite, Finite]], Field(min_length=FEWEST_CORNERS)]
    inscribed_radius_m: Finite
    area_m2: NotRequired[Finite]


class ProofRecord(TypedDict):
    """Fields about the file that proves a grasp's regions."""

    file: Annotated[str, Field(pattern=r"^proofs/[A-Za-z0-9][A-Za-z0-9_-]{0,99}\.npz$")]
    """Path of the proof, relative to the folder of `regions.json`."""
    sha256: NotRequired[str]


class NamedGrasp(TypedDict):
    """Fields about the grasp that regions belong to."""

    id: str
    contacts_sha256: str
    family: NotRequired[str]
    planned_radius_m: NotRequired[Finite]


class GraspRecord(NamedGrasp):
    """Fields about the regions of one grasp, or the reason why it has none."""

    disc_radius_m: Finite | None
    centers_m: NotRequired[list[list[Finite]]]
    friction: NotRequired[list[Finite]]
    open_radius_m: NotRequired[Finite | None]
    open_choice_m: NotRequired[list[list[Finite]] | None]
    cones: NotRequired[int]
    proof: NotRequired[ProofRecord | None]
    regions: Annotated[list[RegionRecord], Field(min_length=FINGERS, max_length=FINGERS)] | None
    reason: NotRequired[str]


@with_config(ConfigDict(strict=True, extra="allow"))
class RegionsFile(TypedDict):
    """The content of `regions.json`; type checking holds its writer to it."""

    schema: Literal[1]
    object: ObjectRecord
    friction: Positive
    reserve: NotRequired[Finite]
    recenter: NotRequired[bool]
    edge_clearance_m: NotRequired[Finite]
    cones: NotRequired[int]
    versions: NotRequired[dict[str, str]]
    grasps: list[GraspRecord]


def write_regions(
    folder: Path | None, body: Polyhedron, asked: Asked, found: Iterable[Found]
) -> RegionsFile:
    """Write each proof when it is ready, then `regions.json`; write nothing if `folder` is None.

    Gives the content of regions.json.
    """
    records = [_record(grasp, proved, body, folder) for grasp, proved in found]
    document: RegionsFile = {
        "schema": SCHEMA,
        "object": {"name": body.name, "content_sha256": body.content_sha256},
        "friction": asked.friction,
        "reserve": asked.reserve,
        "recenter": asked.recenter,
        "edge_clearance_m": asked.clearance,
        "cones": asked.max_cones,
        "versions": versions(),
        "grasps": records,
    }
    if folder is not None:
        write_text(folder / REGIONS, text_of(document))
    return document


def _record(
    grasp: Grasp, proved: CertifiedRegions | str, body: Polyhedron, folder: Path | None
) -> GraspRecord:
    """Build the record of one grasp, and write its proof or remove an earlier one."""
    named: NamedGrasp = {
        "id": grasp.id,
        "contacts_sha256": contacts_sha256(grasp.contacts),
        "family": grasp.family,
        "planned_radius_m": grasp.radius,
    }
    name = f"{PROOFS}/{grasp.id}.npz"
    if isinstance(proved, str):
        if folder is not None:
            (folder / name).unlink(missing_ok=True)
        return {**named, "disc_radius_m": None, "regions": None, "reason": proved}
    proof: ProofRecord | None = None
    if folder is not None:
        path = write_arrays(folder / name, proof_arrays(proved, grasp, body))
        proof = {"file": name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}
    return {
        **named,
        "disc_radius_m": proved.radius,
        "centers_m": proved.centers.tolist(),
        "friction": proved.friction.tolist(),
        "open_radius_m": proved.limit if proved.open_choice is not None else None,
        "open_choice_m": None if proved.open_choice is None else proved.open_choice.tolist(),
        "cones": len(proved.cover.forces),
        "proof": proof,
        "regions": [
            {
                "kind": region.kind,
                "polygon_m": region.polygon.tolist(),
                "inscribed_radius_m": region.inscribed_radius,
                "area_m2": area_of(region),
            }
            for region in proved.regions
        ],
    }


def area_of(region: ContactRegion) -> float:
    """Compute the area of a convex region [m^2]."""
    sides = region.polygon[1:] - region.polygon[0]
    crossed = np.cross(sides[:-1], sides[1:])
    return 0.5 * float(np.linalg.norm(crossed.sum(axis=0)))


def proof_arrays(
    proved: CertifiedRegions, grasp: Grasp, body: Polyhedron
) -> dict[str, NDArray[Any]]:
    """Return the regions of a grasp and their proof, as arrays by name."""
    cover, choice, wrench = proved.cover, proved.open_choice, proved.open_wrench
    polygons = [region.polygon for region in proved.regions]
    return {
        "grasp": np.array(grasp.id),
        "object_sha256": np.array(body.content_sha256),
        "axes": cover.axes,
        "codes": cover.codes.astype(np.uint8),
        "forces": cover.forces,
        "normals": proved.normals,
        "friction": proved.friction,
        "origin_m": proved.origin,
        "depths_m": proved.depths,
        "scale_m": np.array(proved.scale),
        "centers_m": proved.centers,
        "disc_radius_m": np.array(proved.radius),
        "open_radius_m": np.array(proved.limit),
        "open_choice_m": np.zeros((0, 3)) if choice is None else choice,
        "open_wrench": np.zeros(0) if wrench is None else wrench,
        **dict(zip(POLYGONS, polygons, strict=True)),
        **dict(zip(BORDERS, proved.borders, strict=True)),
    }


def regions_file_of(text: str) -> RegionsFile:
    """Read the text of a `regions.json`."""
    return record_of(RegionsFile, text, REGIONS, schema=SCHEMA)


def load_regions(path: str | Path) -> CertifiedRegions:
    """Read regions and their proof, as `graspproof regions` writes them; nothing is verified yet.

    Raises:
        InputError: The file does not hold the proof of a grasp's regions.
    """
    path = path_of(path, "path")
    with about(f"{path}: expected a proof file as `graspproof regions` writes it"):
        return regions_of(read_arrays(path, SHAPES))


def regions_of(kept: Mapping[str, NDArray[Any]]) -> CertifiedRegions:
    """Build regions and their proof from arrays by name; nothing is verified yet."""
    if missing := [name for name in SHAPES if name not in kept]:
        raise InputError(
            f"the array {missing[0]} is missing; certify again with `graspproof regions`"
        )
    limit = np.asarray(kept["open_radius_m"])  # infinite where no open choice was found
    known = np.where(np.isposinf(limit), 0.0, limit) if limit.dtype.kind == "f" else limit
    finite = {**kept, "open_radius_m": known}
    numbers = {name: frozen(finite[name], shape, name) for name, shape in SHAPES.items()}
    scale = numbers["scale_m"].item()
    if not SMALLEST_SCALE <= scale <= LARGEST:
        raise InputError(
            f"scale_m: expected a length from {SMALLEST_SCALE:g} to {LARGEST:g} m, got {scale:g}"
        )
    normals = frozen_units(numbers["normals"], (FINGERS, 3), "normals")
    choice, wrench = numbers["open_choice_m"], numbers["open_wrench"]
    return CertifiedRegions(
        regions=four(
            _region(name, numbers[name], normal, scale)
            for name, normal in zip(POLYGONS, normals, strict=True)
        ),
        borders=four(numbers[name] for name in BORDERS),
        radius=numbers["disc_radius_m"].item(),
        centers=numbers["centers_m"],
        limit=limit.item(),
        open_choice=choice if len(choice) else None,
        open_wrench=wrench if len(wrench) else None,
        friction=numbers["friction"],
        origin=numbers["origin_m"],
        normals=normals,
        depths=numbers["depths_m"],
        cover=TwistCover(numbers["axes"], frozen_indices(kept["codes"], (None,), "codes"),
                         numbers["forces"]),
        scale=scale,
    )  # fmt: skip


def _region(name: str, polygon: Array, normal: Array, scale: float) -> ContactRegion:
    if not FEWEST_CORNERS <= len(polygon) <= MOST_CORNERS or np.abs(polygon).max() > LARGEST:
        raise InputError(
            f"{name}: expected a polygon of {FEWEST_CORNERS} to {MOST_CORNERS} corners within "
            f"{LARGEST:g} m; certify the regions again"
        )
    try:
        with np.errstate(invalid="ignore", divide="ignore"):  # edges without length divide by zero
            radius = scale * inscribed_disc_radius_of(polygon / scale, normal)
            return ContactRegion("certified", polygon, radius)
    except SolverError as error:
        raise InputError(
            f"{name}: expected the corners of a convex polygon in order; certify the regions again"
        ) from error

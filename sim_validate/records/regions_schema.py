"""The fields of `regions.json` with their types, for its writer and for reports."""

from typing import Annotated, Literal, NotRequired

from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.geometry.polygons import FEWEST_CORNERS
from grasp_core.values import FINGERS
from sim_validate.records.verdicts_schema import Finite, ObjectRecord, Positive


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

    schema: Literal[3]
    object: ObjectRecord
    friction: Positive
    reserve: NotRequired[Finite]
    balance: NotRequired[str]
    recenter: NotRequired[bool]
    edge_clearance_m: NotRequired[Finite]
    cones: NotRequired[int]
    versions: NotRequired[dict[str, str]]
    grasps: list[GraspRecord]

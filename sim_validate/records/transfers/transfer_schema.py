"""The fields of `transfer.json` with their types, for its writer and for whoever reads it."""

from typing import Annotated, Literal, NotRequired

from pydantic import ConfigDict, Field, with_config
from typing_extensions import TypedDict

from grasp_core.transferring.judging import Change
from grasp_core.values import FINGERS
from sim_validate.records.fields import Count, Finite, ObjectRecord, Positive

NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Triple = tuple[Finite, Finite, Finite]


class FaceChangeRecord(TypedDict):
    """Fields about what became of one face of the old part.

    Files of earlier versions lack some of them.
    """

    old: Count
    new: Count | None
    moved_mm: Finite
    turned_deg: NotNegative
    old_area_mm2: NotNegative
    new_area_mm2: NotNegative
    moved: bool
    normal: NotRequired[Triple]
    center_m: NotRequired[Triple]
    likely: NotRequired[Count | None]
    likely_turned_deg: NotRequired[NotNegative]
    in_words: str


class CarriedContactRecord(TypedDict):
    """Fields about one contact; without a place, `moved_mm` is how far the nearest like face is."""

    old_face: Count
    new_face: Count | None
    moved_mm: NotNegative | None
    turned_deg: NotNegative
    position_m: Triple | None
    normal: Triple | None


class FiguresRecord(TypedDict):
    """Fields about what contacts reach; a critical friction that does not exist is null."""

    closure_margin: Finite
    critical_friction: NotNegative | None
    ferrari_canny: tuple[Finite, Finite]


class CarriedGraspRecord(TypedDict):
    """Fields about what became of one grasp."""

    id: str
    new_id: str | None
    status: Change
    reason: str
    contacts: Annotated[
        list[CarriedContactRecord], Field(min_length=FINGERS, max_length=FINGERS)
    ]  # fmt: skip
    before: FiguresRecord
    after: FiguresRecord | None


class BandsRecord(TypedDict):
    """Fields about the differences that do not count."""

    critical_friction: NotNegative
    ferrari_canny_share: NotNegative


class TransferSummary(TypedDict):
    """Numbers of grasps by what became of them, and of contacts that moved or have no place."""

    grasps: Count
    same: Count
    better: Count
    worse: Count
    gone: Count
    contacts_moved: Count
    contacts_lost: Count


@with_config(ConfigDict(strict=True, extra="forbid"))
class TransferFile(TypedDict):
    """The content of `transfer.json`; type checking holds its writer to it."""

    schema: Literal[1]
    old: ObjectRecord
    new: ObjectRecord
    friction: Positive
    distance_m: NotNegative
    angle_deg: NotNegative
    bands: BandsRecord
    summary: TransferSummary
    faces: list[FaceChangeRecord]
    added_faces: list[Count]
    grasps: list[CarriedGraspRecord]
    versions: dict[str, str]

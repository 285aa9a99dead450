"""Writes `transfer.json`: what became of each face and each grasp of a part that has changed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Self

from grasp_core.files.records import FLAT, RecordFile
from grasp_core.planning.result import Outcomes, Plan, PlanCounts
from grasp_core.provenance import versions
from grasp_core.records.grasps_json import plan_to_json
from grasp_core.transferring.transfer import Transfer
from sim_validate.kit.about_object import AboutObject


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class TransferFile(RecordFile):
    """Grasps carried over to a changed part; both parts are only named, so nothing reads it."""

    FILE = "transfer.json"
    SCHEMA = 2

    old: AboutObject
    new: AboutObject
    transfer: Annotated[Transfer, FLAT]
    versions: Mapping[str, str | None] = field(default_factory=versions, compare=False)

    @classmethod
    def of(cls, found: Transfer) -> Self:
        """Record what became of grasps and faces."""
        return cls(AboutObject.of(found.old), AboutObject.of(found.new), found)


def carried_to_json(found: Transfer, saved: Plan) -> str:
    """Write the carried grasps as the text of a `grasps.json` of the changed part."""
    absence = None
    if not found.carried:
        absence = (
            f"none of the {len(found.grasps)} grasps could be carried over to the changed part"
        )
    nothing_tried = PlanCounts(faces=len(found.new.faces), quadruples=0, spanning=None)
    plan = Plan(
        body=found.new,
        grasps=found.carried,
        friction=found.friction,
        theta=math.atan(found.friction),
        seed=saved.seed,
        counts=nothing_tried,
        outcomes=Outcomes(0, 0, 0),
        absence=absence,
        finger=saved.finger,
    )
    return plan_to_json(found.new, plan)

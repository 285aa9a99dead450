"""Checks rows of varied grasps: against the grasps they were made from, and their own contacts."""

from collections.abc import Iterator, Mapping

import numpy as np

from grasp_core.closure.critical_friction import critical_friction
from grasp_core.errors import GraspError
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.learning.variants import RATIOS
from sim_validate.datasets.learning.varied import VARIED
from sim_validate.datasets.rows import GIVEN, PLANNED
from sim_validate.datasets.verifying.rows_by_object import ObjectRows, Row

ROUNDING = 1e-6
"""Share of a ratio or a distance that processors may round differently."""
NEAR_ZERO = 1e-7
"""Difference of critical frictions that counts as none: those near zero are found to millionths."""
BAND = 1e-3
"""Share by which a ratio may leave its band: frictions and masses are rounded to four digits."""
LABELS = {"grasp": PLANNED, GIVEN: GIVEN}
"""Kind of the rows of a label; other labels but `varied` are kinds themselves."""


def kind_faults(config: DatasetConfig, rows: ObjectRows) -> Iterator[str]:
    """Yield sentences on what is wrong with kinds and varied grasps of one object."""
    if config.learning is None:
        return
    by_name = {row["grasp_id"]: row for row in rows["grasps"]}
    curved = {row["object_id"]: row["curved"] for row in rows["objects"]}
    for row in rows["grasps"]:
        if row["label"] != VARIED:
            wanted = LABELS.get(row["label"], row["label"])
            alike = row["kind"] == wanted
            found = [] if alike else [f"kind is {row['kind']}, but {wanted} by label"]
        else:
            found = list(_varied_faults(row, by_name, is_curved=bool(curved[row["object_id"]])))
        yield from (f"grasps: {row['grasp_id']}: {fault}" for fault in found)


def _varied_faults(row: Row, by_name: Mapping[str, Row], *, is_curved: bool) -> Iterator[str]:
    source = by_name.get(row["made_from"])
    if source is None:
        yield f"{row['made_from']}, named in made_from, has no row"
        return
    moves = np.subtract(row["contact_points_m"], source["contact_points_m"])
    stated = np.array(row["displaced_m"])
    size = max(1.0, float(np.abs(stated).max()))
    if not np.allclose(np.linalg.norm(moves, axis=1), stated, rtol=0.0, atol=ROUNDING * size):
        yield "displaced_m is not the distance from the contacts of made_from"
    if (row["kind"] == "moved_out") == (not stated.any()):
        yield f"contacts of the kind {row['kind']} are not where they must be"
    if not is_curved and any(
        exit_m is not None and moved <= exit_m * (1.0 - ROUNDING)
        for moved, exit_m in zip(stated, row["region_exit_m"], strict=True)
    ):
        yield "a contact was moved, but is still in its region"
    yield from _ratio_faults(row)


def _ratio_faults(row: Row) -> Iterator[str]:
    """Check the ratio of the friction to the critical one, and that ratios fit the kind."""
    try:
        critical = critical_friction(row["contact_points_m"], row["contact_normals"])
    except GraspError as error:
        yield f"the critical friction cannot be computed ({error})"
        return
    wanted = row["friction"] / critical if 0.0 < critical < np.inf else None
    known = row["friction_ratio"]
    if (known is None) != (wanted is None) or (
        wanted is not None
        and not np.isclose(row["friction"] / known, critical, rtol=10.0 * ROUNDING, atol=NEAR_ZERO)
    ):
        yield f"friction_ratio is {known}, but from the contacts it is {wanted}"
    if row["kind"] in RATIOS:
        least, most = RATIOS[row["kind"]]
        ratio = row["mass_ratio"] if row["kind"] == "mass_near" else known
        if ratio is None or not least * (1.0 - BAND) <= ratio <= most * (1.0 + BAND):
            yield f"the ratio {ratio} is none of the kind {row['kind']}"

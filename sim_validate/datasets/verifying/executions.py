"""Checks rows about executions: against their trials, and against the analysis of their contacts.

The multiple of the weight that a squeeze carries follows from contacts, squeeze, mass and springs
alone, so it is proved again for every row. What a trial did is only simulated again in a sample.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from grasp_core.errors import GraspError
from grasp_core.execution.grips import grip
from grasp_core.execution.loads import any_direction
from grasp_core.execution.squeeze_rows import Survival
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import seat
from grasp_core.values import Contact
from sim_validate.datasets.building.write_tables import CONFIG
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.learning.varied import VARIED
from sim_validate.datasets.meshes import stored_body
from sim_validate.datasets.rows import GIVEN
from sim_validate.datasets.verifying.rows_by_object import ObjectRows, Row
from sim_validate.execution.execute import tip_radius
from sim_validate.execution.settings import AskedExecution
from sim_validate.execution.verdict import may_slip

ROUNDING = 1e-6
"""Share of a mass, a push or a multiple that processors may round differently."""
CLAIMS = (
    "survived", "mass_kg", "squeeze_n", "load_multiple", "predicted_first_slip",
    "simulated_first_slip", "executed_trials", "execution_mismatches",
)  # fmt: skip


def execution_faults(folder: Path, config: DatasetConfig, rows: ObjectRows) -> Iterator[str]:
    """Yield sentences on what is wrong with the executions of one object."""
    asked = config.execution
    if asked is None:
        return
    trials: dict[str, list[Row]] = {}
    for row in rows["executions"]:
        trials.setdefault(row["grasp_id"], []).append(row)
    names = {row["grasp_id"] for row in rows["grasps"]}
    yield from (
        f"executions: {name} has no row in the table of grasps"
        for name in sorted(trials.keys() - names)
    )
    for of_object in rows["objects"]:
        own = [row for row in rows["grasps"] if row["object_id"] == of_object["object_id"]]
        body: Polyhedron | None = None
        for row in own:
            found = list(_row_faults(row, trials.get(row["grasp_id"], [])))
            if not found and row["executed"]:
                body = body or stored_body(
                    folder, of_object["object_id"], of_object["source_name"], config.faces
                )
                found = list(_squeeze_faults(row, body, asked))
            yield from (f"grasps: {row['grasp_id']}: {fault}" for fault in found)


def _row_faults(row: Row, trials: Sequence[Row]) -> Iterator[str]:
    """Check that a row agrees with its trials, and claims nothing if it was not executed."""
    if row["control_of"] is not None or not row["executed"]:
        claimed = [name for name in CLAIMS if row[name] is not None]
        unheld = claimed == ["survived"] and not row["survived"] and row["execution_note"]
        if row["executed"] or trials or (claimed and not unheld):
            yield "the row claims results of an execution, although none was simulated"
        return
    first_slips = [
        [trial[name] for trial in trials if trial[name] is not None]
        for name in ("predicted_first_slip", "simulated_first_slip")
    ]
    wanted = {
        "executed_trials": len(trials),
        "survived": all(trial["survived"] for trial in trials) if trials else None,
        "predicted_first_slip": min(first_slips[0], default=None),
        "simulated_first_slip": min(first_slips[1], default=None),
    }
    yield from (
        f"{name} is {row[name]}, but {value} by the table of executions"
        for name, value in wanted.items()
        if row[name] != value
    )


def _squeeze_faults(row: Row, body: Polyhedron, asked: AskedExecution) -> Iterator[str]:
    """Check the mass, and prove again that the squeeze carries what the row says."""
    yield from _proved(row, body, asked, "squeeze_n", "load_multiple")
    if row.get("least_squeeze_n") is not None:
        # it carries the weight itself, with no larger push
        least = {**row, "squeeze_n": row["least_squeeze_n"], "load_multiple": 1.0}
        yield from _proved(least, body, asked, "least_squeeze_n", "least_push_n")


def _proved(
    row: Row, body: Polyhedron, asked: AskedExecution, squeeze: str, claim: str
) -> Iterator[str]:
    """Check that a squeeze carries a multiple of the weight, with pushes that are allowed."""
    count = row["contacts"]
    try:
        settings = asked.settings_for(body)
        if row.get("mass_ratio") is not None:
            settings = replace(settings, mass_kg=row["mass_kg"])
        points, normals = row["contact_points_m"][:count], row["contact_normals"][:count]
        contacts = [
            Contact(np.array(point), np.array(normal))
            for point, normal in zip(points, normals, strict=True)
        ]
        if row["label"] in (GIVEN, VARIED):  # on curved surfaces they have faces of their own
            body = seat(body, points, normals).body
        held = grip(
            body, contacts, row["friction"], row["squeeze_n"][:count],
            stiffness=settings.stiffness_n_per_m, tip_radius_m=tip_radius(body, contacts, settings),
        )  # fmt: skip
    except GraspError as error:
        yield f"the contacts cannot be squeezed as the row says ({error})"
        return
    if not np.isclose(row["mass_kg"], settings.mass_kg, rtol=ROUNDING, atol=0.0):
        yield f"mass_kg is {row['mass_kg']:.9g}, but by {CONFIG} it is {settings.mass_kg:.9g}"
        return
    survival = Survival.of(held, any_direction(settings.mass_kg))
    reactions = survival.reactions(held.local_squeeze)
    multiple = row["load_multiple"] * (1.0 - ROUNDING)
    pushes = reactions.start[:, 0] + multiple * reactions.swing
    push_n = row["least_push_n"] if claim == "least_push_n" else settings.push_n
    limited = bool((pushes <= push_n * (1.0 + ROUNDING)).all())
    if not (limited and reactions.survives(multiple, reactions.multipliers(multiple))):
        yield (
            f"{claim} is {row[claim]:.9g}, but the squeeze is not proved to carry as much "
            f"({squeeze})"
        )


def loose_difference(one: Mapping[str, Any], other: Mapping[str, Any]) -> str:
    """Say how survival differs where numbers were rounded otherwise; empty if it does not.

    A grasp whose contacts slip may be kept or lost by a hair, so it counts only where the analysis
    lets none slip. A row of a dataset without executions has nothing to compare.
    """
    slips = [row.get("predicted_first_slip") for row in (one, other)]
    survived = [row.get("survived") for row in (one, other)]
    if survived[0] == survived[1] or any(map(may_slip, slips)):
        return ""
    return f"survived is {survived[0]}, but {survived[1]} when executed again"

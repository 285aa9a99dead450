"""A dataset of two objects with rows of every kind, and its rows."""

import sim_validate as sv
from scenes.example_objects import example_object
from sim_validate.datasets.config import DatasetConfig, Learning
from sim_validate.datasets.open_dataset import select
from sim_validate.execution.settings import AskedExecution

LEARNED = DatasetConfig(
    objects=("tetrahedron", "wedge"), families=("concurrent",), limit=1,
    execution=AskedExecution(
        sv.ExecutionSettings(mass_kg=1.0, trials=("weight", "misplaced"), misplacements=2)
    ),
    learning=Learning(
        friction_below=1, friction_near=2, friction_above=1, moved_out=2, mass_near=1, synthetic=1,
        figures=("closure", "least_squeeze"), seeds=(7,), hand="leap",
    ),
)  # fmt: skip


BODIES = {body.content_sha256: body for body in map(example_object, LEARNED.objects)}


def rows_of(folder, name):
    return list(select(folder).rows(name))

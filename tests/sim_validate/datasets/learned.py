"""A dataset of two objects with rows of every kind, and its rows."""

import sim_validate as sv
from grasp_core.objects.polyhedron import polyhedron_from_mesh
from scenes.example_objects import example_object
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.learning.settings import Learning
from sim_validate.datasets.open_dataset import select
from sim_validate.execution.settings import AskedExecution

LEARNED = DatasetConfig(
    objects=("tetrahedron", "wedge"), families=("concurrent",), limit=1,
    execution=AskedExecution(
        sv.ExecutionSettings(mass_kg=1.0, trials=("weight", "misplaced"), misplacements=2)
    ),
    learning=Learning(
        friction_below=1, friction_near=2, friction_above=1, moved_out=2, mass_near=1, synthetic=1,
        figures=("closure", "symmetry", "approach", "payload", "least_squeeze"), seeds=(7,),
        rests=True, points=64, split_by="object", scales={"tetrahedron": 0.5},
        classes={"wedge": "ramp"}, hand="leap",
    ),
)  # fmt: skip


def _body(name):
    """The object as the dataset has it: the tetrahedron at half its size."""
    body, scale = example_object(name), LEARNED.learning.scale_of(name)
    return polyhedron_from_mesh(body.vertices * scale, body.triangles, name=name)


BODIES = {body.content_sha256: body for body in map(_body, LEARNED.objects)}


def rows_of(folder, name):
    return list(select(folder).rows(name))

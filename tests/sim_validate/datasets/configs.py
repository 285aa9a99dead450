"""Settings of small datasets, which `conftest.py` builds once, and what is read of them."""

from dataclasses import replace
from pathlib import Path

import trimesh

import sim_validate as sv
from scenes.example_objects import example_object
from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig, DatasetHand, Learning
from sim_validate.datasets.open_dataset import select
from sim_validate.datasets.parquet import read_table
from tests.sim_validate.datasets.engines import Here, silent
from tests.three_fingers import THREE_TIPS, three_fingers_file

CONFIG = DatasetConfig(
    objects=("tetrahedron", "wedge"), frictions=(0.4, 0.5), families=("concurrent",), limit=2
)
"""Two objects at two frictions."""
SMALL = DatasetConfig(
    objects=("tetrahedron", "wedge", "prism"), families=("concurrent",), limit=1, seed=6,
    license="CC-BY-4.0", creator="A. Maker", url="https://example.org/grasps",
    published="2026-11-22",
)  # fmt: skip
"""Three objects, each of which is in another split with this seed."""
LEARNED = DatasetConfig(
    objects=("tetrahedron", "wedge"), families=("concurrent",), limit=1,
    execution=sv.ExecutionSettings(
        mass_kg=1.0, trials=("weight", "misplaced"), misplacements=1
    ),
    learning=Learning(
        friction_below=1, friction_near=1, friction_above=1, moved_out=1, mass_near=1, synthetic=1,
        figures=("closure", "least_squeeze", "placement"), seeds=(7,),
    ),
    hand=DatasetHand(hand="leap"),
)  # fmt: skip
"""Two objects with rows of every kind."""
HANDED = DatasetConfig(
    objects=("tetrahedron", "wedge"), families=("concurrent",), limit=1,
    learning=Learning(friction_above=1, synthetic=1),
    hand=DatasetHand(simulate=True, mass_kg=0.02, hand="?", fingertips=THREE_TIPS),
)  # fmt: skip
"""Two objects with a gripper with three fingers, whose file tests write (see `with_gripper`)."""
BODIES = {body.content_sha256: body for body in map(example_object, LEARNED.objects)}


def with_gripper(folder):
    """Settings with the gripper, whose fingers all have three joints, and whose palm has a mesh."""
    path = Path(three_fingers_file(folder))
    text = path.read_text()
    joint = '<joint name="thumb_spread" axis="0 0 1" range="-50 50"/>'
    text = text.replace('<joint name="thumb_bend"', f'{joint}<joint name="thumb_bend"')
    pad = '<asset><mesh name="pad" file="shapes/pad.stl"/></asset><worldbody>'
    text = text.replace("<worldbody>", pad)
    geom = '<geom type="mesh" mesh="pad" pos="0 0 -0.04"/>'
    path.write_text(text.replace('<body name="thumb" ', f'{geom}<body name="thumb" '))
    (folder / "shapes").mkdir()
    trimesh.creation.box(extents=(0.02, 0.02, 0.01)).export(folder / "shapes" / "pad.stl")
    return replace(HANDED, hand=replace(HANDED.hand, hand=str(path)))


def rows_of(folder, name):
    """The cells of a table's rows, as its files hold them."""
    chosen = select(folder)
    paths = chosen.paths(name)
    return [
        row for path in paths for row in read_table(path, name, chosen.manifest.tables).to_pylist()
    ]


def build_small(folder, config=SMALL):
    """Build it, and check that it is what tests rely on."""
    built = build(config, folder, Here(), silent)
    assert built.manifest.rows["objects"] == len(config.objects)
    assert len(list(folder.glob("data/grasps/*.parquet"))) == 3
    return folder

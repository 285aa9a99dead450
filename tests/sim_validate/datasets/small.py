"""A small dataset for tests, with one object in each split."""

from sim_validate.datasets.build import build
from sim_validate.datasets.config import DatasetConfig
from tests.sim_validate.datasets.engines import Here, silent

SMALL = DatasetConfig(
    objects=("tetrahedron", "wedge", "prism"),
    families=("concurrent",),
    limit=1,
    seed=6,  # so that each of them is in another split
    license="CC-BY-4.0",
    creator="A. Maker",
    url="https://example.org/grasps",
    published="2026-11-22",
)


def build_small(folder, config=SMALL):
    """Build it, and check that it is what tests rely on."""
    built = build(config, folder, Here(), silent)
    assert built.rows["objects"] == len(config.objects)
    assert len(list(folder.glob("data/grasps/*.parquet"))) == 3
    return folder

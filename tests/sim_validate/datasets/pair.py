"""Settings of a dataset of two objects at two frictions."""

from sim_validate.datasets.config import DatasetConfig

CONFIG = DatasetConfig(
    objects=("tetrahedron", "wedge"), frictions=(0.4, 0.5), families=("concurrent",), limit=2
)

"""Settings of a dataset of two objects at two frictions, and its rows."""

from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.manifest import read_manifest
from sim_validate.datasets.parquet import read_rows

CONFIG = DatasetConfig(
    objects=("tetrahedron", "wedge"), frictions=(0.4, 0.5), families=("concurrent",), limit=2
)


def all_rows(folder, name):
    tables = read_manifest(folder).tables
    paths = sorted(folder.glob(f"data/{name}/*.parquet"))
    return [row for path in paths for row in read_rows(path, name, tables)]

"""A dataset of two objects at two frictions, and copies of it to spoil."""

import shutil

import pytest

from sim_validate.datasets.building.build import build
from tests.sim_validate.datasets.engines import Here, silent
from tests.sim_validate.datasets.pair import CONFIG
from tests.sim_validate.datasets.small import build_small


@pytest.fixture(scope="session")
def small_dataset(tmp_path_factory):
    """The dataset of `small.py`, only to be read."""
    return build_small(tmp_path_factory.mktemp("small") / "ds")


@pytest.fixture(scope="session")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset") / "ds"
    built = build(CONFIG, folder, Here(), silent)
    assert (built.units, built.made, built.quarantined) == (4, 4, 0)
    return folder


@pytest.fixture
def copy(dataset, tmp_path):
    return shutil.copytree(dataset, tmp_path / "copy")

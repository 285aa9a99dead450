"""A dataset with all that learners may ask for, and copies of it to spoil."""

import shutil

import pytest

from sim_validate.datasets.building.build import build
from tests.sim_validate.datasets.engines import Here, silent
from tests.sim_validate.datasets.learned import LEARNED


@pytest.fixture(scope="session")
def learned(tmp_path_factory):
    pytest.importorskip("pyarrow")
    folder = tmp_path_factory.mktemp("learned") / "ds"
    built = build(LEARNED, folder, Here(), silent)
    assert (built.units, built.quarantined) == (2, 0)
    return folder


@pytest.fixture
def spoiled(learned, tmp_path):
    return shutil.copytree(learned, tmp_path / "copy")

"""Datasets of few objects, and copies of them to spoil."""

import shutil

import pytest

from sim_validate.datasets.build import build
from tests.sim_validate.datasets.configs import CONFIG, LEARNED, build_small, with_gripper
from tests.sim_validate.datasets.engines import Here, silent


@pytest.fixture(scope="session")
def small_dataset(tmp_path_factory):
    """The dataset of `SMALL`, only to be read."""
    return build_small(tmp_path_factory.mktemp("small") / "ds")


@pytest.fixture(scope="session")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset") / "ds"
    built = build(CONFIG, folder, Here(), silent)
    assert (built.manifest.units, built.made, built.manifest.quarantined) == (4, 4, 0)
    return folder


@pytest.fixture
def copy(dataset, tmp_path):
    return shutil.copytree(dataset, tmp_path / "copy")


@pytest.fixture(scope="session")
def learned(tmp_path_factory):
    """The dataset of `LEARNED`, only to be read."""
    pytest.importorskip("pyarrow")
    folder = tmp_path_factory.mktemp("learned") / "ds"
    built = build(LEARNED, folder, Here(), silent)
    assert (built.manifest.units, built.manifest.quarantined) == (2, 0)
    return folder


@pytest.fixture(scope="session")
def gripping(tmp_path_factory):
    """Settings with a gripper, beside whose file there is nothing but its shape."""
    return with_gripper(tmp_path_factory.mktemp("gripper"))


@pytest.fixture(scope="session")
def handed(gripping, tmp_path_factory):
    """The dataset with the gripper, only to be read."""
    pytest.importorskip("pyarrow")
    folder = tmp_path_factory.mktemp("handed") / "ds"
    built = build(gripping, folder, Here(), silent)
    assert (built.manifest.units, built.manifest.quarantined) == (2, 0)
    return folder


@pytest.fixture
def spoiled(learned, tmp_path):
    return shutil.copytree(learned, tmp_path / "copy")

"""Commands that build datasets in the process of the tests, which spares the start of others."""

import pytest

from tests.sim_validate.datasets.engines import here


@pytest.fixture
def built_here(monkeypatch):
    """Let `dataset build` and `dataset import` compute their units in this process."""
    monkeypatch.setattr("sim_validate.commands.dataset.local_processes", here)

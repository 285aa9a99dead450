"""What starting a cluster leaves behind in this process."""

import os
from types import SimpleNamespace

from sim_validate.kit import processes as clusters


def test_settings_of_ray_are_set_while_it_runs_and_those_of_the_caller_stay(monkeypatch):
    own, other = clusters.RAY_SETTINGS
    monkeypatch.delenv(own, raising=False)
    monkeypatch.setenv(other, "mine")
    ray = SimpleNamespace(
        init=lambda **_: None, cluster_resources=lambda: {"CPU": 3.0}, shutdown=lambda: None
    )
    monkeypatch.setattr(clusters, "_imported", lambda *_: ray)
    before = dict(os.environ)
    with clusters.ray_workers(2, None) as started:
        assert started.workers == 3
        assert os.environ[own] == clusters.RAY_SETTINGS[own]
        assert os.environ[other] == "mine"
    assert dict(os.environ) == before

import dataclasses
import errno
import itertools
import os
import time
from types import SimpleNamespace

import pytest
import trimesh

from grasp_core.processes import local_processes
from sim_validate.datasets import clusters
from sim_validate.datasets import computing as workers
from sim_validate.datasets.build import build
from sim_validate.datasets.computing import UnitTask, compute_all, compute_in_worker, compute_unit
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.resuming import Staging
from sim_validate.datasets.work_units import WorkerError, provenance, units_of
from tests.patience import HANGING_S
from tests.sim_validate.datasets.engines import Here, silent

pytest.importorskip("pyarrow")
CONFIG = DatasetConfig(objects=("tetrahedron",), families=("concurrent",), limit=1)


@pytest.fixture
def staging(tmp_path):
    made = Staging(tmp_path / "staging")
    made.folder.mkdir()
    return made


def task(staging, compute, timeout_s=HANGING_S):
    return UnitTask(units_of(CONFIG)[0], staging, dict(provenance()), timeout_s, compute)


def sleep(*_):
    while True:
        time.sleep(60.0)


def burn(*_):
    sum(itertools.repeat(1))  # one call that never gives the interpreter back


def test_a_worker_with_another_version_refuses_and_the_run_ends(tmp_path, monkeypatch):
    other = dict(provenance()) | {"code_sha256": "0.0.1"}
    asked_first = iter([other])
    monkeypatch.setattr(workers, "provenance", lambda: next(asked_first, provenance()))
    with pytest.raises(WorkerError, match=r"version of code_sha256: .* instead of 0\.0\.1"):
        build(CONFIG, tmp_path / "ds", Here(), silent)
    monkeypatch.undo()
    assert build(CONFIG, tmp_path / "ds", Here(), silent).made == 1


def test_a_worker_that_does_not_see_the_folder_says_so(tmp_path):
    with pytest.raises(WorkerError, match="file system that all processes share"):
        compute_in_worker(task(Staging(tmp_path / "elsewhere"), sleep))


@pytest.mark.parametrize("timeout_s", [None, HANGING_S, 1e300])
def test_a_time_limit_needs_nothing_that_windows_lacks(staging, timeout_s):
    given = task(staging, lambda unit, to: to.quarantine(unit, "done"), timeout_s)
    with pytest.MonkeyPatch.context() as patched:
        patched.delattr("signal.setitimer", raising=False)
        compute_in_worker(given)
    assert staging.record(given.unit).reason == "done"


def test_rows_that_do_not_arrive_end_the_run(staging):
    class Elsewhere(Here):
        def submit(self, function, given):
            return super().submit(function, dataclasses.replace(given, compute=lambda *_: None))

    with pytest.raises(WorkerError, match="rows that do not appear"):
        compute_all(units_of(CONFIG), staging, Elsewhere(), silent, None, compute_unit)


def test_a_full_disk_ends_the_run_and_later_it_goes_on(tmp_path):
    config = dataclasses.replace(CONFIG, frictions=(0.4, 0.5))

    def full(_):
        if len(engine.submitted) == 2:
            raise OSError(errno.ENOSPC, "No space left")

    engine = Here(full)
    with pytest.raises(OSError, match="No space left") as raised:
        build(config, tmp_path / "ds", engine, silent)
    assert raised.value.errno == errno.ENOSPC
    again = Here()
    assert build(config, tmp_path / "ds", again, silent).made == 1
    assert len(again.submitted) == 1


def test_a_worker_that_cannot_begin_ends_the_run(tmp_path):
    def lack(_):
        raise ModuleNotFoundError("No module named 'sim_validate'")

    with pytest.raises(WorkerError, match=r"units of work .ModuleNotFoundError: No module"):
        build(CONFIG, tmp_path / "ds", Here(lack), silent)
    assert build(CONFIG, tmp_path / "ds", Here(), silent).manifest.quarantined == 0


def test_a_worker_that_does_not_see_a_mesh_ends_the_run(tmp_path):
    path = tmp_path / "box.stl"
    trimesh.creation.box(extents=(0.04, 0.05, 0.06)).export(path)
    config = dataclasses.replace(CONFIG, objects=(str(path),))

    for spoil, said in (
        (lambda _: path.write_bytes(path.read_bytes() + b" "), "has changed since the build began"),
        (lambda _: path.unlink(), "cannot find this mesh"),
    ):
        with pytest.raises(WorkerError, match=said):
            build(config, tmp_path / "ds", Here(spoil), silent)
    assert not (tmp_path / "ds" / "manifest.json").exists()


def test_a_fault_of_ours_with_one_object_does_not_stop_the_others(tmp_path, monkeypatch):
    config = dataclasses.replace(CONFIG, objects=("tetrahedron", "wedge"))
    plain = workers.compute_rows

    def faulty(unit, body):
        if unit.object == "wedge":
            raise ZeroDivisionError("a bug")
        return plain(unit, body)

    monkeypatch.setattr(workers, "compute_rows", faulty)
    built = build(config, tmp_path / "ds", Here(), silent)
    assert (built.manifest.quarantined, built.manifest.rows["objects"]) == (1, 1)
    quarantine = (tmp_path / "ds" / "quarantine.jsonl").read_text()
    assert "internal error: ZeroDivisionError: a bug" in quarantine


@pytest.mark.slow
def test_a_process_that_never_ends_is_ended(staging):
    with local_processes(1) as engine:
        for never in (sleep, burn):
            ended = engine.submit(compute_in_worker, task(staging, never, 0.5))
            assert ended.exception(HANGING_S) is not None
        given = task(staging, compute_unit)
        engine.submit(compute_in_worker, given).result()
    assert staging.of(given.unit).is_dir()


def test_settings_of_ray_are_set_while_it_runs_and_those_of_the_caller_stay(monkeypatch):
    own, other, *_ = clusters.RAY_SETTINGS
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

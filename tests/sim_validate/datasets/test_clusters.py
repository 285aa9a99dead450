"""Ray and Dask, started on this machine: the same bytes, the same faults, the same endings."""

import os
import signal
import time

import pytest

import grasp_core as gc
from grasp_core.processes import local_processes
from sim_validate.datasets.build import build
from sim_validate.datasets.clusters import dask_workers, ray_workers
from sim_validate.datasets.computing import compute_all, compute_unit
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.resuming import Staging
from sim_validate.datasets.work_units import units_of
from tests.sim_validate.datasets.configs import CONFIG
from tests.sim_validate.datasets.engines import contents, silent

pytest.importorskip("pyarrow")
pytestmark = pytest.mark.slow
TIMEOUT_S = 100.0
PACKAGES = {"ray": "ray", "dask": "distributed"}


@pytest.fixture(scope="module", params=["local", "dask", "ray"])
def engine(request):
    if request.param == "local":
        with local_processes(2) as started:
            yield started
        return
    pytest.importorskip(PACKAGES[request.param])
    start = dask_workers if request.param == "dask" else ray_workers
    with start(2, None) as started:
        yield started


def faulty(unit, staging):
    """Ends, hangs or does its work, as the object's name says."""
    if unit.object == "wedge":
        os.kill(os.getpid(), signal.SIGKILL)
    if unit.object == "prism":
        time.sleep(100.0)
    compute_unit(unit, staging)


def niceness(_):
    return os.nice(0)


def test_every_engine_makes_the_same_bytes(engine, dataset, tmp_path):
    assert engine.workers == 2
    assert engine.submit(niceness, None).result() == os.nice(0)
    built = build(CONFIG, tmp_path / "ds", engine, silent, TIMEOUT_S)
    assert built.made == 4
    assert contents(tmp_path / "ds") == contents(dataset)


def test_every_engine_makes_the_same_bytes_of_a_hand(engine, gripping, handed, tmp_path):
    assert build(gripping, tmp_path / "ds", engine, silent, TIMEOUT_S).made == 2
    assert contents(tmp_path / "ds") == contents(handed)


def reasons(engine, objects, timeout_s, folder):
    """Do a unit of each object: why each was given up, None where it was done."""
    config = DatasetConfig(objects=objects, families=("concurrent",), limit=1)
    staging = Staging(folder)
    folder.mkdir()
    units = units_of(config)
    compute_all(units, staging, engine, silent, timeout_s, faulty)
    return {unit.object: staging.record(unit).reason for unit in units}


def test_what_ends_is_given_up_and_the_others_are_done(engine, tmp_path):
    came = reasons(engine, ("tetrahedron", "wedge", "octahedron"), TIMEOUT_S, tmp_path / "staging")
    assert came == {
        "tetrahedron": None, "wedge": "its worker ended, twice", "octahedron": None
    }  # fmt: skip


def test_what_hangs_is_given_up(engine, tmp_path):
    """No other unit is under way: on a busy machine it would take too long as well."""
    came = reasons(engine, ("prism",), 3.0, tmp_path / "staging")
    assert came == {"prism": "took too long, twice"}


def test_a_running_dask_cluster_is_used_and_several_threads_are_refused(dataset, tmp_path):
    distributed = pytest.importorskip("distributed")
    settings = {"dashboard_address": "127.0.0.1:0", "silence_logs": 50, "n_workers": 1}
    with distributed.LocalCluster(threads_per_worker=1, **settings) as cluster:
        with dask_workers(9, cluster.scheduler_address) as started:
            assert started.workers == 1
            build(CONFIG, tmp_path / "ds", started, silent, TIMEOUT_S)
        assert contents(tmp_path / "ds") == contents(dataset)
    with (
        distributed.LocalCluster(threads_per_worker=2, **settings) as cluster,
        pytest.raises(gc.InputError, match="--nthreads 1"),
        dask_workers(1, cluster.scheduler_address),
    ):
        pass


@pytest.mark.parametrize("start", [dask_workers, ray_workers])
def test_an_address_where_nothing_answers_is_said(start, monkeypatch):
    monkeypatch.setattr("sim_validate.datasets.clusters.ANSWER_S", 1.0)
    pytest.importorskip("ray" if start is ray_workers else "distributed")
    with pytest.raises(gc.InputError, match=r"no .* answers"), start(1, "127.0.0.1:1"):
        pass


@pytest.mark.parametrize(("start", "name"), [(dask_workers, "distributed"), (ray_workers, "ray")])
def test_an_engine_that_is_not_installed_is_said(start, name, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, name, None)
    named = rf"pip install 'graspproof\[{start.__name__[:3]}"
    with pytest.raises(gc.InputError, match=named), start(1, None):
        pass

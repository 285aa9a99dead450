"""Grasps that are sent to other processes, with all that they have in common."""

import pickle

import grasp_core as gc
from scenes.example_objects import example_object
from sim_validate import Agenda, Setup
from sim_validate.simulation.gate import gate as gate_module
from sim_validate.simulation.gate.gate import measured_gate
from sim_validate.validation.jobs import Job, prepared, verdict_of

FRICTION = 0.5
SHORT = Agenda(critical_friction=False, controls=False)


def jobs():
    body = example_object("tetrahedron")
    grasps = gc.plan(body, FRICTION, limit=2).grasps
    return [Job(body, grasp, FRICTION, SHORT, Setup()) for grasp in grasps]


def test_grasps_of_one_object_arrive_with_one_object():
    first, second = (pickle.loads(pickle.dumps(job)) for job in jobs())  # noqa: S301
    assert first.body is second.body
    assert first.body.content_sha256 == jobs()[0].body.content_sha256
    assert [first.grasp.id, second.grasp.id] == [job.grasp.id for job in jobs()]


def test_a_worker_takes_over_how_the_simulator_did(monkeypatch):
    job, _ = prepared(jobs(), 1)
    assert job.gate is measured_gate(Setup(), FRICTION, job.body.radius)
    arrived = pickle.loads(pickle.dumps(job))  # noqa: S301

    def fail(_):
        raise AssertionError("measured again")

    # as in a new process
    monkeypatch.setattr(gate_module, "_KNOWN", {})
    monkeypatch.setattr(gate_module, "_measured", fail)
    assert verdict_of(arrived).held
    assert verdict_of(arrived).gate == job.gate

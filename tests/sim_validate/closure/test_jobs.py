"""Grasps that are sent to other processes, with all that they have in common."""

import pickle

import grasp_core as gc
from scenes.example_objects import example_object
from sim_validate import Agenda, Setup
from sim_validate.closure.validate import Job
from sim_validate.engine import gate as gate_module
from sim_validate.engine.gate import measured_gate

FRICTION = 0.5
SHORT = Agenda(critical_friction=False, controls=False)


def test_a_worker_takes_over_how_the_simulator_did(monkeypatch):
    body = example_object("tetrahedron")
    (grasp,) = gc.plan(body, FRICTION, limit=1).grasps
    job = Job(body, FRICTION, SHORT, Setup()).prepared(1, 1)
    assert job.gate is measured_gate(Setup(), FRICTION, body.radius)
    arrived = pickle.loads(pickle.dumps(job))  # noqa: S301

    def fail(_):
        raise AssertionError("measured again")

    monkeypatch.setattr(gate_module, "measured", fail)
    assert arrived(grasp).held
    assert arrived(grasp).gate == job.gate

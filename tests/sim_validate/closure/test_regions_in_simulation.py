"""Contacts anywhere in certified regions hold in simulation, and are lost outside, not inside."""

import numpy as np
import pytest

import grasp_core as gc
import scenes
from tests.benchmarks.regions import FRICTION, Task, examine
from tests.marks import more

CONES = 1_250


@pytest.mark.slow
@pytest.mark.parametrize("family", ["regulus", *more("concurrent", "free", "pencil")])
def test_what_the_regions_say_is_so_in_simulation(family):
    tested, far = 0, np.zeros((0, 2))
    for name in ("wedge", "hex-nut", "octahedron", "mug"):
        body = scenes.example_object(name)
        if not gc.plan(body, FRICTION, families=(family,), limit=1).grasps:
            continue
        task = Task(name, family, 0, 0, choices=60, simulate=True, cones=CONES)
        answer = examine((task, 1))
        assert answer.proved
        assert answer.verified
        assert (answer.opened, answer.tried) == (0, 60)
        assert answer.dropped == 0
        assert answer.simulated >= 15
        far = np.vstack([far, [walk[1:] for walk in answer.walks]])
        tested += 1
    assert tested >= 2
    assert (far > 1.0).all()
    assert (far[:, 1] >= far[:, 0]).all()  # not lost before closure is
    assert np.isfinite(far).all(axis=1).any()  # some walks end before they leave their faces

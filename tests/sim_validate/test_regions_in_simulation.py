"""Contacts anywhere in certified regions hold in simulation, and are lost outside, not inside."""

import numpy as np
import pytest

from tests.benchmarks.regions import FAMILIES, Task, examine

CONES = 1_250


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("name", ["wedge", "hex-nut", "octahedron"])
def test_what_the_regions_say_is_so_in_simulation(name, family):
    task = Task(name, family, 0, 0, choices=60, simulate=True, closely=False, cones=CONES)
    try:
        answer = examine((task, 1))
    except IndexError:
        pytest.skip(f"no {family} grasp of {name}")
    assert answer.proved
    assert answer.verified
    assert (answer.opened, answer.tried) == (0, 60)
    assert answer.dropped == 0
    assert answer.simulated >= 15
    far = np.array([walk[1:] for walk in answer.walks])
    assert len(far) >= 3
    assert (far > 1.0).all()
    assert (far[:, 1] >= far[:, 0]).all()  # not lost before closure is

"""Many limits at once are those of one at a time, and what is not proved is solved by itself."""

import numpy as np
import pytest

import grasp_core as gc
from grasp_core.closure.force_closure import force_closure
from grasp_core.compiled import compiled
from grasp_core.quality import wrench_limits
from grasp_core.quality.wrench_limits import CLOSE, KERNEL, many_limits
from scenes.example_objects import example_object

COUNT = 60


def asked(name, friction):
    """A grasp's contacts, balanced forces, and wrenches of many lengths and directions."""
    body = example_object(name)
    grasp = gc.plan(body, 0.5, limit=1).grasps[0]
    friction = friction or 1.02 * grasp.critical_friction + 1e-3
    inside = force_closure(grasp, friction=friction).forces
    rng = np.random.default_rng(0)
    wrenches = rng.normal(size=(COUNT, 6)) * 10.0 ** rng.uniform(-2, 2, (COUNT, 1))
    wrenches[:, 3:] *= body.radius
    wrenches[:20, 3:] = 0.0
    wrenches[20:40, :3] = 0.0
    return body, grasp, friction, inside, wrenches


def many(body, grasp, friction, inside, wrenches):
    return many_limits(
        grasp.positions, grasp.normals, friction, wrenches, inside, max_normal_force=7.0,
        center=body.center_of_mass,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["wedge", "dodecahedron", "mug", "double-wedge-bar"])
@pytest.mark.parametrize("friction", [None, 0.5, 2.0])
def test_limits_are_those_of_the_conic_program(name, friction, monkeypatch):
    """Both have two bounds, at most `CLOSE` apart here and ten times that there."""
    case = asked(name, friction)
    body, grasp, friction, _, wrenches = case
    expected = gc.wrench_limits(
        grasp, None, friction, wrenches, max_normal_force=7.0, center=body.center_of_mass
    )
    alone = []
    limit = wrench_limits.limit_of
    monkeypatch.setattr(wrench_limits, "limit_of", lambda *given: alone.append(1) or limit(*given))
    found = many(*case)
    np.testing.assert_allclose(found, [each.limit for each in expected], rtol=11.0 * CLOSE)
    if friction == 0.5:
        assert len(alone) < 0.2 * COUNT


def test_what_is_wrong_is_solved_by_itself(monkeypatch):
    """A negative control: facets or multiples that are off do not pass."""
    case = asked("wedge", 0.5)
    expected = many(*case)
    kernel = compiled(KERNEL)
    spoils = [
        lambda found, *_: found.__imul__(1.01), lambda _, forces, __: forces.__imul__(1.01),
        lambda *given: given[2].__iadd__(0.3), lambda found, *_: found.fill(np.nan),
    ]  # fmt: skip
    for spoil in spoils:

        class Spoiled:
            Contacts = kernel.Contacts

            @staticmethod
            def limits(contacts, loads, *filled, spoil=spoil):
                kernel.limits(contacts, loads, *filled)
                spoil(*filled)

        monkeypatch.setattr(wrench_limits, "compiled", lambda _, other=Spoiled: other)
        np.testing.assert_allclose(many(*case), expected, rtol=11.0 * CLOSE)

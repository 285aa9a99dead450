"""Contacts may be given as values, too: every function takes them where it takes positions."""

import pytest

import grasp_core as gc
import scenes

BODY = scenes.example_object("wedge")
GRASP = gc.plan(BODY, 0.5, limit=1)[0]
CONTACTS = list(GRASP.contacts)
LOAD = (0.0, 0.0, -1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "judged",
    [
        lambda given: gc.force_closure(given, friction=0.5).closed,
        gc.critical_friction,
        lambda given: gc.critical_friction_interval(given).upper,
        lambda given: gc.min_weight(given, friction=0.5),
        lambda given: (
            gc.ferrari_canny(
                given, friction=0.5, center=BODY.center_of_mass, torque_scale=BODY.radius
            ).lower
        ),
        lambda given: gc.wrench_limits(given, None, 0.5, [LOAD], max_normal_force=10.0)[0].limit,
        lambda given: gc.contact_forces(given, None, 0.5, LOAD).tolist(),
        lambda given: gc.smallest_singular_value(given, torque_scale=BODY.radius),
    ],
)
def test_contacts_are_judged_as_the_grasp_that_has_them(judged):
    wanted = judged(GRASP)
    assert judged(CONTACTS) == judged(tuple(CONTACTS)) == wanted
    assert judged(CONTACTS[::-1]) is not None


@pytest.mark.parametrize(
    ("given", "normals"),
    [(CONTACTS, GRASP.normals), (GRASP, GRASP.normals), ([*CONTACTS, 3], None), ([], None)],
)
def test_what_is_given_twice_or_is_no_contact_is_refused(given, normals):
    with pytest.raises(gc.InputError, match=r"normals (must|are)|positions must"):
        gc.force_closure(given, normals, friction=0.5)

import numpy as np
import pytest

import grasp_core as gc
import scenes


@pytest.fixture(scope="module")
def plan():
    return gc.plan(scenes.example_object("wedge"), 0.5)


def test_a_plan_is_a_sequence_of_its_grasps(plan):
    assert len(plan) == len(plan.grasps) > 50
    assert list(plan) == list(plan.grasps)
    assert plan[0] is plan.grasps[0]
    assert plan[-1] is plan.grasps[-1]
    with pytest.raises(IndexError):
        plan[len(plan)]


def test_a_grasp_is_found_by_its_id(plan):
    for grasp in plan:
        assert plan[grasp.id] is grasp
        assert grasp.id in plan
        assert grasp in plan
    assert "c-9-9-9-9" not in plan
    with pytest.raises(KeyError, match=r"c-9-9-9-9.*there are .* more"):
        plan["c-9-9-9-9"]
    with pytest.raises(KeyError, match="no grasps"):
        plan[:0]["c-9-9-9-9"]


def test_a_slice_is_a_plan_of_the_same_object(plan):
    some = plan[2:9:3]
    assert isinstance(some, gc.Plan)
    assert some.grasps == (plan[2], plan[5], plan[8])
    assert some.body is plan.body
    assert some.counts is plan.counts


@pytest.mark.parametrize(
    ("demand", "meets"),
    [
        ({"family": "pencil"}, lambda g: g.family == "pencil"),
        ({"family": ["pencil", "regulus"]}, lambda g: g.family in {"pencil", "regulus"}),
        ({"family": ("free",)}, lambda g: g.id.startswith("f-")),
        ({"family": ("free", "pencil")}, lambda g: g.id[0] in "fp"),
        ({"min_radius_m": 0.004}, lambda g: g.radius >= 0.004),
        ({"min_closure_margin": 0.05}, lambda g: g.closure_margin >= 0.05),
        ({"max_critical_friction": 0.2}, lambda g: g.critical_friction <= 0.2),
        ({"min_ferrari_canny_n": 0.05}, lambda g: g.ferrari_canny[0] >= 0.05),
        ({"where": lambda g: 3 in g.faces}, lambda g: 3 in g.faces),
    ],
)
def test_a_filter_keeps_what_meets_the_demand_in_order(plan, demand, meets):
    kept = plan.filter(**demand)
    assert 0 < len(kept) < len(plan)
    assert list(kept) == [grasp for grasp in plan if meets(grasp)]


@pytest.mark.parametrize(
    ("demand", "words"),
    [
        ({"family": ["pencil", "square"]}, "family"),
        ({"min_radius_m": "a"}, "min_radius_m"),
        ({"max_critical_friction": float("nan")}, "max_critical_friction"),
        ({"where": 3}, "where"),
    ],
)
def test_demands_that_make_no_sense_are_refused(plan, demand, words):
    with pytest.raises(gc.InputError, match=words):
        plan.filter(**demand)


def test_a_table_has_the_figures_of_each_grasp(plan):
    table = plan[:20].to_dataframe()
    assert table.index.tolist() == [grasp.id for grasp in plan[:20]]
    for grasp in plan[:20]:
        row = table.loc[grasp.id]
        assert row.family == grasp.family
        assert row.radius_m == grasp.radius
        assert row.critical_friction == grasp.critical_friction
        assert (row.ferrari_canny_lower_n, row.ferrari_canny_upper_n) == grasp.ferrari_canny
        assert np.radians(row.span_angle_deg) == pytest.approx(grasp.span_angle)
        for finger, contact in enumerate(grasp.contacts):
            assert row[f"face_{finger}"] == grasp.faces[finger]
            for axis, name in enumerate("xyz"):
                assert row[f"position_{finger}_{name}_m"] == contact.position[axis]
                assert row[f"normal_{finger}_{name}"] == contact.normal[axis]


def test_a_table_without_pandas_says_what_to_install(plan, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(gc.InputError, match="pip install pandas"):
        plan.to_dataframe()

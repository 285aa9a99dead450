"""Objects have classes, points, resting poses, units, scales, and splits that are never empty."""

from collections import Counter

import numpy as np
import pytest

import grasp_core as gc
from scenes.example_objects import example_object
from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.describing.card import CARD
from sim_validate.datasets.learning.objects import box_sides, cloud, rest_rows, shape_class
from sim_validate.datasets.learning.settings import Learning
from sim_validate.datasets.learning.splitting import assigned
from sim_validate.datasets.object_rows import object_row
from sim_validate.datasets.units import body_of, units_of
from sim_validate.datasets.verifying.verify import verify
from tests.sim_validate.datasets.forging import forged
from tests.sim_validate.datasets.learned import BODIES, LEARNED, rows_of


def box(*sides):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * sides
    hull = gc.from_trimesh(__import__("trimesh").convex.convex_hull(corners))
    assert len(hull.faces) == 6
    return hull


def test_objects_have_classes_and_sides_of_their_own_mesh(learned):
    rows = {row["object_id"]: row for row in rows_of(learned, "objects")}
    assert set(rows) == set(BODIES)
    for name, body in BODIES.items():
        assert rows[name]["shape_class"] == LEARNED.learning.classes.get(
            body.name, shape_class(body)
        )
        assert rows[name]["box_sides_m"] == pytest.approx(box_sides(body), rel=1e-9)
        assert rows[name]["scale"] == LEARNED.learning.scale_of(body.name)
        assert rows[name]["unit"] == "m"
    assert {row["shape_class"] for row in rows.values()} == {"ramp", "convex compact planar"}


def test_a_box_has_its_own_sides_and_proportions():
    assert box_sides(box(0.1, 0.3, 0.2)) == pytest.approx([0.3, 0.2, 0.1], rel=1e-9)
    assert shape_class(box(0.1, 0.1, 0.1)) == "convex compact planar"
    assert shape_class(box(0.1, 0.1, 0.4)) == "convex long planar"
    assert shape_class(box(0.1, 0.4, 0.4)) == "convex flat planar"
    for name in ("l-bracket", "cross", "hex-nut"):
        assert shape_class(example_object(name)).startswith("concave")


def test_points_lie_on_the_surface_with_its_normals_and_fill_it_evenly():
    """A face with the share p of the area gets n p of n points, within five deviations."""
    body, count = box(0.1, 0.2, 0.3), 6000
    points, normals = cloud(body, count, 0)
    for face in body.faces:
        on_it = np.abs((points - face.centroid) @ face.normal) <= 1e-12
        on_it &= normals @ face.normal > 0.5
        share = face.area / sum(each.area for each in body.faces)
        slack = 5.0 * np.sqrt(count * share * (1.0 - share))
        assert abs(on_it.sum() - count * share) <= slack
    assert not np.array_equal(points, cloud(body, count, 1)[0])
    assert np.array_equal(points, cloud(body, count, 0)[0])


def test_the_dataset_has_the_points_that_are_drawn(learned):
    for row in rows_of(learned, "objects"):
        points, normals = cloud(BODIES[row["object_id"]], LEARNED.learning.points, LEARNED.seed)
        assert row["cloud_points_m"] == points.tolist()
        assert row["cloud_normals"] == normals.tolist()


def test_an_object_rests_on_the_table_with_its_centre_of_mass_above(learned):
    rows = rows_of(learned, "rests")
    assert set(Counter(row["object_id"] for row in rows)) == set(BODIES)
    for row in rows:
        body, pose = BODIES[row["object_id"]], np.array(row["T_table_object_m"])
        assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
        placed = body.vertices @ pose[:3, :3].T + pose[:3, 3]
        assert placed[:, 2].min() == pytest.approx(0.0, abs=1e-7 * body.radius)
        assert (placed[:, 2] < 1e-6 * body.radius).sum() >= 3
        center = pose[:3, :3] @ body.center_of_mass + pose[:3, 3]
        assert center == pytest.approx([0.0, 0.0, row["height_m"]], abs=1e-7 * body.radius)
        assert pose[:3, :3] @ row["down"] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)


def test_the_likelihoods_of_a_box_fill_the_sphere():
    rows = list(rest_rows(box(0.1, 0.2, 0.3)))
    assert len(rows) == 6
    assert sum(row["likelihood"] for row in rows) == pytest.approx(1.0, abs=1e-9)
    assert rows[0]["height_m"] == pytest.approx(0.05, rel=1e-9)


@pytest.mark.parametrize("count", range(3, 40))
@pytest.mark.parametrize("by", ["object", "class"])
def test_no_split_of_three_objects_or_more_is_empty(count, by):
    for kinds in (1, 2, 3, 5):
        classes = {f"o{i}": f"k{i % kinds}" for i in range(count)}
        found = assigned(classes, by, seed=count)
        sizes = Counter(found.values())
        assert set(found) == set(classes)
        assert set(sizes) == {"train", "validation", "test"}, (kinds, sizes)
        assert sizes["train"] >= max(1, count // 3)
        if by == "class" and len(set(classes.values())) >= 3:
            for kind in set(classes.values()):
                assert len({found[name] for name in classes if classes[name] == kind}) == 1


def test_a_seed_draws_another_split():
    classes = {f"o{i}": "k" for i in range(30)}
    assert assigned(classes, "object", 0) != assigned(classes, "object", 1)
    assert assigned(classes, "object", 0) == assigned(classes, "object", 0)
    assert Counter(assigned(classes, "object", 0).values())["test"] == 3
    assert assigned({"a": "k"}, "object", 0) == {"a": "train"}
    assert sorted(assigned({"a": "k", "b": "l"}, "class", 0).values()) == ["test", "train"]


def test_units_and_scales_of_files_are_their_own(tmp_path):
    text = gc.Polyhedron.to_trimesh(box(1.0, 2.0, 3.0)).export(file_type="obj")
    paths = [tmp_path / name for name in ("a.mm.obj", "b.obj", "c.in.obj")]
    for number, path in enumerate(paths):
        path.write_text(f"# {number}\n{text}", encoding="utf-8")
    config = DatasetConfig(
        objects=tuple(map(str, paths)), unit="cm",
        learning=Learning(units_in_names=True, units={"c.in.obj": "m"}, scales={"b.obj": 2.0}),
    )  # fmt: skip
    longest = {unit.path.name: box_sides(body_of(unit))[0] for unit in units_of(config)}
    assert longest == pytest.approx({"a.mm.obj": 0.003, "b.obj": 0.06, "c.in.obj": 3.0}, rel=1e-6)


def test_the_scale_of_a_dataset_is_for_files_without_one_of_their_own(tmp_path):
    text = gc.Polyhedron.to_trimesh(box(0.01, 0.02, 0.03)).export(file_type="obj")
    paths = [tmp_path / name for name in ("a.obj", "b.obj")]
    for number, path in enumerate(paths):
        path.write_text(f"# {number}\n{text}", encoding="utf-8")
    for learning, own in ((None, 0.5), (Learning(scales={"b.obj": 2.0}), 2.0)):
        config = DatasetConfig(
            objects=(*map(str, paths), "wedge"), scale=0.5, unit="m", learning=learning
        )
        units = {unit.object: unit for unit in units_of(config)}
        longest = [box_sides(body_of(units[str(path)]))[0] for path in paths]
        assert longest == pytest.approx([0.015, 0.03 * own], rel=1e-6)
        assert body_of(units["wedge"]) == example_object("wedge")
        rows = [object_row(body_of(unit), unit) for unit in units.values()]
        assert {(row["source_name"], row["unit"], row["scale"]) for row in rows} == {
            ("a.obj", "m", 0.5), ("b.obj", "m", own), ("wedge", "m", 1.0)
        }  # fmt: skip
        names = [[each.name for each in unit.config.tables["objects"]] for unit in units.values()]
        assert all({"unit", "scale"} < {*columns} for columns in names)
        assert len(set(map(tuple, names))) == 1


def test_a_unit_does_not_depend_on_the_tables_of_other_objects():
    one = DatasetConfig(objects=("wedge",), learning=Learning(scales={"wedge": 2.0}))
    two = DatasetConfig(
        objects=("wedge", "prism"), learning=Learning(scales={"wedge": 2.0, "prism": 3.0})
    )
    ids = {unit.object: unit.id for unit in units_of(two)}
    assert ids["wedge"] == units_of(one)[0].id


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"units": {"x.stl": "mm"}}, "no object or mesh file is named"),
        ({"scales": {"wedge": 0.0}}, "scales must be"),
        ({"units": {"wedge": "ft"}}, "units must be"),
        ({"points": -1}, "points must be"),
        ({"split_by": "mesh"}, "split_by must be"),
        ({"figures": ("beauty",)}, "figures must be"),
        ({"seeds": (1, 1)}, "seeds: expected different items"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, message):
    with pytest.raises(gc.InputError, match=message):
        DatasetConfig(objects=("wedge",), learning=Learning(**settings))


@pytest.mark.parametrize(
    ("table", "cells", "message"),
    [
        ("objects", {"shape_class": "cup"}, "shape_class of"),
        ("objects", {"box_sides_m": [1.0, 1.0, 1.0]}, "box_sides_m of"),
        ("objects", {"scale": 3.0}, "unit and scale of"),
        ("objects", {"cloud_points_m": [[0.0] * 3] * 64}, "cloud_points_m of"),
        ("rests", {"height_m": 1.0}, "resting poses of"),
    ],
)
def test_forged_rows_are_named(spoiled, table, cells, message):
    forged(spoiled, table, lambda rows: rows[0].update(cells))
    assert any(message in fault for fault in verify(spoiled))


def test_the_readme_says_how_objects_are_divided(learned):
    text = (learned / CARD).read_text(encoding="utf-8")
    assert "A tenth of the objects, at least one" in text
    assert "| `cloud_points_m` | float [64, 3] |" in text
    assert 'config_name: "rests"' in text

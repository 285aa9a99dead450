import dataclasses
import shutil

import pytest
import trimesh

from sim_validate.datasets.config import DatasetConfig
from sim_validate.datasets.units import body_of, units_of

CONFIG = DatasetConfig(objects=("wedge", "tetrahedron"), frictions=(0.3, 0.5), limit=4)


@pytest.fixture
def mesh(tmp_path):
    path = tmp_path / "block.stl"
    trimesh.creation.box(extents=(0.04, 0.05, 0.06)).export(path)
    return path


def test_every_object_is_a_unit_at_every_friction_in_any_order():
    units = units_of(CONFIG)
    assert {(unit.object, unit.friction) for unit in units} == {
        (name, friction) for name in CONFIG.objects for friction in CONFIG.frictions
    }
    turned = units_of(dataclasses.replace(CONFIG, objects=CONFIG.objects[::-1]))
    assert [unit.id for unit in turned] == [unit.id for unit in units]
    assert len({unit.id for unit in units}) == len(units)


def test_names_of_units_know_the_bytes_of_a_mesh_but_not_where_it_lies(mesh, tmp_path):
    (unit,) = units_of(DatasetConfig(objects=(str(mesh),)))
    copied = tmp_path / "elsewhere.stl"
    shutil.copy(mesh, copied)
    (same,) = units_of(DatasetConfig(objects=(str(copied),)))
    assert same.id == unit.id
    trimesh.creation.box(extents=(0.04, 0.05, 0.07)).export(mesh)
    (changed,) = units_of(DatasetConfig(objects=(str(mesh),)))
    assert changed.id != unit.id
    assert len(body_of(changed).faces) == 6


@pytest.mark.parametrize(
    "changed", [{"limit": 5}, {"seed": 1}, {"families": ("free",)}, {"limits": "ramp"}]
)
def test_names_of_units_change_with_every_setting_that_decides_rows(changed):
    before = {unit.id for unit in units_of(CONFIG)}
    assert not before & {unit.id for unit in units_of(dataclasses.replace(CONFIG, **changed))}


def test_more_objects_and_frictions_leave_the_units_that_were_there():
    more = dataclasses.replace(
        CONFIG, objects=(*CONFIG.objects, "prism"), frictions=(0.3, 0.5, 1.0)
    )
    assert {unit.id for unit in units_of(CONFIG)} < {unit.id for unit in units_of(more)}

"""Configurations of datasets and the units of work that they make."""

import dataclasses
import shutil

import pytest
import trimesh

import grasp_core as gc
from sim_validate.datasets.config import DatasetConfig, config_from_toml, config_to_toml
from sim_validate.datasets.work_units import body_of, units_of

SETTINGS = {"objects": ["wedge", "dodecahedron"], "frictions": [0.3, 1], "limit": 4, "seed": 7}


def test_a_configuration_is_the_same_when_it_is_written_and_read_again(tmp_path):
    config = DatasetConfig.of_table(SETTINGS)
    path = tmp_path / "dataset.toml"
    path.write_text(config_to_toml(config))
    assert config_from_toml(path) == config
    assert config_from_toml(path).sha256 == config.sha256
    assert config.frictions == (0.3, 1.0)


def test_names_with_quotes_and_control_characters_survive(tmp_path):
    odd = DatasetConfig(objects=('a"b\\c', "tab\there", "line\nbreak", "ring\u00f6", "bell\x07"))
    path = tmp_path / "dataset.toml"
    path.write_text(config_to_toml(odd), encoding="utf-8")
    assert config_from_toml(path) == odd


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"objects": []}, "objects: expected a list of one or more"),
        ({"frictions": [0.0]}, r"frictions\[0\] must be a number from 1e-09 up to 1000, got"),
        ({"families": ["spiral"]}, r"families\[0\] must be one of concurrent"),
        ({"limit": 1.5}, "limit must be a whole number"),
        ({"scale": 0}, "scale must be a number from 1e-09"),
        ({"published": "2026-02-30"}, "published: expected a day"),
        ({"colour": "red"}, "no setting is named .colour."),
        ({"learning": {"moved_in": 1}}, "no setting is named"),
        ({"learning": {"mass_near": 1}}, "only executed grasps have a mass"),
        ({"learning": {"seeds": [1, 1]}}, "seeds: expected different items"),
    ],
)
def test_what_is_refused_names_the_setting_and_what_was_expected(changed, message):
    with pytest.raises(gc.InputError, match=message):
        DatasetConfig.of_table(SETTINGS | changed)


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

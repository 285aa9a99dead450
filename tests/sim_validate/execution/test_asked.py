"""The table `[execution]` of a file: what it may say, and that it is written as it was read."""

import dataclasses
import tomllib

import pytest

import grasp_core as gc
import sim_validate as sv
from grasp_core.settings import as_table
from scenes.example_objects import example_object
from sim_validate.datasets.config import DatasetConfig, config_from_toml, config_to_toml

TABLE = {
    "density_kg_m3": 700, "trials": ["lift", "weight"], "tip_radius_m": 0.004, "down": [1, 0, 0],
}  # fmt: skip


def of_table(table):
    return sv.ExecutionSettings.of_table(table, "execution")


def test_a_table_says_how_objects_are_executed():
    asked = of_table(TABLE)
    assert asked.trials == ("weight", "lift")
    assert asked.down == (1.0, 0.0, 0.0)
    wedge = example_object("wedge")
    mass = wedge.mass_at(700.0)
    assert asked.for_body(wedge) == dataclasses.replace(asked, mass_kg=mass, density_kg_m3=None)
    assert of_table({"mass_kg": 2}).for_body(wedge) == sv.ExecutionSettings(mass_kg=2.0)


def test_an_object_of_which_nothing_is_known_has_the_density_of_water():
    wedge = example_object("wedge")
    assert of_table({}).for_body(wedge).object_kg == wedge.mass_at(1000.0)
    with pytest.raises(gc.InputError, match="mass of the object is not known"):
        assert of_table({}).object_kg


@pytest.mark.parametrize("table", [TABLE, {"mass_kg": 0.3}])
def test_a_configuration_is_the_same_when_it_is_written_and_read_again(tmp_path, table):
    asked = of_table(table)
    assert of_table(as_table(asked)) == asked
    config = DatasetConfig(objects=("wedge",), execution=asked)
    path = tmp_path / "dataset.toml"
    path.write_text(config_to_toml(config))
    assert config_from_toml(path) == config


def test_a_configuration_without_executions_does_not_mention_them():
    plain, executed = (
        config_to_toml(DatasetConfig(objects=("wedge",), execution=asked))
        for asked in (None, of_table(TABLE))
    )
    assert "execution" not in plain
    assert executed.startswith(plain)
    assert tomllib.loads(executed)["execution"]["density_kg_m3"] == 700.0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("soft", "execution: expected a table of settings, got 'soft'"),
        ({"mass_kg": 1.0, "density_kg_m3": 1.0}, "execution: mass_kg and density_kg_m3 exclude"),
        ({"mass_kg": 1.0, "left": 1}, "execution: no setting is named 'left'"),
        ({"density_kg_m3": True}, "execution.density_kg_m3 must be a number"),
    ],
)
def test_what_is_refused_names_the_setting(table, message):
    with pytest.raises(gc.InputError) as raised:
        of_table(table)
    assert message in str(raised.value)


def test_a_density_that_makes_an_object_too_light_is_refused():
    wedge = example_object("wedge")
    with pytest.raises(gc.InputError, match="mass_kg"):
        of_table({"density_kg_m3": 1e-9}).for_body(wedge)

import dataclasses
import tomllib

import pytest

import grasp_core as gc
import sim_validate as sv
from scenes.example_objects import example_object
from sim_validate.datasets.config import DatasetConfig, config_from_toml, config_to_toml
from sim_validate.execution.settings import AskedExecution, execution_table

TABLE = {
    "density_kg_m3": 700, "trials": ["lift", "weight"], "tip_radius_m": 0.004,
    "hand": {"down": [1, 0, 0]},
}  # fmt: skip


def test_a_table_says_how_objects_are_executed():
    asked = AskedExecution.of_table(TABLE)
    assert asked.settings.trials == ("weight", "lift")
    assert asked.settings.hand.down == (1.0, 0.0, 0.0)
    wedge = example_object("wedge")
    settings = asked.settings_for(wedge)
    assert settings == dataclasses.replace(asked.settings, mass_kg=wedge.mass_at(700.0))
    heavy = AskedExecution.of_table({"mass_kg": 2})
    assert heavy.settings_for(wedge) == sv.ExecutionSettings(mass_kg=2.0)


@pytest.mark.parametrize("table", [TABLE, {"mass_kg": 0.3}])
def test_a_configuration_is_the_same_when_it_is_written_and_read_again(tmp_path, table):
    asked = AskedExecution.of_table(table)
    assert AskedExecution.of_table(execution_table(asked)) == asked
    config = DatasetConfig(objects=("wedge",), execution=asked)
    path = tmp_path / "dataset.toml"
    path.write_text(config_to_toml(config))
    assert config_from_toml(path) == config


def test_a_configuration_without_executions_does_not_mention_them():
    plain, executed = (
        config_to_toml(DatasetConfig(objects=("wedge",), execution=asked))
        for asked in (None, AskedExecution.of_table(TABLE))
    )
    assert "execution" not in plain
    assert executed.startswith(plain)
    assert tomllib.loads(executed)["execution"]["density_kg_m3"] == 700.0


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("soft", "execution: expected a table of settings, got 'soft'"),
        ({}, "execution: expected one of mass_kg and density_kg_m3, got neither"),
        ({"mass_kg": 1.0, "density_kg_m3": 1.0}, "got both"),
        ({"mass_kg": 1.0, "hand": {"left": 1}}, "execution.hand: no setting is named 'left'"),
        ({"density_kg_m3": True}, "execution: density_kg_m3 must be a number"),
    ],
)
def test_what_is_refused_names_the_setting(table, message):
    with pytest.raises(gc.InputError) as raised:
        AskedExecution.of_table(table)
    assert message in str(raised.value)


def test_a_density_that_makes_an_object_too_light_is_refused():
    wedge = example_object("wedge")
    with pytest.raises(gc.InputError, match="mass_kg"):
        AskedExecution(sv.ExecutionSettings(mass_kg=1.0), 1e-9).settings_for(wedge)

import pytest

import grasp_core as gc
from sim_validate.datasets.config import DatasetConfig, config_from_toml, config_to_toml

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
        ({"frictions": [0.0]}, r"frictions must be .* a number from 1e-09 up to 1000, got"),
        ({"families": ["spiral"]}, r"families must be a sequence, each item one of concurrent"),
        ({"limit": 1.5}, "limit must be a whole number"),
        ({"scale": 0}, "scale must be a number from 1e-09"),
        ({"published": "2026-02-30"}, "published: expected a day"),
        ({"colour": "red"}, "no setting is named .colour."),
    ],
)
def test_what_is_refused_names_the_setting_and_what_was_expected(changed, message):
    with pytest.raises(gc.InputError, match=message):
        DatasetConfig.of_table(SETTINGS | changed)


def test_a_configuration_without_objects_is_refused():
    with pytest.raises(gc.InputError, match="objects: missing; add it"):
        DatasetConfig.of_table({})


@pytest.mark.parametrize("text", ["objects = [", 'objects = ["wedge"]\nlimit = "many"'])
def test_a_bad_file_is_named(tmp_path, text):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(gc.InputError, match=r"bad\.toml"):
        config_from_toml(path)

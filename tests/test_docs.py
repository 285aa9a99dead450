"""What the pages in docs/ show can be done."""

import json
import re
import shlex
from pathlib import Path

import pytest

from sim_validate import cli, commands
from sim_validate.cli import Exit, main
from sim_validate.datasets.config import DatasetConfig, config_from_toml
from sim_validate.datasets.given import read_given
from tests.sim_validate.datasets.small import build_small

DOCS = sorted((Path(__file__).parent.parent / "docs").glob("*.md"))
DATASETS = (Path(__file__).parent.parent / "docs" / "datasets.md").read_text()


def blocks(text, language):
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def shell_lines():
    return [
        pytest.param(line, id=f"{page.stem}: {line[:40]}")
        for page in DOCS
        for block in blocks(page.read_text(), "sh")
        for line in block.splitlines()
        if line.startswith("graspproof ")
    ]


def test_there_are_commands_to_try():
    assert len(shell_lines()) >= 7


@pytest.mark.parametrize("line", shell_lines())
def test_every_command_is_one(line, monkeypatch):
    asked = []
    monkeypatch.setattr(commands, "execute", lambda command: asked.append(command) or Exit.GOOD)
    assert main(shlex.split(line)[1:]) == Exit.GOOD
    assert isinstance(asked[0], cli.Command)


def test_the_settings_of_a_dataset_are_all_shown(tmp_path):
    (text,) = blocks(DATASETS, "toml")
    path = tmp_path / "grasps.toml"
    path.write_text(text)
    config = config_from_toml(path)
    shown = set(re.findall(r"^(\w+) =", text, re.MULTILINE))
    assert set(DatasetConfig.__dataclass_fields__) - shown == {"contacts", "outward"}
    plain = DatasetConfig(objects=config.objects)
    told = {"objects", "frictions", "title", "license", "creator", "url", "published"}
    for name in shown - told:
        assert getattr(config, name) == getattr(plain, name)


def test_the_contacts_file_is_one(tmp_path):
    (text,) = blocks(DATASETS, "json")
    path = tmp_path / "contacts.json"
    path.write_text(text)
    (grasp,) = read_given(path)
    assert grasp.name == json.loads(text)["grasps"][0]["id"]


def test_the_lines_of_python_run(tmp_path, monkeypatch):
    pytest.importorskip("pyarrow")
    build_small(tmp_path / "ds")
    monkeypatch.chdir(tmp_path)
    (code,) = blocks(DATASETS, "python")
    names = {}
    exec(code, names)  # noqa: S102 - it is what the page tells people to run
    assert names["points"].shape[1:] == (4, 3)
    assert len(names["points"])

"""What the README and the pages in docs/ show can be done, and is all there is."""

import ast
import json
import math
import re
import shlex
import tomllib
from dataclasses import fields
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

import grasp_core as gc
import scenes
from grasp_core import errors
from sim_validate import main as commands
from sim_validate.commands.exit_codes import Exit
from sim_validate.datasets.config import DatasetConfig, DatasetHand, Learning, config_from_toml
from sim_validate.datasets.given_grasps import read_given
from sim_validate.engine.held_or_let_go import Outcome
from sim_validate.engine.setup import Setup, setup_from_file, wrenches_from_file
from sim_validate.execution.verdict import Fate
from sim_validate.main import main
from sim_validate.settings import TRIAL_KINDS, ChosenExecution
from tests import file_reference
from tests.sim_validate.datasets.configs import build_small

ROOT = Path(__file__).parent.parent
SITE = ROOT / "docs" / "index.md"
"""The first page of the site, which is no page of its own."""
DOCS = sorted(page for page in SITE.parent.glob("*.md") if page != SITE)
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
PAGES = {page.stem: page.read_text() for page in DOCS}
DATASETS = PAGES["datasets"]
WITH_FILES = {"datasets", "regions", "baselines", "start", "own-hand"}
"""Pages whose code needs files, which tests of their own make."""


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


@pytest.mark.parametrize("line", shell_lines())
def test_every_command_is_one(line, monkeypatch):
    asked = []
    monkeypatch.setattr(commands, "_dispatch", lambda name, _: asked.append(name) or Exit.GOOD)
    words, _, code = line.partition("# exit code")
    wanted = Exit.USAGE if code.strip() == "2" else Exit.GOOD
    assert main(shlex.split(words)[1:]) == wanted
    assert wanted == Exit.USAGE or asked[0] in commands.COMMANDS


EXIT_CODES = PAGES["commands"].partition("## Exit codes")[2]


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(PAGES["simulation"], id="simulation", marks=pytest.mark.slow),
        pytest.param(EXIT_CODES, id="exit codes"),
    ],
)
def test_commands_end_as_the_page_says(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = [line for block in blocks(text, "sh") for line in block.splitlines()]
    for line in lines:
        words, _, code = line.partition("# exit code")
        assert main(shlex.split(words)[1:]) == int(code or 0), line


EXAMPLES = [
    pytest.param(page, code, said, id=f"{page}-{place}")
    for page, text in PAGES.items() if page not in WITH_FILES
    for place, (code, said) in enumerate(
        re.findall(r"```python\n(.*?)```\n\nprints\n\n```text\n(.*?)```", text, re.DOTALL)
    )
]  # fmt: skip


@pytest.mark.parametrize(("page", "code", "said"), EXAMPLES)
def test_the_examples_print_what_they_say(page, code, said, tmp_path, monkeypatch, capsys):
    """Models that the page shows are files with their names."""
    monkeypatch.chdir(tmp_path)
    for model in blocks(PAGES[page], "xml"):
        (name,) = re.findall(r'<mujoco model="(\w+)">', model)
        (tmp_path / f"{name}.xml").write_text(model)
    exec(compile(code, "<example>", "exec"), {"__name__": "__main__"})  # noqa: S102 - our own page
    assert capsys.readouterr().out == said


def test_every_command_is_described():
    for command in commands.COMMANDS:
        assert f"`graspproof {command}" in PAGES["commands"]


def test_the_examples_of_the_paper_are_those_that_the_planner_finds():
    rows = re.findall(
        r"^\| `([\w-]+)` \| `([\w-]+)` \| (\w+) \| ([\d.]*)[ m]*\| ([\d.]+) \|",
        PAGES["theory"],
        re.MULTILINE,
    )
    assert rows
    for name, grasp_id, family, disc_mm, critical in rows:
        friction = math.tan(math.radians(10.0))
        body = scenes.example_object(name)
        grasp = gc.plan(
            body, friction, families=(family,), settings=gc.PlanSettings(cones="normal")
        )[grasp_id]
        assert f"{1e3 * grasp.radius:.2f}" == (disc_mm or "0.00")
        assert grasp.critical_friction == pytest.approx(float(critical), abs=5e-5)


def test_links_lead_somewhere_and_every_page_is_linked():
    linked = set()
    for path in (ROOT / "README.md", *DOCS, *NOTEBOOKS):
        for link in re.findall(r"\]\(([^)]+)\)", path.read_text()):
            assert not link.startswith("http")
            target = (path.parent / (link.partition("#")[0] or path.name)).resolve()
            assert target.is_file(), link
            linked.add(target)
    assert {page.resolve() for page in (*DOCS, *NOTEBOOKS)} <= linked
    assert {path.resolve() for path in (ROOT / "docs" / "pictures").iterdir()} <= linked


NAMED = re.compile(
    r"`((?:grasp_core|scenes|sim_validate|tests)/[a-z][a-z0-9_./]+\.py)(?:::(\w+))?`"
)


def definitions_of(path):
    return {each.name for each in ast.walk(ast.parse(path.read_text())) if hasattr(each, "name")}


def test_every_module_function_and_test_that_pages_name_exists():
    named = {pair for text in PAGES.values() for pair in NAMED.findall(text)}
    for file, name in sorted(named):
        assert (ROOT / file).is_file(), file
        assert not name or name in definitions_of(ROOT / file), f"{file}::{name}"


def test_columns_of_datasets_are_told_as_their_classes_tell_them():
    assert file_reference.datasets_page() == DATASETS
    assert file_reference.commands_page() == PAGES["commands"]


def listed(page, heading):
    """Names in the first column of the table below a heading."""
    part = PAGES[page].partition(heading)[2]
    rows = re.search(r"((?:^\|.*\n)+)", part, re.MULTILINE)[1].splitlines()[2:]
    return [name for row in rows for name in re.findall(r"`([\w-]+)`", row.split("|")[1])]


def test_the_fields_of_files_are_those_of_the_page(tmp_path):
    assert main(["plan", "wedge", "--limit", "1", "--out", str(tmp_path), "-q"]) == Exit.GOOD
    grasps = json.loads((tmp_path / "grasps.json").read_text())
    assert set(listed("files", "## grasps.json")) | {"schema"} == set(grasps)
    assert set(listed("files", "Each grasp:")) == set(grasps["grasps"][0])
    assert PAGES["files"] == file_reference.page()
    grasp = grasps["grasps"][0]
    for part in (grasps["object"], grasps["object"]["mesh"], grasp["witness"], grasp["regions"][0]):
        assert all(f"`{name}`" in PAGES["files"] for name in part)


def test_the_page_of_executions_names_every_trial_fate_and_flag():
    page = PAGES["simulation"]
    assert listed("simulation", "### The trials") == list(TRIAL_KINDS)
    assert all(f"`{fate}`" in page for fate in get_args(Fate))
    for name in (field.name for field in fields(ChosenExecution) if field.name != "trials"):
        assert f"`--{name.replace('_', '-')}" in page, name


def test_the_files_that_the_page_shows_are_accepted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    contacts, wrenches = blocks(PAGES["files"], "json")
    setup, config = blocks(PAGES["files"], "toml")
    for name, text in (("contacts.json", contacts), ("wrenches.json", wrenches),
                       ("setup.toml", setup), ("config.toml", config)):  # fmt: skip
        Path(name).write_text(text)
    assert main(["analyze", "contacts.json", "-q"]) == Exit.GOOD
    assert [each.name for each in wrenches_from_file(Path("wrenches.json"))] == ["lift"]
    changed = setup_from_file(Path("setup.toml"), Setup())
    assert changed.fingers.max_normal_force_n == 20.0
    assert (changed.hold.load_share, changed.hold.hold_s) == (0.9, 1.0)
    assert main(["plan", "wedge", "--config", "config.toml", "--out", "p", "-q"]) == Exit.GOOD
    planned = json.loads(Path("p/grasps.json").read_text())
    assert planned["friction"] == 0.3
    assert {grasp["family"] for grasp in planned["grasps"]} == {"concurrent", "pencil"}


def test_pages_list_every_exit_code_error_and_outcome():
    codes = re.findall(r"^\| (\d+) \|", EXIT_CODES, re.MULTILINE)
    assert sorted(map(int, codes)) == sorted(int(code) for code in Exit)
    refused = listed("files", "### Why a mesh is refused")
    assert refused == re.findall(r"`(GP-MESH-[\w-]+)`", PAGES["files"])
    assert set(refused) == {reason.value for reason in gc.MeshRefusal}
    known = {name for name in vars(errors) if name.endswith("Error")} - {"GraspError"}
    assert set(listed("files", "## Errors in Python")) == known
    for outcome in Outcome:
        assert f"`{outcome.value}`" in PAGES["simulation"]


def test_the_settings_of_a_dataset_are_all_shown_and_its_contacts_are_read(tmp_path):
    text, more, with_hand = blocks(DATASETS, "toml")
    path = tmp_path / "grasps.toml"
    path.write_text(more)
    assert config_from_toml(path).learning is not None
    assert set(Learning.__dataclass_fields__) == set(tomllib.loads(more)["learning"])
    path.write_text(with_hand)
    assert config_from_toml(path).hand is not None
    known = set(DatasetHand.__dataclass_fields__) - {"density_kg_m3"}  # in place of the mass
    assert set(tomllib.loads(with_hand)["hand"]) == known
    path.write_text(text)
    config = config_from_toml(path)
    shown = set(tomllib.loads(text))
    assert set(DatasetConfig.__dataclass_fields__) - shown == {"contacts", "outward", "learning"}
    assert config.execution.mass_kg == 0.3
    plain = DatasetConfig(objects=config.objects)
    told = {"objects", "frictions", "title", "license", "creator", "url", "published", "execution"}
    told |= {"unit", "hand"}  # none is given, if not
    for name in shown - told:
        assert getattr(config, name) == getattr(plain, name)
    (given,) = blocks(DATASETS, "json")
    path.write_text(given)
    assert [each.name for each in read_given(path)] == [json.loads(given)["grasps"][0]["id"]]


@pytest.mark.slow
def test_the_lines_of_python_run(tmp_path, monkeypatch, capsys):
    pytest.importorskip("pyarrow")
    build_small(tmp_path / "ds")
    monkeypatch.chdir(tmp_path)
    loading, converting, training, *_of_hands = blocks(DATASETS, "python")
    exec(converting, {})  # noqa: S102 - it is what the page tells people to run
    capsys.readouterr()
    names = {}
    exec(loading, names)  # noqa: S102 - it is what the page tells people to run
    assert names["points"].shape[1:] == (4, 3)
    assert len(names["points"])
    exec(training, names)  # noqa: S102 - the same
    assert capsys.readouterr().out == "25 True False\n"
    assert 0 < names["testing"].sum() < len(names["testing"]) == len(names["labels"])
    assert np.isfinite(names["inputs"]).all()

"""What docs/regions.md says, done as it says it."""

import dataclasses
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from grasp_core.certified_regions import CONES, CertifiedRegions
from sim_validate import cli
from sim_validate.region_files import SCHEMA

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "regions.md").read_text()


def block(language):
    (found,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder in which the page's commands were run."""
    folder = tmp_path_factory.mktemp("page")
    for line in block("sh").splitlines():
        words = [word.replace("work", str(folder), 1) for word in shlex.split(line)[1:]]
        assert cli.main([*words, "-q"]) == cli.Exit.GOOD
    return folder


def test_the_example_prints_what_it_says():
    done = subprocess.run([sys.executable, "-c", block("py")], capture_output=True, text=True,
                          check=True)  # fmt: skip
    assert done.stdout == block("text")


def test_the_check_of_the_page_confirms_our_proofs(folder, tmp_path):
    script = tmp_path / "check.py"
    script.write_text(block("python"))
    proofs = sorted(map(str, (folder / "proofs").iterdir()))
    done = subprocess.run([sys.executable, script, *proofs], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("all choices are closed") == len(proofs) == 3


@pytest.mark.parametrize(
    ("name", "factor", "says"),
    [("region2_m", 1.4, "no power"), ("friction", 0.9, "outside"), ("forces", -1.0, "outside"),
     ("depths_m", None, "no power")],
)  # fmt: skip
def test_the_check_of_the_page_refuses_what_is_not_proved(folder, name, factor, says):
    page = {}
    exec(block("python").partition("if __name__")[0], page)  # noqa: S102 - our own page
    with np.load(next((folder / "proofs").iterdir()), allow_pickle=False) as kept:
        proof = {key: kept[key] for key in kept.files}
    assert page["check"](proof) > 0
    proof[name] = np.full(4, 0.3) if factor is None else factor * proof[name]
    with pytest.raises(AssertionError, match=says):
        page["check"](proof)


def test_the_files_hold_what_the_page_lists(folder):
    document = json.loads((folder / "regions.json").read_text())
    assert document.pop("schema") == SCHEMA
    assert f"(schema {SCHEMA})" in PAGE
    fields = re.search(r"`regions.json` \(schema 2\) has (.*?) and for each of", PAGE, re.DOTALL)[1]
    grasps = document.pop("grasps")
    assert set(document) == set(re.findall(r"`(\w+)`", fields))
    listed = set(re.findall(r"^\| (`\w+`(?:, `\w+`)*) \|", PAGE, re.MULTILINE))
    names = set(re.findall(r"`(\w+)`", " ".join(listed)))
    assert set(grasps[0]) <= names
    assert set(grasps[0]["regions"][0]) == {"kind", "polygon_m", "inscribed_radius_m", "area_m2"}
    with np.load(next((folder / "proofs").iterdir()), allow_pickle=False) as proof:
        assert all(f"`{name}`" in PAGE for name in proof.files if "region" not in name)


def test_flags_and_arguments_are_those_of_the_page():
    flags = {each.name.replace("_", "-") for each in dataclasses.fields(cli.Regions)}
    for flag in re.findall(r"^\| `--([\w-]+)", PAGE, re.MULTILINE):
        assert flag in flags
    (cones,) = (each for each in dataclasses.fields(cli.Regions) if each.name == "cones")
    assert cones.default == CONES
    kept = {each.name for each in dataclasses.fields(CertifiedRegions)}
    assert {"limit", "open_choice"} <= kept

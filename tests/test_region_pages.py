"""What docs/regions.md says, done as it says it."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "regions.md").read_text()


def block(language):
    (found,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return found


@pytest.mark.slow
def test_the_example_prints_what_it_says():
    done = subprocess.run([sys.executable, "-c", block("py")], capture_output=True, text=True,
                          check=True)  # fmt: skip
    assert done.stdout == block("text")


def run_check(folder, script):
    script.write_text(block("python"))
    return subprocess.run([sys.executable, "-O", script, folder], capture_output=True, text=True)


@pytest.mark.slow
def test_the_check_of_the_page_confirms_our_proofs_and_compares_the_files(tmp_path):
    """In a folder in which the page's commands were run."""
    folder = tmp_path / "page"
    for line in block("sh").splitlines():
        words = [word.replace("work", str(folder), 1) for word in shlex.split(line)[1:]]
        assert main([*words, "-q"]) == Exit.GOOD
    done = run_check(folder, tmp_path / "check.py")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("all choices are closed at friction 0.5") == 3
    document = json.loads((folder / "regions.json").read_text())
    document["grasps"][0]["regions"][0]["polygon_m"][0][0] += 1e-3
    (folder / "regions.json").write_text(json.dumps(document))
    done = run_check(folder, tmp_path / "check.py")
    assert done.returncode == 1
    assert "other polygons" in done.stderr


@pytest.fixture(scope="module")
def page():
    names = {}
    exec(block("python").partition("if __name__")[0], names)  # noqa: S102 - our own page
    return names


@pytest.fixture(scope="module")
def small(page, tmp_path_factory):
    """A small proof, which the page confirms."""
    out = tmp_path_factory.mktemp("small")
    assert main(["plan", "wedge", "--limit", "1", "--out", str(out), "-q"]) == Exit.GOOD
    asked = ["regions", str(out / "grasps.json"), "--max-cones", "64"]
    assert main([*asked, "--out", str(out), "-q"]) == Exit.GOOD
    with np.load(next((out / "proofs").iterdir()), allow_pickle=False) as kept:
        proof = {key: kept[key] for key in kept.files}
    page["check"](proof)
    return proof


def negated(proof):
    return {"normals": -proof["normals"], "friction": -proof["friction"]}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda p: {"region2_m": 1.4 * p["region2_m"]}, "no power"),
        (lambda p: {"friction": 0.9 * p["friction"]}, "outside"),
        (lambda p: {"friction": 0.99 * p["friction"], "normals": 1.02 * p["normals"]}, "units"),
        (negated, "friction"),
        (lambda _: {"depths_m": np.full(4, 0.3)}, "no power"),
        (lambda p: {"codes": p["codes"][:-1]}, "missing"),
        (lambda p: {"forces": np.vstack([p["forces"], p["forces"][:1]])}, "left over"),
        (lambda _: {"axes": np.ones((6, 6))}, "axes"),
    ],
)
def test_the_check_of_the_page_refuses_what_is_not_proved(page, small, change, says):
    with pytest.raises(SystemExit, match=says):
        page["check"](small | change(small))

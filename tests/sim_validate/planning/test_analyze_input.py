"""What `analyze` reads from files and flags, and what it refuses."""

import copy
import json
import re
from pathlib import Path

import numpy as np
import pytest

from sim_validate.kit.exit_codes import Exit
from sim_validate.main import main
from tests.judges import TETRA_CENTERS, TETRA_NORMALS
from tests.sim_validate.planning.contacts_files import (
    CROSS,
    TETRAHEDRON,
    arms_and_normals,
    contacts,
)

ROOT = Path(__file__).parents[3]


def refused(content, capsys, *flags):
    """What is said about a file that is refused."""
    text = content if isinstance(content, str) else json.dumps(content)
    Path("contacts.json").write_text(text)
    assert main(["analyze", "contacts.json", *flags]) == Exit.INPUT
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert shown.err.startswith("graspproof: contacts.json: ")
    return shown.err


def test_friction_is_that_of_the_contact_then_the_flag_then_the_file(analyze):
    file = {"contacts": contacts(CROSS, -CROSS), "friction": 0.5}
    file["contacts"][0]["friction"] = 0.9

    def used(*flags):
        return analyze(file, *flags)[1]["grasps"][0]["friction"]

    assert used() == [0.9, 0.5, 0.5, 0.5]
    assert used("--friction", "0.3") == [0.9, 0.3, 0.3, 0.3]
    del file["friction"]
    assert used("--friction", "0.2") == [0.9, 0.2, 0.2, 0.2]


def test_outward_normals_are_turned(analyze):
    outward = TETRAHEDRON | {"contacts": contacts(TETRA_CENTERS, -TETRA_NORMALS)}
    assert analyze(outward, "--outward") == analyze(TETRAHEDRON)
    assert analyze(outward) != analyze(TETRAHEDRON)


def test_normals_with_three_digits_are_made_unit_vectors(analyze):
    file = TETRAHEDRON | {"contacts": contacts(TETRA_CENTERS, np.round(TETRA_NORMALS, 3))}
    code, document = analyze(file)
    assert code == Exit.GOOD
    _, normals = arms_and_normals(document["grasps"][0])
    assert normals == pytest.approx(TETRA_NORMALS, abs=1e-12)


def changed(place, value):
    """The file of the tetrahedron with one entry set, or removed where the value is `...`."""
    file = copy.deepcopy(TETRAHEDRON)
    owner = file
    for key in place[:-1]:
        owner = owner[key]
    if value is ...:
        del owner[place[-1]]
    else:
        owner[place[-1]] = value
    return file


ONE = TETRAHEDRON["contacts"][0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("[1]", "a contacts file must hold one JSON object, got a list"),
        (changed(["friction"], None), "friction: null is not allowed; give a value, or leave the"),
        ("{}", '"contacts" (one grasp) or "grasps" (several)'),
        (TETRAHEDRON | {"grasps": [{"contacts": [ONE, ONE]}]}, '"contacts" (one grasp)'),
        (changed(["friction"], ...), 'contacts[0].friction: the key is missing; give it there'),
        (changed(["mu"], 0.5), "no field is named 'mu'; choose from contacts, grasps, friction"),
        (changed(["contacts"], [ONE]), "contacts must have a length of at least 2 and at most 100"),
        (changed(["contacts"], [ONE] * 3), "all contacts lie within"),
        (changed(["contacts", 2, "normal"], [0, 0, 1.01]), "contacts[2].normal: its length must"),
        (changed(["contacts", 3, "normal", 0], float("nan")), "contacts[3].normal[0]: expected a"),
        ({"grasps": [{"contacts": [ONE, ONE | {"normal": 1}]}]},
         "grasps[0].contacts[1].normal must have shape (3,)"),
        ({"grasps": [{"id": "1", "contacts": [ONE, ONE]}, {"contacts": [ONE, ONE]}]},
         "grasps[1].id: '1' is also that of grasps[0]"),
    ],
)  # fmt: skip
def test_a_file_is_refused_by_name_and_field(tmp_path, monkeypatch, capsys, content, words):
    monkeypatch.chdir(tmp_path)
    assert words in refused(content, capsys)


def test_a_file_that_is_missing_or_asks_too_much_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["analyze", "none.json"]) == Exit.INPUT
    assert "none.json: the file cannot be read" in capsys.readouterr().err
    Path("contacts.json").write_text(json.dumps(TETRAHEDRON))
    assert main(["analyze", "contacts.json", "--edges", "2501"]) == Exit.INPUT
    assert "--edges 2500 or less" in capsys.readouterr().err
    assert main(["analyze", "contacts.json", "--friction", "1001"]) == Exit.USAGE
    assert "--friction must be a number from 0 up to 1000" in capsys.readouterr().err


def test_a_config_file_gives_wrenches(analyze):
    Path("c.toml").write_text("wrench = [[0, 0, -1, 0, 0, 0], [1, 0, 0, 0, 0, 0.1]]\nedges = 6\n")
    _, document = analyze(TETRAHEDRON, "--config", "c.toml")
    asked = [found["wrench"] for found in document["grasps"][0]["wrenches"]]
    assert asked == [[0, 0, -1, 0, 0, 0], [1, 0, 0, 0, 0, 0.1]]
    assert document["edges"] == 6


def test_the_page_of_files_shows_one_that_is_read(analyze):
    page = (ROOT / "docs" / "files.md").read_text()
    shown = json.loads(re.search(r"```json\n(.*?)```", page, re.DOTALL)[1])
    code, document = analyze(shown)
    assert code == Exit.GOOD
    assert len(document["grasps"][0]["positions_m"]) == 4
    assert document["grasps"][0]["verified"]["closure"] is True

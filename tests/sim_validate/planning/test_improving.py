import json

import numpy as np

from grasp_core.records.grasps_json import grasps_from_json
from sim_validate.kit.exit_codes import Exit
from sim_validate.main import main


def planned(tmp_path, *flags):
    assert main(["plan", *flags, "--out", str(tmp_path)]) == Exit.GOOD
    text = (tmp_path / "grasps.json").read_text()
    return json.loads(text), grasps_from_json(text)


def test_optimised_grasps_are_better_and_their_file_says_by_how_much(tmp_path, capsys):
    document, saved = planned(tmp_path, "wedge", "--limit", "3", "--optimize", "--ceiling", "20")
    moves = document["optimization"]
    assert len(moves) == 3
    for move in moves:
        before, after = move["ferrari_canny_before"], move["ferrari_canny_after"]
        assert before[0] < before[1] < after[0] < after[1]
        assert after[0] <= move["ferrari_canny_ceiling"]
        assert move["id"] == f"o-{move['moved_from']}"
    qualities = [grasp.ferrari_canny[0] for grasp in saved.grasps]
    assert qualities == sorted(qualities, reverse=True)
    said = capsys.readouterr().out
    assert "3 of 3 grasps improved; gain from " in said
    assert "upper bound" in said


def test_grasps_that_end_at_the_same_contacts_are_kept_once(tmp_path):
    """All families of a tetrahedron are on its four faces; few optima are left of them."""
    document, saved = planned(tmp_path, "tetrahedron", "--optimize")
    assert len(document["optimization"]) == 5
    assert 1 <= len(saved.grasps) < 5
    ids = {move["id"] for move in document["optimization"]}
    assert {grasp.id for grasp in saved.grasps} <= ids
    for i, one in enumerate(saved.grasps):
        for two in saved.grasps[:i]:
            places = [grasp.positions[np.argsort(grasp.faces)] for grasp in (one, two)]
            assert np.abs(places[0] - places[1]).max() > 0.01 * saved.body.radius


def test_optimised_grasps_hold_in_simulation(tmp_path):
    flags = ["tetrahedron", "--limit", "1", "--optimize", "--out", str(tmp_path)]
    assert main(["run", *flags, "--no-report"]) == Exit.GOOD
    verdicts = json.loads((tmp_path / "verdicts.json").read_text())
    assert all(grasp["held"] for grasp in verdicts["verdicts"])
    assert (tmp_path / "scenes" / "o-c-0-1-2-3.xml").exists()

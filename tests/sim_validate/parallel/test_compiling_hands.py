"""The loops of hands that are compiled beforehand are those that reaching uses."""

import pytest

import grasp_core as gc
from grasp_core.compiled import compiled
from sim_validate.cli.exit_codes import Exit
from sim_validate.commands import reach
from sim_validate.main import main
from sim_validate.parallel import compiling_hands
from tests.grasp_core.hands.gripping import FRICTION, grasps, scaled

LOOPS = {
    "grasp_core.hands.pose_kernel": ("settle", "lay", "empty_pose", "empty_sums"),
    "grasp_core.hands.collisions_kernel": ("free_postures", "of_itself", "of_object"),
}


def kinds():
    """For each loop, the kinds of arguments for which it is compiled."""
    return {
        (module, name): list(getattr(compiled(module), name).signatures)
        for module, names in LOOPS.items() for name in names
    }  # fmt: skip


def test_reaching_needs_no_loop_that_was_not_compiled_before():
    hand, body = gc.load_hand("allegro"), scaled("dodecahedron", 0.035)
    compiling_hands.compile_for_hands(hand, body, 0, 1)
    before = kinds()
    assert all(len(each) == 1 for each in before.values()), before
    assert any(
        gc.reach_with(hand, body, g, FRICTION).reached for g in grasps("dodecahedron", 0.035)
    )
    assert kinds() == before


@pytest.mark.parametrize("needed", [True, False])
def test_the_command_says_that_it_compiles_only_where_it_must(
    needed, tmp_path, capsys, monkeypatch
):
    made = []
    monkeypatch.setattr(reach, "must_compile", lambda: needed)
    monkeypatch.setattr(reach, "compile_for_hands", lambda *given: made.append(given))
    assert main(["plan", "l-bracket", "--limit", "1", "--out", str(tmp_path), "-q"]) == Exit.GOOD
    main(["reach", str(tmp_path / "grasps.json"), "--jobs", "2"])
    assert ("compiling inner loops once" in capsys.readouterr().out) is needed
    assert [given[2:] for given in made] == ([(0, 2)] if needed else [])

"""The command `export`: what it writes is what the Python function writes, and what it refuses."""

import pytest

import grasp_core as gc
import scenes
from scenes.exports import ENDINGS
from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main


@pytest.mark.parametrize("to", ["moveit", "gltf"])
def test_it_writes_what_python_writes(wedge_plan, tmp_path, capsys, to):
    ending = ENDINGS[to][0]
    out, wanted = tmp_path / f"out{ending}", tmp_path / f"wanted{ending}"
    assert (
        main(["export", str(wedge_plan), "--to", to, "-o", str(out), "--limit", "1"]) == Exit.GOOD
    )
    assert "with 1 grasp" in capsys.readouterr().out
    scenes.export_grasps(gc.load_grasps(wedge_plan)[:1], wanted, to)
    assert out.read_bytes() == wanted.read_bytes()


def test_what_it_refuses_is_told_with_a_remedy(wedge_plan, tmp_path, capsys):
    def ends(*words):
        code = main(["export", str(wedge_plan), *words])
        return code, capsys.readouterr().err

    out = str(tmp_path / "a.glb")
    assert ends("--to", "moveit", "-o", out) == (
        Exit.USAGE,
        f"graspproof: --out must end in .yaml or .yml with --to moveit, got {out}\n",
    )
    code, said = ends("--to", "gltf", "-o", out, "--fingertip-radius-m", "3")
    assert code == Exit.INPUT
    assert "fingertip_radius_m must be a number from 1e-09 up to" in said
    assert not list(tmp_path.iterdir())


def test_a_file_without_grasps_ends_with_its_own_code(tmp_path, capsys):
    path = tmp_path / "grasps.json"
    gc.save_grasps(path, gc.plan(scenes.example_object("wedge"), 0.5, limit=1)[:0])
    words = ["export", str(path), "--to", "gltf", "-o", str(tmp_path / "a.glb")]
    assert main(words) == Exit.NONE
    assert "holds no grasp" in capsys.readouterr().out

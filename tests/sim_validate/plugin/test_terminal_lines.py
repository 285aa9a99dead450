"""What the terminal says at the end of a run, for lines that are written down here."""

from sim_validate.pytest_plugin import MOST_TOLD, sections

NOTE = "part.obj has changed: face 3 moved"


def line(told="", note=""):
    said = {"mesh_note": note, "grasp_change": told}
    return [("g-1.status", "same"), *(each for each in said.items() if each[1])]


def test_grasps_stand_below_the_part_that_they_were_tested_on():
    lines = [line("b same", note=NOTE), line("a same", note=NOTE), line(note="z.obj: not found")]
    assert sections(lines) == [
        ("meshes of grasps", [NOTE, "  a same", "  b same", "z.obj: not found"])
    ]


def test_a_long_list_is_cut():
    lines = [line(f"{number:03d} same", note=NOTE) for number in range(MOST_TOLD + 3)]
    ((_, texts),) = sections(lines)
    assert len(texts) == 1 + MOST_TOLD + 1
    assert texts[-1] == "  and 3 more; --junitxml FILE lists all"

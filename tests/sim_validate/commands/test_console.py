"""Tables of the console keep their numbers whole, whatever fits."""

from threading import Event

import pytest
from rich.console import Console

from sim_validate.commands import console
from sim_validate.commands.console import Reporter, duration

COLUMNS = ("grasp", *(f"column {place}" for place in range(9)))
ROWS = [(f"c-{row}", *(f"{row}1.{place}7/12.34" for place in range(9))) for row in range(3)]


def printed(width, columns, rows, capsys):
    Reporter(out=Console(highlight=False, width=width)).table("title", columns, rows)
    return capsys.readouterr().out


def test_columns_that_do_not_fit_stand_below_beside_the_first_one(capsys):
    for width in (40, 80, 100, 300):
        shown = printed(width, COLUMNS, ROWS, capsys)
        assert all(len(line.rstrip()) <= width for line in shown.splitlines())
        words = shown.split()
        for row in ROWS:
            assert all(words.count(cell) == 1 for cell in row[1:])
        assert words.count("c-0") == words.count("title") == {40: 5, 80: 2, 100: 2, 300: 1}[width]


def test_the_last_column_breaks_between_words(capsys):
    reason = "a fingertip is in the way of the table on every face that the object rests on"
    shown = printed(40, ("grasp", "reason"), [("c-0-1-2-7", reason)], capsys)
    assert shown.count("title") == 1
    assert [word for word in shown.split() if word in reason.split()] == reason.split()


def test_a_word_that_is_wider_than_the_console_is_kept(capsys):
    shown = printed(40, ("grasp", "hash"), [("c-0-1-2-7", 60 * "x")], capsys)
    assert shown.count("x") == 60


class Lines:
    """A console that keeps its lines, and tells when there is another one."""

    is_terminal = False

    def __init__(self):
        self.lines, self.more = [], Event()

    def print(self, text, **_):
        self.lines.append(str(text))
        self.more.set()


def test_long_work_says_how_far_it_is_and_what_is_ahead_also_while_no_step_ends(monkeypatch):
    monkeypatch.setattr(console, "PLAIN_EVERY_S", 0.001)
    shown = Lines()

    def waited():
        shown.more.clear()
        assert shown.more.wait(10.0)
        return shown.lines[-1]

    with Reporter(err=shown).progress("planning") as steps:
        assert waited().startswith("planning after ")
        steps.update(400, 1000, "(3 grasps)")
        waited()
        line = next(line for line in shown.lines if "/s" in line)
        assert line.startswith("planning 400/1000 (3 grasps) ")
        assert " after 0 s, some " in line
        assert line.endswith(" left")
        steps.update(7, None, "of at most 1000")
        waited()
        assert waited().startswith("planning 7 of at most 1000 after ")
        steps.update(1, 7, "grasps", title="ranking by payload")
        waited()
        assert waited().startswith("ranking by payload 1/7 grasps ")


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(3.2, "3 s"), (119.0, "119 s"), (150.0, "2.5 min"), (9000.0, "2.5 h"), (2e6, "23.1 days")],
)
def test_times_are_said_in_the_unit_that_fits(seconds, said):
    assert duration(seconds) == said

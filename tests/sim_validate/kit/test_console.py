"""Tables of the console keep their numbers whole, whatever fits."""

from rich.console import Console

from sim_validate.kit.console import Reporter

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

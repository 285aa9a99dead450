"""Writes the page of a dataset's distributions, and the same numbers as JSON."""

import json
from pathlib import Path

from grasp_core.files.text_files import write_text
from scenes.drawing.pages import number
from scenes.drawing.sheets import svg_of
from sim_validate.datasets.describing.stats import Spread, Stats
from sim_validate.reports.charts.distribution_charts import histogram, shares
from sim_validate.reports.pages import page, style

PAGE, DATA = "index.html", "stats.json"
FEWEST = 2
"""Least number of different values of a column that has a chart."""
DIGITS = 4


def write_stats(folder: Path, title: str, stats: Stats) -> Path:
    """Write what a dataset holds as a page and as JSON.

    Gives the path of the page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / DATA, json.dumps(stats.to_json(), indent=1) + "\n")
    charts = [svg_of(shares("survival by kind", stats.survival))] if stats.survival else []
    charts += [
        svg_of(shares(name, {word: {"rows": count} for word, count in counts.items()}))
        for name, counts in stats.counts.items()
        if len(counts) >= FEWEST
    ]
    text = page(
        "dataset.html",
        style=style(),
        title=title,
        rows=list(stats.rows.items()),
        shares=charts,
        spreads=[
            {
                "name": f"{each.table}.{each.column.name}",
                "unit": each.column.unit,
                "meaning": each.column.meaning,
                "known": len(each.values),
                "missing": each.missing,
                "quarters": [number(value, DIGITS) for value in each.quarters],
            }
            for each in stats.spreads
        ],
        charts=[_chart(each) for each in stats.spreads if _is_drawn(each)],
    )
    return write_text(folder / PAGE, text)


def _is_drawn(spread: Spread) -> bool:
    return len(spread.values) > 0 and spread.values[0] < spread.values[-1]


def _chart(spread: Spread) -> str:
    name = f"{spread.table}.{spread.column.name}"
    return svg_of(histogram(name, spread.column.unit, spread.values))

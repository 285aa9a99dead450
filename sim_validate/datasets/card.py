"""Writes the README.md of a dataset, which describes it to people and to the Hugging Face Hub.

The Hub is a website for datasets and calls this page a card. A user's own words are escaped: in the
header as quoted strings, in the text as Markdown.
"""

import re
from collections.abc import Iterable, Mapping

from sim_validate.datasets.config import DatasetConfig, config_to_toml, quoted
from sim_validate.datasets.manifest import Manifest
from sim_validate.datasets.tables import KEYS, REFERENCES, SPLITS, Column, Name

KEYWORDS = (
    "robotics", "grasping", "force-closure", "multi-finger grasps", "contact mechanics",
    "simulation", "mujoco", "synthetic", "negative examples",
)  # fmt: skip
ROWS: Mapping[Name, str] = {
    "objects": "an object; its mesh, in metres, is `meshes/OBJECT_ID.obj`",
    "grasps": "four contacts on an object at one friction, or a negative control made from them",
    "trials": "a grasp or control under one wrench, in simulation",
    "executions": "a grasp in one trial of its execution, in simulation",
}
"""Meaning of one row of each table."""
LABELS: Mapping[str, str] = {
    "grasp": "a planned grasp, proved to be in force closure",
    "given": "contacts from another source, moved onto the object and judged",
    "varied": "a grasp at another friction or mass, or with contacts moved; it may hold or not",
    "low_friction": "the contacts of a grasp, tried at a friction below its critical friction",
    "fingers_removed": "only three or two of a grasp's contacts",
    "normal_flipped": "a grasp with one finger that pulls where it should push",
    "contacts_moved": "contacts moved on their faces out of force closure",
    "uncorrected": "contacts that the paper's construction as printed wrongly gives on these faces",
}
"""Meanings of the values of the column `label`."""
PLANNED = (
    "Grasps are planned for each object at each friction, for each family of grasps by itself. "
    "Every grasp has a certificate of force closure."
)
JUDGED = (
    "The contacts come from another source, in `contacts.json`. They are moved to the nearest "
    "faces of their object; `moved_m` says how far. Each set is proved to be in force closure or "
    "proved not to be. Sets with a contact near no face are `not_tried`; their `note` says why."
)
TRIED = (
    "Then each grasp is simulated in MuJoCo: four spherical fingertips squeeze the object, which "
    "is loaded with the wrenches in `trials`. Negative controls and all contact sets proved not "
    "to be in force closure are loaded with a wrench that they cannot resist."
)
EXECUTED = (
    "Grasps are also executed, again in MuJoCo: fingertips on springs hold the object, which has "
    "its mass {mass}, with one squeeze that is chosen beforehand and never replanned, through the "
    "trials {trials}. A grasp whose `survived` is false is a natural negative: it is proved to be "
    "in force closure, but loses the object when it is executed, or no squeeze within the "
    "fingers' strength carries the weight (then `executed` is false, too). `load_multiple` and "
    "`predicted_first_slip` are what the analysis said before."
)
CONVENTIONS = (
    "Units are SI, and names of columns end in them. Positions, normals and wrenches are in the "
    "object's own frame, the frame of its mesh. Normals have length one and point into the "
    "object. A wrench is force, then torque about the centre of mass, applied to the object. "
    "Friction is the Coulomb coefficient. Numbers are float64. A value that could not be measured "
    "is null, and so are the last contacts of a set of fewer than four."
)
RIGID = "Objects and fingertips are rigid, loads quasi-static; nothing was tried on a real robot."
MASSES = (
    "Masses in simulation are not the objects', but chosen so that similar grasps behave alike."
)
LIMITS = (
    RIGID,
    "Friction is Coulomb's, the same at all contacts; fingertips are hard spheres without "
    "torsional friction.",
    "There is no hand: it was not checked whether fingers can reach the contacts.",
    MASSES,
    "Grasps on curved objects are searched on nearly flat patches only, not between them.",
)
WITH_EXECUTIONS = {
    RIGID: "Objects and fingertips are rigid, and loads in `trials` are quasi-static; nothing was "
    "tried on a real robot.",
    MASSES: "Masses in `trials` are not the objects', but chosen so that similar grasps behave "
    "alike; those in `executions` are in `mass_kg`.",
}
"""Statements on limits that read otherwise where grasps are executed."""
SOURCES = (
    "Objects are made from meshes whose own licences hold for `meshes/` and all that is derived "
    "from them; they are not recorded here, so whoever publishes the dataset has to state them."
)
CARD = "README.md"
FIRST: Name = "grasps"
"""Name of the table that is loaded if the reader names none."""
SIZES = (
    (10**3, "n<1K"), (10**4, "1K<n<10K"), (10**5, "10K<n<100K"), (10**6, "100K<n<1M"),
    (10**7, "1M<n<10M"), (10**8, "10M<n<100M"), (10**9, "100M<n<1B"), (10**10, "1B<n<10B"),
)  # fmt: skip
"""Bounds on the number of rows, and the name that the Hugging Face Hub has for datasets below each.
"""
LARGEST = "10B<n<100B"
MARKS = frozenset("\\`*_[]<>|~&#!$@")
"""Characters that can begin Markdown or HTML within a line."""
NAMED_ALIKE = (
    "CC0-1.0", "CC-BY-3.0", "CC-BY-4.0", "CC-BY-SA-3.0", "CC-BY-SA-4.0", "CC-BY-NC-3.0",
    "CC-BY-NC-4.0", "CC-BY-ND-4.0", "CC-BY-NC-ND-3.0", "CC-BY-NC-ND-4.0", "CC-BY-NC-SA-3.0",
    "CC-BY-NC-SA-4.0", "CDLA-Permissive-1.0", "CDLA-Permissive-2.0", "CDLA-Sharing-1.0",
    "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "MIT", "Unlicense",
)  # fmt: skip
"""SPDX names of licences whose names on the Hugging Face Hub are the same in small letters."""
LICENSES = {
    **{name: name.lower() for name in NAMED_ALIKE},
    "ODbL-1.0": "odbl",
    "ODC-By-1.0": "odc-by",
    "PDDL-1.0": "pddl",
}
"""Usual licences of data: their names on the Hugging Face Hub, by their names in SPDX."""
ADDRESS = re.compile(r"https?://[^\s<>\"'`\\|{}^]+")
"""Pattern of a web address that can stand in Markdown as a link unchanged."""


def summary(config: DatasetConfig, manifest: Manifest) -> str:
    """Say in a few sentences what the dataset holds, without a user's words."""
    rows = manifest.rows()
    executed = (
        f" Grasps were executed in {rows['executions']} further trials." if config.execution else ""
    )
    frictions = ", ".join(f"{friction:g}" for friction in config.frictions)
    return (
        f"Four-finger grasps of {rows['objects']} objects at friction {frictions}: "
        f"{rows['grasps']} contact sets, which are grasps proved to be in force closure and "
        f"negative controls proved not to be, and {rows['trials']} trials of them in simulation."
        f"{executed}"
    )


def made(config: DatasetConfig) -> str:
    """Say how the grasps of the dataset were made."""
    made = f"{JUDGED if config.contacts else PLANNED} {TRIED}"
    asked = config.execution
    if asked is None:
        return made
    density, mass_kg = asked.density_kg_m3, asked.settings.mass_kg
    mass = f"of {mass_kg:g} kg" if density is None else f"at {density:g} kg/m3"
    return f"{made} {EXECUTED.format(mass=mass, trials=', '.join(asked.settings.trials))}"


def choice(config: DatasetConfig, manifest: Manifest) -> str:
    """Say which objects and grasps were chosen, so that readers know how the sample is biased."""
    left_out = (
        f"Of {manifest.units} units of work, {manifest.quarantined} were left out, for the reasons "
        "in `quarantine.jsonl`."
    )
    if config.contacts:
        return f"The dataset has all contact sets that were given. {left_out}"
    return (
        "For each object, friction and family the grasps with the largest regions are kept, "
        f"{config.limit} at most, so they are not a random sample of all grasps. The objects were "
        "chosen by the maker of the dataset. "
        f"{left_out}"
    )


def limits(config: DatasetConfig) -> tuple[str, ...]:
    """Say what the dataset does not show."""
    other = {} if config.execution is None else WITH_EXECUTIONS
    return tuple(other.get(line, line) for line in LIMITS)


def splitting() -> str:
    """Say how objects are assigned to splits."""
    shares, before = list[str](), 0.0
    for name, upto in SPLITS:
        shares.append(f"{name} {upto - before:.0%}")
        before = upto
    listed = ", ".join(reversed(shares))
    return (
        "Objects are split by the hash of their mesh and the seed, and all grasps, controls and "
        f"trials of an object are where the object is. Chances are {listed}."
    )


def makers(manifest: Manifest) -> tuple[str, ...]:
    """List the programs that made the dataset, with versions."""
    named = (("graspproof", "graspproof"), ("MuJoCo", "mujoco"), ("Python", "python"))
    return tuple(f"{name} {manifest.versions.get(key, 'unknown')}" for name, key in named)


def card_text(config: DatasetConfig, manifest: Manifest) -> str:
    """Write the README.md of a dataset."""
    sections = (
        _header(config, manifest),
        f"# {_as_markdown(config.title) or 'Grasps'}\n\n{summary(config, manifest)}\n"
        + _credits(config),
        f"## How it was made\n\n{made(config)}\n\n{choice(config, manifest)}\n\n"
        f"Made with {', '.join(makers(manifest))}; `manifest.json` has all versions and the hash "
        f"of the code. The settings, as in `config.toml`:\n\n"
        f"```toml\n{config_to_toml(config)}```\n",
        f"## Tables\n\n{_counts(manifest)}",
        *(_table(name, columns) for name, columns in config.tables.items()),
        f"## Splits\n\n{splitting()}\n",
        f"## Negative controls and labels\n\n{_labels()}",
        f"## Units and frames\n\n{CONVENTIONS}\n",
        f"## Limits\n\n{_list(limits(config))}",
        f"## Licences of the meshes\n\n{SOURCES}\n",
        _loading(manifest),
    )
    return "\n".join(sections)


def _header(config: DatasetConfig, manifest: Manifest) -> str:
    """Write the header of the README.md in YAML, which the Hugging Face Hub reads."""
    lines = [f"pretty_name: {quoted(config.title)}", *_license_lines(config.license)]
    lines += ["task_categories:", f"- {quoted('robotics')}", "tags:"]
    lines += [f"- {quoted(word)}" for word in KEYWORDS]
    lines += ["size_categories:", f"- {quoted(_size(sum(manifest.rows().values())))}"]
    configs = [line for name in config.tables for line in _config_lines(name, manifest)]
    lines += ["configs:", *configs] if configs else []
    return "\n".join(["---", *lines, "---", ""])


def _license_lines(name: str) -> list[str]:
    if not name:
        return []
    if (known := _known_license(name)) is not None:
        return [f"license: {quoted(LICENSES[known])}"]
    return [f"license: {quoted('other')}", f"license_name: {quoted(name)}"]


def _known_license(name: str) -> str | None:
    """Look up the SPDX name of a licence, given in any letters; None if it is unusual."""
    wanted = name.lower()
    return next((spdx for spdx, hub in LICENSES.items() if wanted in (spdx.lower(), hub)), None)


def _config_lines(name: Name, manifest: Manifest) -> list[str]:
    """Write the header's lines on the files of a table, by split; none if it has no files."""
    splits = _splits(name, manifest)
    if not splits:
        return []
    lines = [f"- config_name: {quoted(name)}"]
    lines += ["  default: true"] if name == FIRST else []
    lines.append("  data_files:")
    for split in splits:
        pattern = quoted(f"data/{name}/{split}-*.parquet")
        lines += [f"  - split: {quoted(split)}", f"    path: {pattern}"]
    return lines


def _splits(name: Name, manifest: Manifest) -> list[str]:
    """List the splits in which a table has rows, the one to train with first."""
    there = {each.split for each in manifest.of_table(name)}
    return [split for split, _ in reversed(SPLITS) if split in there]


def _size(rows: int) -> str:
    return next((size for upto, size in SIZES if rows < upto), LARGEST)


def _credits(config: DatasetConfig) -> str:
    """Write the user's statements about the dataset, such as its creator, as a list."""
    name = _known_license(config.license) or config.license
    said = {
        "Creator": _as_markdown(config.creator),
        "Address": f"<{config.url}>" if _is_address(config.url) else _as_markdown(config.url),
        "Published": _as_markdown(config.published),
        "Licence": f"<{name}>" if _is_address(name) else _as_markdown(name),
    }
    lines = [f"{label}: {text}" for label, text in said.items() if text]
    return f"\n{_list(lines)}" if lines else ""


def _counts(manifest: Manifest) -> str:
    lines = ["| table | a row is | split | rows |", "|---|---|---|---|"]
    for name in manifest.tables:
        for split in _splits(name, manifest):
            files = [each for each in manifest.of_table(name) if each.split == split]
            rows = sum(each.rows or 0 for each in files)
            lines.append(f"| `{name}` | {ROWS[name]} | {split} | {rows} |")
    return _lines(lines)


def _table(name: Name, columns: Iterable[Column]) -> str:
    """Write a Markdown table of all columns of a table."""
    lines = [
        f"### {name}", "",
        f"Sorted by, and unique in, {' and '.join(f'`{key}`' for key in KEYS[name])}.", "",
        "| column | type | unit | meaning |", "|---|---|---|---|",
    ]  # fmt: skip
    lines += [
        f"| `{each.name}` | {_type(each)} | {each.unit} | {_meaning(name, each)} |"
        for each in columns
    ]
    return _lines(lines)


def _type(column: Column) -> str:
    return f"{column.kind} {list(column.shape)}" if column.shape else column.kind


def _meaning(name: Name, column: Column) -> str:
    if (target := REFERENCES.get((name, column.name))) is None:
        return column.meaning
    return f"{column.meaning}; names a row of `{target[0]}` by its `{target[1]}`"


def _labels() -> str:
    rest = (
        "Negative controls are rows like the grasps; `control_of` names their grasp, `friction` is "
        "what they were tried at, and `force_closed` is false. `held` is the result of the "
        "simulation, `force_closed` is proved; `mismatches` counts their contradictions."
    )
    lines = ["| `label` | what it is |", "|---|---|"]
    lines += [f"| `{label}` | {meaning} |" for label, meaning in LABELS.items()]
    return _lines([*lines, "", rest])


def _loading(manifest: Manifest) -> str:
    """Write code that loads the dataset from a folder called `ds`; the tests run it."""
    split = next(iter(_splits(FIRST, manifest)), "train")
    return f"""\
## Loading

From the folder that holds this one as `ds`, with polars,

```python
import polars
grasps = polars.read_parquet("ds/data/grasps/*.parquet")
```

pandas, where two lines make an array of a column of lists,

```python
import numpy, pandas
grasps = pandas.read_parquet("ds/data/grasps")
def stacked(cells, missing):
    return numpy.array([missing if cell is None else numpy.stack(cell) for cell in cells])
points = stacked(grasps["contact_points_m"], numpy.full((4, 3), numpy.nan))
```

Hugging Face datasets, also offline,

```python
import datasets
grasps = datasets.load_dataset("ds", "grasps", split="{split}")
```

or graspproof, as NumPy arrays:

```python
import sim_validate
grasps = sim_validate.load_dataset("ds", "{split}")["grasps"]
```

`graspproof dataset verify ds` compares every file with `manifest.json`, proves force closure again
for every row from its contacts, and plans and simulates a sample of the grasps again.
"""


def _list(lines: Iterable[str]) -> str:
    return _lines(f"- {line}" for line in lines)


def _lines(lines: Iterable[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _is_address(text: str) -> bool:
    return text.isprintable() and ADDRESS.fullmatch(text) is not None


def _as_markdown(text: str) -> str:
    """Write a user's text on one line, with all Markdown and HTML escaped."""
    line = "".join(letter if letter.isprintable() else " " for letter in text).strip()
    return "".join(f"\\{letter}" if letter in MARKS else letter for letter in line)

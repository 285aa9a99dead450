"""A TOML file that says which grasps must stay as they were: grasps, baseline, settings."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from grasp_core.errors import InputError
from grasp_core.records import SavedGrasps, grasps_from_json
from sim_validate.baselines.baseline_file import baseline_from_json, baseline_to_json
from sim_validate.baselines.comparing import Finding, compare
from sim_validate.baselines.measuring import Measured, measured, of_settings, seen_from, setup_for
from sim_validate.baselines.values import Baseline
from sim_validate.files import read_text, write_text
from sim_validate.grasp_verdict import Verdict
from sim_validate.noise import Noise
from sim_validate.setup import Agenda

ENDING = ".grasps.toml"
KINDS: Mapping[str, type] = {
    "grasps": str, "baseline": str, "setup": str, "limits": str, "strict": bool,
    "random_wrenches": int, "trials": int, "noise": dict, "seed": int,
}  # fmt: skip
"""Settings of the file, and what they are."""


@dataclass(frozen=True, slots=True)
class Suite:
    """Grasps that must stay as they were."""

    grasps: Path
    """A grasps.json."""
    baseline: Path
    strict: bool = False
    """Whether what is better fails, too."""
    setup: Path | None = None
    """TOML file of simulation settings, for a new baseline."""
    limits: str = "none"
    """How limits are found in simulation, in a new baseline."""
    random_wrenches: int = 0
    trials: int = 0
    """Repeats with noise, in a new baseline."""
    noise: Noise = field(default_factory=Noise)
    seed: int | None = None

    def ids(self) -> list[str]:
        """Of all grasps, in the file or in the baseline.

        Raises:
            InputError: A file is missing or refused.
        """
        kept = (
            {entry.id for entry in self.kept().entries} if self.baseline.is_file() else set[str]()
        )
        return sorted(kept | {grasp.id for grasp in self._saved().grasps})

    def kept(self) -> Baseline:
        """The baseline.

        Raises:
            InputError: It is missing or refused.
        """
        if not self.baseline.is_file():
            raise InputError(f"{self.baseline}: there is no baseline yet: pytest --grasp-bless")
        return baseline_from_json(read_text(self.baseline), str(self.baseline))

    def tested(self, name: str) -> tuple[Finding, Verdict | None]:
        """What became of a grasp, and the verdict on it now, if it is still there.

        Raises:
            InputError: A file or the grasp is refused.
            UnfaithfulError: The simulator fails the gate.
        """
        before, saved = self.kept(), self._saved()
        setup, agenda = of_settings(before.settings, str(self.baseline))
        one = tuple(grasp for grasp in saved.grasps if grasp.id == name)
        entries = tuple(entry for entry in before.entries if entry.id == name)
        if one:
            chosen = SavedGrasps(saved.body, saved.friction, saved.seed, one, saved.finger)
            done = measured(chosen, before.grasps_file, setup, agenda, 1, _silent)
        else:
            done = Measured(replace(before, entries=()), {})
        (found,) = compare(replace(before, entries=entries), done.baseline)
        return found, done.verdicts.get(name)

    def bless(self) -> Baseline:
        """Simulate all grasps and write the baseline.

        Raises:
            InputError: A file or a grasp is refused.
            UnfaithfulError: The simulator fails the gate.
        """
        saved = self._saved()
        agenda = Agenda(
            random_wrenches=self.random_wrenches,
            limits=self.limits,  # pyright: ignore[reportArgumentType] - checked there
            trials=self.trials,
            noise=self.noise,
            seed=saved.seed if self.seed is None else self.seed,
        )
        setup = setup_for(saved, self.setup)
        where = seen_from(self.baseline, self.grasps)
        found = measured(saved, where, setup, agenda, 1, _silent).baseline
        write_text(self.baseline, baseline_to_json(found))
        return found

    def _saved(self) -> SavedGrasps:
        return grasps_from_json(read_text(self.grasps))


def suite_from_toml(path: Path) -> Suite:
    """Read which grasps must stay as they were; paths in the file start at its folder.

    Raises:
        InputError: It is not such a file; the message names the setting.
    """
    try:
        given = tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: not TOML: {error}") from error
    _check(given, path)
    usual = path.name.removesuffix(ENDING) + ".baseline.json"
    settings: dict[str, Any] = {"baseline": usual, **given}
    for name in ("grasps", "baseline", "setup"):
        if name in settings:
            settings[name] = path.parent / settings[name]
    if "noise" in settings:
        settings["noise"] = _noise(settings["noise"], path)
    return Suite(**settings)


def _check(given: Mapping[str, Any], path: Path) -> None:
    for name, value in given.items():
        kind = KINDS.get(name)
        if kind is None:
            raise InputError(f"{path}: {name}: no such setting; there are {', '.join(KINDS)}")
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise InputError(f"{path}: {name}: expected {kind.__name__}, got {value!r}")
    if "grasps" not in given:
        raise InputError(f"{path}: grasps: expected the path of a grasps.json")


def _noise(given: Mapping[str, Any], path: Path) -> Noise:
    known = [each.name for each in fields(Noise)]
    for name, value in given.items():
        if name not in known:
            raise InputError(f"{path}: noise: has {', '.join(known)}; got {name!r}")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"{path}: noise.{name}: expected a number, got {value!r}")
    return Noise(**given)


def _silent(_: int, __: int) -> None:
    """Nobody is told."""

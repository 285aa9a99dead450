"""Computes one unit of work: grasps are planned or given, simulated, and turned into rows."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from grasp_core.errors import InputError, UndecidedError
from grasp_core.objects.polyhedron import Polyhedron
from grasp_core.planning.given_contacts import grasp_of, seat
from grasp_core.planning.planner import plan
from grasp_core.values import Grasp
from sim_validate.closure.controls import Control, try_control
from sim_validate.closure.verdict import Verdict
from sim_validate.datasets.figures import Executed, executed_by
from sim_validate.datasets.given_contacts import GivenGrasp
from sim_validate.datasets.make_rows import MakingRows
from sim_validate.datasets.meshes import mesh_path, mesh_text
from sim_validate.datasets.rows import GIVEN, Rows
from sim_validate.datasets.units import WorkUnit
from sim_validate.datasets.varied import Varying, validated_with
from sim_validate.engine.setup import Agenda, Setup
from sim_validate.execution.jobs import ExecutionJob, executed_grasp


@dataclass(frozen=True, slots=True)
class Made:
    """The rows and files of one unit of work."""

    rows: Rows
    files: Mapping[str, str]
    """Texts of the files, by their paths in the dataset's folder."""


def made_of(unit: WorkUnit, body: Polyhedron) -> Made:
    """Plan the grasps of a unit or judge the given ones, simulate them, and make their rows."""
    making = _Making(unit, body)
    if unit.given:
        making.judge()
    else:
        making.plan()
    return Made(making.found.made, making.files)


class _Making:
    """The rows and files of a unit of work while they are made."""

    def __init__(self, unit: WorkUnit, body: Polyhedron) -> None:
        self.unit, self.body = unit, body
        self.found = MakingRows(body, unit)
        path = mesh_path(Path(), body.content_sha256)
        self.files = {path.as_posix(): mesh_text(body)}
        config = unit.config
        self.agenda = Agenda(
            random_wrenches=config.random_wrenches, limits=config.limits, seed=config.seed
        )

    def plan(self) -> None:
        """Plan the best grasps of each family separately, and simulate them."""
        config = self.unit.config
        for family in config.families:
            planned = plan(
                self.body, self.unit.friction, families=(family,), cones=config.cones,
                limit=config.limit, seed=config.seed,
            )  # fmt: skip
            for grasp in planned.grasps:
                tried, executed = self._tried(grasp, self.body), self._executed(grasp, self.body)
                self.found.add(grasp, tried, executed)
                self._vary(grasp, self.body, tried, executed)

    def judge(self) -> None:
        """Judge the given grasps; a grasp that cannot be simulated gets a row with the reason."""
        for given in self.unit.given:
            try:
                self._judge(given)
            except (InputError, UndecidedError) as error:
                self.found.add_untried(given, str(error))

    def _judge(self, given: GivenGrasp) -> None:
        friction = self.unit.friction
        seated = seat(self.body, given.points, given.normals)
        grasp = grasp_of(seated, friction, given.id)
        if isinstance(grasp, Grasp):
            tried, executed = self._tried(grasp, seated.body), self._executed(grasp, seated.body)
            self.found.add_given(given, grasp, tried, seated, executed)
            self._vary(grasp, seated.body, tried, executed)
            return
        control = Control(GIVEN, friction, grasp)
        verdict = try_control(seated.body, control, self.agenda, Setup())
        self.found.add_open(given, verdict, seated.moved_m)

    def _tried(self, grasp: Grasp, body: Polyhedron) -> Verdict:
        asked = self.unit.config.learning
        verdict = validated_with(body, grasp, self.unit.friction, self.agenda, asked)
        if self.unit.config.scenes and verdict.scene is not None:
            self.files[f"scenes/{self.found.name(grasp.id)}.xml"] = verdict.scene.xml
        return verdict

    def _vary(self, grasp: Grasp, body: Polyhedron, verdict: Verdict, executed: Executed) -> None:
        config = self.unit.config
        if config.learning is None:
            return
        varying = Varying(config.learning, self.unit.friction, self.agenda, config.execution)
        for each in varying.of(body, grasp, verdict, executed):
            self.found.add_varied(grasp.id, each)

    def _executed(self, grasp: Grasp, body: Polyhedron) -> Executed:
        asked = self.unit.config.execution
        if asked is None:
            return None
        try:
            settings, learning = asked.for_body(body), self.unit.config.learning
            job = ExecutionJob(body, grasp, self.unit.friction, settings, enough=False)
            return executed_by(
                lambda each: executed_grasp(replace(job, settings=each)), settings,
                () if learning is None else learning.seeds,
            )  # fmt: skip
        except InputError as error:
            return str(error)

"""The flags of the command that judges recorded grasps; nothing here is slow to load."""

from dataclasses import field
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg

from grasp_core.allowed_values import Count
from grasp_core.declared import declared
from grasp_core.names import HANDS
from sim_validate.commands.flags import BARE, Spoken
from sim_validate.datasets.flags import Working
from sim_validate.protocols.settings import ChosenJudging
from sim_validate.settings import ProtocolName


@declared
class JudgeFlags(Spoken):
    """Flags of the command `judge`."""

    records: Positional[tuple[Path, ...]]
    """Files with recorded grasps, or folders of such files (see docs/judge.md)."""
    objects: Path
    """Folder with the objects that records name; or one mesh file, or the name of a built-in
    object, that all records are about."""
    out: Path
    """Folder for judgements.json and judgements.parquet. An interrupted command that is run again
    goes on from what it finds there."""
    hand: Annotated[str | None, arg(help=(
        f"The hand of the records: {', '.join(HANDS)}, or an MJCF or URDF file; contacts alone "
        "need none."
    ))] = None  # fmt: skip
    format: str | None = None
    """Format of the files; if not given, each is recognised by what it holds."""
    object: str | None = None
    """Judge only records of objects with such a name, as records have it, where `*` stands for any
    letters."""
    only: str | None = None
    """Judge only records with such an id, such as `mug.npy#3`, where `*` stands for any letters."""
    limit: Count | None = None
    """Judge only this many records, from the first."""
    test: UseAppendAction[tuple[ProtocolName, ...]] = ()
    """A published test to run; may be repeated. If not given, that of DexGraspBench is run."""
    judging: Annotated[ChosenJudging, BARE] = field(default_factory=ChosenJudging)
    work: Annotated[Working, BARE] = field(default_factory=Working)

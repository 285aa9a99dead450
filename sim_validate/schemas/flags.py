"""The flags of the command `schema`."""

from tyro.conf import Positional

from grasp_core.declared import declared
from sim_validate.commands.flags import Spoken


@declared
class Schema(Spoken):
    """Flags of the command `schema`."""

    kind: Positional[str | None] = None
    """A kind of files, such as `verdicts`, `verdicts.json` or `setup`; if not given, all kinds are
    listed."""

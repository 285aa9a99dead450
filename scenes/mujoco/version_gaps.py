"""Lists what versions of MuJoCo lack or compute wrongly.

Scenes run on MuJoCo 3.17, the first version with `mujoco.batch`, to 4.x. Whether the installed one
is faithful is measured on cases with known answers (`sim_validate.engine.known_cases`), not looked
up.
"""

import re
from collections.abc import Mapping

from grasp_core.provenance import versions

FLAGS_SINCE: Mapping[str, tuple[int, int]] = {"speculative": (4, 0)}
"""Flags that are off in all scenes, and the first version that has each: earlier ones refuse its
name, and simulate as if it were off."""
WRONG_FACTOR = "4.0.0"
"""Version of MuJoCo whose Newton solver factors sparse Hessians wrongly, so that accelerations are
wrong; 4.0.1 has it right."""


def known_flags(flags: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
    """Leave out the flags that the installed version lacks; also say so, in a sentence for each."""
    here = versions()["mujoco"]
    number = re.match(r"(\d+)\.(\d+)", here)
    lacking = {
        name: since
        for name, since in FLAGS_SINCE.items()
        if number and tuple(map(int, number.groups())) < since
    }
    return {name: state for name, state in flags.items() if name not in lacking}, [
        f"Written for MuJoCo {here}, which lacks the flag `{name}`. Versions from {major}.{minor} "
        "on have it off where a scene does not name it, as here."
        for name, (major, minor) in lacking.items()
    ]

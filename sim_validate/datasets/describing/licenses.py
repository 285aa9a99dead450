"""Usual licences of data, with their names in SPDX and on the Hugging Face Hub."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class License:
    """A licence that both SPDX and the Hub know."""

    spdx: str
    hub: str

    @property
    def url(self) -> str:
        """Address of the licence's text."""
        return f"https://spdx.org/licenses/{self.spdx}"


NAMED_ALIKE = (
    "CC0-1.0", "CC-BY-3.0", "CC-BY-4.0", "CC-BY-SA-3.0", "CC-BY-SA-4.0", "CC-BY-NC-3.0",
    "CC-BY-NC-4.0", "CC-BY-ND-4.0", "CC-BY-NC-ND-3.0", "CC-BY-NC-ND-4.0", "CC-BY-NC-SA-3.0",
    "CC-BY-NC-SA-4.0", "CDLA-Permissive-1.0", "CDLA-Permissive-2.0", "CDLA-Sharing-1.0",
    "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "MIT", "Unlicense",
)  # fmt: skip
"""SPDX names of licences whose names on the Hub differ only by small letters."""
LICENSES = (
    *(License(spdx, spdx.lower()) for spdx in NAMED_ALIKE),
    License("ODbL-1.0", "odbl"),
    License("ODC-By-1.0", "odc-by"),
    License("PDDL-1.0", "pddl"),
)


def known_license(name: str) -> License | None:
    """The licence of a name, in capital or small letters; None if it is not a usual one."""
    wanted = name.lower()
    return next((each for each in LICENSES if wanted in (each.spdx.lower(), each.hub)), None)

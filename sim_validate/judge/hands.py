"""Finds the hand that records are about: a built-in one, or one of a file."""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from grasp_core.errors import InputError, about
from grasp_core.hands.hand import load_hand
from grasp_core.names import HANDS
from scenes.hand_files.building import HAND_ENDINGS
from scenes.hand_files.model import HandModel, compiled_hand
from scenes.hand_files.model_text import ModelText, model_text, note
from scenes.mujoco.filed_hand import FiledHand
from scenes.mujoco.hand_texts import text_of_hand
from sim_validate.hands.dexgraspbench import hand_file
from sim_validate.protocols.verdict import AboutHand

USUAL_SERVO_N_M_PER_RAD = 5.0
"""Stiffness of a joint's servo where a file has none: that of DexGraspBench."""


@dataclass(frozen=True, slots=True, eq=False)
class JudgedHand:
    """A hand as MuJoCo compiles its file."""

    name: str
    model: HandModel
    servo_n_m_per_rad: float
    """Stiffness of the servos of joints that have none in the file."""
    notes: tuple[str, ...]
    """How the hand differs from its file, a sentence each."""
    sha256: str
    """Hash of the text of its file as it was read, and of the files that this names."""

    @property
    def filed(self) -> FiledHand:
        """Return the hand as its file has it."""
        return FiledHand.of(self.model, (1.0, 0.0, 0.0), self.servo_n_m_per_rad)

    @property
    def about(self) -> AboutHand:
        """Say which hand this is."""
        hand = self.filed
        ranges = np.where(np.isfinite(hand.ranges), hand.ranges, np.nan)
        return AboutHand(self.name, self.sha256, hand.joint_names, ranges, self.notes)


def judged_hand(given: str | Path) -> JudgedHand:
    """Return a built-in hand by its name, or the hand of an MJCF or URDF file.

    Every link of a file counts, so fingertips need no names.

    Raises:
        InputError: There is no such hand, its file is refused, or some of its joints are tied
            together by what is not simulated.
    """
    name = str(given)
    if name in HANDS:
        hand = load_hand(name)
        servos = hand_file(hand)
        text = text_of_hand(hand, servos)
        stiffness = servos.stiffness_n_m_per_rad
        return JudgedHand(name, compiled_hand(text), stiffness, (), _sha256(text))
    path = Path(given)
    if path.suffix.lower() not in HAND_ENDINGS:
        raise InputError(
            f"hand must be {', '.join(HANDS)} or a file that ends with "
            f"{', '.join(HAND_ENDINGS)}, got {name[:200]}"
        )
    with about(path):
        read = model_text(path)
        model = compiled_hand(read, lending=False)
        _refuse_ties(model)
        said = (*read.notes, *model.notes)
        found = JudgedHand(path.stem, model, USUAL_SERVO_N_M_PER_RAD, said, _sha256(read))
        servos = found.filed.servos.names
    aside = [tendon.name for tendon in model.tendons if tendon.name not in servos]
    notes = note("tendons are left out: no motor pulls them, or joints have motors, too", aside)
    return replace(found, notes=(*said, *notes))


def _sha256(text: ModelText) -> str:
    digest = hashlib.sha256(text.xml.encode())
    for name, data in sorted(text.files.items()):
        digest.update(f"\n{name} {len(data)}\n".encode() + data)
    return digest.hexdigest()


def _refuse_ties(model: HandModel) -> None:
    """Refuse what ties joints together and is not simulated."""
    ties = [
        f"{model.body_names[one] or f'body {one}'} and {model.body_names[other] or f'body {other}'}"
        f" are in a loop that a {kind} closes"
        for kind, one, other in model.loops
    ]
    ties += [
        f"joints are coupled by the length of tendon {tendon.name}"
        for tendon in model.tendons if tendon.is_held
    ]  # fmt: skip
    ties += [
        f"a motor pulls tendon {tendon.name}, which is a cable"
        for tendon in model.tendons if tendon.motors and not tendon.joints
    ]  # fmt: skip
    if ties:
        raise InputError(
            f"{ties[0]}, which is not simulated here; write a rule between joints in its place"
        )

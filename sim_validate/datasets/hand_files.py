"""Keeps the hand of a dataset in its folder, so that nothing outside is needed to check or read it.

A hand from a file is kept as the text that was read of it, with the files that this names, beside
the hand that was made of them. The folder that holds them is called by their hash, which decides
the names of units of work: rows about one hand are never taken for those about another.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Self

from grasp_core.errors import InputError
from grasp_core.files.json_text import object_of, text_of
from grasp_core.files.records import from_record, record_of
from grasp_core.files.text_files import read_text
from grasp_core.hands.hand import Hand, load_hand
from grasp_core.names import HANDS
from scenes.hand_files.building import hand_from_file
from scenes.hand_files.model_text import model_text
from sim_validate.datasets.config import DatasetHand
from sim_validate.datasets.layout import HAND_FOLDER, HAND_RECORD
from sim_validate.files.output_folders import whole_folder
from sim_validate.hands.reached_grasps import with_motors

GIVEN_LIMITS = "given in the settings of the dataset"


@dataclass(frozen=True, slots=True, eq=False)
class HandFiles:
    """The hand of a dataset as files, by their names."""

    files: Mapping[str, bytes]

    @classmethod
    def of(cls, asked: DatasetHand, dataset: Path) -> Self:
        """Read the hand that is asked for; where its file is gone, take what the dataset keeps."""
        kept = sorted((dataset / HAND_FOLDER).glob(f"*/{HAND_RECORD}"))
        if asked.hand not in HANDS and kept and not Path(asked.hand).exists():
            return cls.kept(kept[0].parent)
        hand, files = asked_hand(asked, asked.hand), dict[str, bytes]()
        if asked.hand not in HANDS:
            path = Path(asked.hand)
            read = model_text(path)
            # meshes without content could not be read, and cannot be from the copy
            files |= {name: data for name, data in read.files.items() if name not in read.unread}
            files[path.name] = read.xml.encode()
        return cls({**files, HAND_RECORD: text_of(record_of(hand)).encode()})

    @classmethod
    def kept(cls, folder: Path) -> Self:
        """Read the files that a dataset keeps of its hand."""
        return cls({path.name: path.read_bytes() for path in folder.iterdir()})

    @property
    def sha256(self) -> str:
        """Hash of all names and contents."""
        digest = hashlib.sha256()
        for name, data in sorted(self.files.items()):
            digest.update(f"{name}\n{len(data)}\n".encode())
            digest.update(data)
        return digest.hexdigest()

    def folder(self, dataset: Path) -> Path:
        """Return the folder in which a dataset keeps them."""
        return dataset.resolve() / HAND_FOLDER / self.sha256

    def keep(self, dataset: Path) -> None:
        """Write the files into the folder of a dataset, all or none."""
        folder = self.folder(dataset)
        if folder.is_dir():
            return
        with whole_folder(folder) as made:
            for name, data in self.files.items():
                (made / name).write_bytes(data)


def asked_hand(asked: DatasetHand, path: str | Path) -> Hand:
    """Load a built-in hand, or read the one that a file describes, with its torque limits."""
    built_in = asked.hand in HANDS
    hand = load_hand(asked.hand) if built_in else hand_from_file(path, asked.fingertips)
    return with_motors(hand, asked, GIVEN_LIMITS, flags=False)


@cache
def kept_hand(folder: Path) -> Hand:
    """Read the hand that a dataset keeps in a folder, once for all grasps of a process."""
    text = read_text(folder / HAND_RECORD)
    return from_record(Hand, object_of(text, "hand"))


def joint_names(folder: Path | None) -> tuple[str, ...]:
    """Name the joints of the hand that a folder keeps, in their order; none without a hand."""
    return () if folder is None else tuple(joint.name for joint in kept_hand(folder).joints)


def kept_fault(asked: DatasetHand, folder: Path) -> str:
    """Say how the hand that a dataset keeps is not the one that its files describe; empty if it is.

    Numbers are those of the machine that read the file, so this is for one that rounds alike.
    """
    where = f"{HAND_FOLDER}/{folder.name}"
    try:
        again = asked_hand(asked, folder / Path(asked.hand).name)
    except InputError as error:
        return f"{where}: the hand cannot be read again ({error})"
    # notes also tell what the text that is kept no longer has
    one, other = (record_of(each) | {"notes": None} for each in (kept_hand(folder), again))
    return "" if one == other else f"{where}: {HAND_RECORD} is another hand"

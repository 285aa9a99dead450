"""Reading a file of grasps, so that a refusal names the file."""

from pathlib import Path

from grasp_core.errors import InputError
from grasp_core.records import SavedGrasps, grasps_from_json
from sim_validate.files import read_text


def read_grasps(path: Path) -> SavedGrasps:
    """The grasps of a `grasps.json`.

    Raises:
        InputError: The file is missing, or is no such file; the message names it and the field.
    """
    text = read_text(path)
    try:
        return grasps_from_json(text)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error

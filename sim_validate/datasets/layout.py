"""Names the files and folders that a dataset's folder holds."""

from grasp_core.files.file_kinds import MANIFEST, QUARANTINE

CONFIG = "config.toml"
CARD = "README.md"
GIVEN_CONTACTS = "contacts.json"
"""Name of the file with the given contacts, if there are any; its normals point into the object."""
DATA = "data"
"""Folder of the tables, each of which has a folder in it."""
MESH_FOLDER, SCENE_FOLDER = "meshes", "scenes"
FILE_FOLDERS = (MESH_FOLDER, SCENE_FOLDER)
"""Folders of the files that are beside the tables."""
HAND_FOLDER = "hands"
"""Folder of the hand, whose files are in a folder called by their hash."""
HAND_RECORD = "hand.json"
"""Name of the file with the hand as it was read, in the folder of its files."""
STAGING_FOLDER = "staging"
"""Folder of finished units of work, which is there until the dataset is finished."""
OWN_FILES = (
    STAGING_FOLDER, DATA, *FILE_FOLDERS, HAND_FOLDER, GIVEN_CONTACTS, CONFIG, QUARANTINE, CARD,
    MANIFEST,
)  # fmt: skip
"""Names of all files and folders that a build writes."""

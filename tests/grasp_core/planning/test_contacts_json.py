import json

import pytest

import grasp_core as gc
from grasp_core.planning.grasps_json import ContactsFile, contact_sets_from_json
from tests.damaged import check_refused, optional_keys
from tests.judges import TETRA_CENTERS, TETRA_NORMALS

CONTACTS = [
    {"position_m": point.tolist(), "normal": normal.tolist(), "friction": 0.4}
    for point, normal in zip(TETRA_CENTERS, TETRA_NORMALS, strict=True)
]
COMMON = {"friction": 0.5, "center_m": [0.0, 0.0, 0.1], "torque_scale_m": 1.0}


@pytest.mark.parametrize(
    "document",
    [COMMON | {"contacts": CONTACTS}, COMMON | {"grasps": [{"id": "a", "contacts": CONTACTS}]}],
)
def test_every_damaged_field_is_refused_by_its_name(document):
    optional = optional_keys(ContactsFile) - {"contacts", "grasps"}
    check_refused(contact_sets_from_json, document, optional=optional)


def test_too_many_contacts_are_refused_before_they_are_read():
    listed = json.dumps({"contacts": [*CONTACTS, *["no contact"] * 97]})
    with pytest.raises(gc.InputError, match=r"contacts must have a length of .* 100, got 101"):
        contact_sets_from_json(listed)

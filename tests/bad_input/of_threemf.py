"""Group 3: 3MF files, which are archives of XML: both can lie, and both can explode."""

import io
import struct
import zipfile

from tests.bad_input.cases import Case, read, refused
from tests.bad_input.mesh_texts import CORNERS, TRIANGLES

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
BEAMS = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
PLACE = "3D/3dmodel.model"


def item(number: object = 1, transform: str = "1 0 0 0 1 0 0 0 1 0 0 0") -> str:
    return f'<item objectid="{number}" transform="{transform}"/>'


ITEM = '<item objectid="1"/>'


def relations(target: str = f"/{PLACE}") -> str:
    """The part of an archive that says which one is the model."""
    return (
        '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
        f'<Relationship Target="{target}" Id="a" '
        'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
    )


def mesh(corners=CORNERS, faces=TRIANGLES) -> str:
    """A mesh in XML."""
    points = "".join(
        f'<vertex x="{float(x)!r}" y="{float(y)!r}" z="{float(z)!r}"/>' for x, y, z in corners
    )
    rows = "".join(f'<triangle v1="{i}" v2="{j}" v3="{k}"/>' for i, j, k in faces)
    return f"<mesh><vertices>{points}</vertices><triangles>{rows}</triangles></mesh>"


def object_(inside: str, number: object = 1, more: str = "") -> str:
    return f'<object id="{number}" {more}>{inside}</object>'


def components(*numbers: object, more: str = "") -> str:
    parts = "".join(f'<component objectid="{each}" {more}/>' for each in numbers)
    return f"<components>{parts}</components>"


SOLID = object_(mesh())


def model(objects: str = SOLID, items: str = ITEM, more: str = 'unit="meter"') -> str:
    """A model in XML."""
    return (
        f'<?xml version="1.0"?><model xmlns="{CORE}" {more}>'
        f"<resources>{objects}</resources><build>{items}</build></model>"
    )


def archive(*parts: tuple[str, str | bytes], way: int = zipfile.ZIP_DEFLATED) -> bytes:
    """An archive of parts by name."""
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", way) as made:
        for name, data in parts:
            made.writestr(zipfile.ZipInfo(name), data, way)
    return held.getvalue()


def threemf(xml: str | bytes | None = None, *parts: tuple[str, str | bytes]) -> bytes:
    """A 3MF file with a model, and with further parts."""
    xml = model() if xml is None else xml
    return archive(("_rels/.rels", relations()), (PLACE, xml), *parts)


def changed(old: str, new: str) -> bytes:
    """The file of a tetrahedron with a word of its XML exchanged."""
    assert old in model()
    return threemf(model().replace(old, new, 1))


def encrypted() -> bytes:
    """A file whose model says that it is encrypted."""
    data = bytearray(GOOD)
    for beginning, offset in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
        data[data.rfind(beginning) + offset] |= 1
    return bytes(data)


def lying_size() -> bytes:
    """A model of a hundred megabytes that announces a hundred bytes."""
    data = bytearray(threemf(b" " * 100_000_000))
    for beginning, offset in ((b"PK\3\4", 22), (b"PK\1\2", 24)):
        struct.pack_into("<I", data, data.rfind(beginning) + offset, 100)
    return bytes(data)


GOOD = threemf()
LAUGHS = "".join(f'<!ENTITY l{i + 1} "{f"&l{i};" * 10}">' for i in range(9))
LAUGHTER = f'<!DOCTYPE model [<!ENTITY l0 "ha">{LAUGHS}]>'
OUTSIDE = '<!DOCTYPE model [<!ENTITY x SYSTEM "file:///etc/passwd">]>'


def with_type(document_type: str, entity: str) -> bytes:
    """A file whose model has a document type and uses an entity of it."""
    text = model(more=f'unit="meter"><metadata name="a">{entity}</metadata').replace(
        "?><", f"?>{document_type}<", 1
    )
    return threemf(text)


def doubling(deep: int) -> str:
    """Objects, each of which is twice the one before."""
    return SOLID + "".join(object_(components(i, i), i + 1) for i in range(1, deep))


ARCHIVES = {
    "without a byte behind its head": (b"PK\3\4", "3MF|export"),
    "no archive": (b"solid by hand\n", "zip archive|export"),
    "cut in its list": (GOOD[:-30], "3MF|export"),
    "cut in its model": (GOOD[: len(GOOD) // 3], "3MF|export"),
    "a damaged model": (GOOD[:300] + b"\0" * 20 + GOOD[320:], "3MF|export"),
    "encrypted": (encrypted(), "encrypted|export"),
    "packed by lzma": (archive((PLACE, model()), way=zipfile.ZIP_LZMA), "deflate|export"),
    "without a model": (archive(("[Content_Types].xml", "<Types/>")), "model"),
    "an empty archive": (archive(), "zip|export"),
    "a model elsewhere": (archive(("_rels/.rels", relations("/3D/b.model")), (PLACE, model())),
                          "3d/b.model"),
    "a model outside": (archive(("_rels/.rels", relations("/../../../etc/passwd"))), "passwd"),
    "a model behind http": (
        archive(("_rels/.rels", relations("http://localhost/a.model")), (PLACE, model())),
        "localhost"),
    "relations to nothing": (
        archive(("_rels/.rels", "<Relationships/>"), (PLACE, model())), "relation"),
    "relations that are no XML": (archive(("_rels/.rels", "no"), (PLACE, model())), "syntax"),
    "relations of two megabytes": (
        archive(("_rels/.rels", relations() + " " * 2**21), (PLACE, model())), "relations|bytes"),
    "two models of a name": (
        archive(("3D/3dmodel.model", model()), ("3d/3DMODEL.MODEL", model())), "same name"),
    "a zip bomb": (threemf(b" " * 100_000_000), "100000000 bytes|limit|--max-mesh-bytes"),
    "a model that announces less than it is": (lying_size(), "3MF|export"),
    "11,000 parts": (archive(*((f"{i}", "") for i in range(11_000))), "parts"),
    "laughter": (with_type(LAUGHTER, "&l9;"), "document type"),
    "an entity outside": (with_type(OUTSIDE, "&x;"), "document type"),
    "a document type only": (with_type("<!DOCTYPE model>", ""), "document type"),
}  # fmt: skip
XMLS = {
    "that is empty": ("", "no element found"),
    "of words": ("four triangles", "syntax"),
    "that is cut": (model()[:400], "no element found|export"),
    "of bytes": (bytes(range(256)), "3MF|export"),
    "in no alphabet": (b'<?xml version="1.0" encoding="klingon"?><model/>', "encoding"),
    "of another kind": ("<svg xmlns='http://www.w3.org/2000/svg'/>", "svg|model"),
    "of no namespace": (model().replace(CORE, ""), "model"),
    "10^5 deep": (model(items="<a>" * 100_000), "<a>"),
    "10^5 deep in an extension": (
        model(SOLID + "<a xmlns='b'>" + "<a>" * 100_000), "64 deep"),
    "with a tag of 3 MB": (model(more=f'unit="meter" a="{"b" * 3_000_000}"'), "longer"),
    "with an attribute twice": (model(more='unit="inch" unit="inch"'), "duplicate attribute"),
    "in furlongs": (model(more='unit="furlong"'), "unit|millimeter|furlong"),
    "that requires beams": (
        model(more=f'xmlns:b="{BEAMS}" requiredextensions="b"'), "beamlattice|plain"),
    "that requires nobody knows what": (model(more='requiredextensions="zz"'), "zz"),
    "with a beam lattice": (
        model(object_(mesh().replace("</mesh>", f'<b xmlns="{BEAMS}"/></mesh>'))), "extension"),
    "with a mesh in a mesh": (model(object_(f"<mesh>{mesh()}</mesh>")), "mesh"),
    "with vertices in triangles": (
        model(object_(mesh().replace("<triangles>", '<triangles><vertex x="0" y="0" z="0"/>'))),
        "vertex"),
    "with two tables of vertices": (
        model(object_(mesh().replace("<triangles>", "<vertices/><triangles>"))), "two"),
    "with two meshes in an object": (model(object_(mesh() + mesh())), "two meshes"),
    "with components beside a mesh": (
        model(SOLID + object_(mesh() + components(1), 2)), "beside a mesh"),
    "with an object of nothing": (model(object_("")), "neither"),
    "with two objects of a number": (model(SOLID + SOLID), "number 1"),
    "without an object's number": (model(f"<object>{mesh()}</object>"), "missing|id"),
    "that builds nothing": (model(items=""), "no triangles"),
    "that builds what it does not hold": (model(items=item(7)), "object 7"),
    "of a component that it does not hold": (model(object_(components(9))), "object 9"),
    "of an object in itself": (model(object_(components(1))), "itself"),
    "of two objects in each other": (
        model(object_(components(2)) + object_(components(1), 2)), "itself"),
    "of 2^40 tetrahedra": (model(doubling(41), item(41)), "triangles|limit"),
    "of 20,000 items": (model(items=20_000 * ITEM), "10000"),
    "in parts": (
        model(items=f'<item objectid="1" p:path="/3D/a.model" xmlns:p="{PRODUCTION}"/>'),
        "another file"),
    "of a component in another file": (
        model(object_(components(1, more=f'p:path="/../a.model" xmlns:p="{PRODUCTION}"'))),
        "another file"),
    "of a support": (model(object_(mesh(), more='type="support"')), "support|solids"),
    "of slices": (
        model(object_(mesh(), more='s:slicestackid="3" xmlns:s="urn:slice"')), "slices"),
    "of what is not printed": (
        model(items='<item objectid="1" printable="0"/>'), "printed"),
    "with a transform of three": (model(items=item(1, "1 2 3")), "twelve"),
    "with a transform of nan": (model(items=item(1, "nan " * 12)), "finite"),
    "with a transform of words": (model(items=item(1, "one " * 12)), "export"),
    "with a transform of zeros": (model(items=item(1, "0 " * 12)), "across"),
    "with a transform of 1e200": (model(items=item(1, "1e200 " * 12)), "SIZE"),
    "of metres in millimetres": (model(more=""), "SIZE|--scale"),
}  # fmt: skip
WORDS = {
    "nan": ('x="0.1"', 'x="nan"', "finite"),
    "1e999": ('x="0.1"', 'x="1e999"', "finite"),
    "a comma": ('x="0.1"', 'x="0,1"', "export"),
    "two numbers in one": ('x="0.1"', 'x="0.1 0.1"', "export"),
    "no number": ('x="0.1"', 'x=""', "export"),
    "an underscore": ('x="0.1"', 'x="0_0.1"', "export"),
    "no x": ('x="0.1"', "", "missing|x"),
    "a corner beyond": ('v1="0"', 'v1="4"', "INDEX|vertex 4"),
    "a corner before": ('v1="0"', 'v1="-1"', "INDEX|vertex -1"),
    "a corner of 10^30": ('v1="0"', f'v1="1{"0" * 30}"', "export"),
    "half a corner": ('v1="0"', 'v1="0.5"', "export"),
    "no v3": ('v3="1"', "", "missing|v3"),
    "a foreign digit": ('v1="0"', 'v1="&#1633;"', "export"),
    "no entity": ('v1="0"', 'v1="&zero;"', "undefined entity"),
}
"""A word of the XML, what stands in its place, and the message."""
SLICERS = {
    "Slic3r_PE_model.config": '<metadata key="volume_type" value="NegativeVolume"/>',
    "Slic3r_PE_model_old.config": '<metadata key="modifier" value="1"/>',
    "model_settings.config": '<part id="1" subtype="negative_part">',
}
CASES = [refused(f"3mf: {name}", "part.3mf", *said) for name, said in ARCHIVES.items()]
CASES += [
    refused(f"3mf: a model {name}", "part.3mf", threemf(xml), says)
    for name, (xml, says) in XMLS.items()
]
CASES += [
    refused(f"3mf: {name}", "part.3mf", changed(old, new), says)
    for name, (old, new, says) in WORDS.items()
]
CASES += [
    refused(f"3mf: {name}", "part.3mf", threemf(None, (f"Metadata/{name}", text)), "volume|solids")
    for name, text in SLICERS.items()
]
CASES += [
    Case("3mf: in another unit than asked", "inspect part.3mf --unit in",
         "SIZE|part.3mf|(m), got in|--unit|--scale", 4, {"part.3mf": GOOD}),
    refused("3mf: four triangles of three", "part.3mf", GOOD, "--max-triangles",
            "inspect --max-triangles 3"),
    refused("3mf: more bytes unpacked than allowed", "part.3mf", threemf(model() + " " * 9000),
            "unpacked|4000", "inspect --max-mesh-bytes 4000"),
    read("good.3mf", GOOD),
    read("norelations.3mf", archive((PLACE.upper(), model()))),
    read("stored.3mf", archive((PLACE, model()), way=zipfile.ZIP_STORED)),
    read("utf16.3mf", threemf(model().replace("?>", ' encoding="UTF-16"?>').encode("utf-16"))),
    read("unused.3mf", threemf(model(SOLID + object_(mesh(), 2, 'type="other"')))),
    read("slicer.3mf", threemf(None, ("Metadata/Slic3r_PE_model.config",
         '<metadata key="volume_type" value="ModelPart"/>'))),
    read("named.3mf", archive(("_rels/.rels", relations("/3D/Part.model")),
         ("3D/part.model", model(more=f'unit="meter" xmlns:p="{PRODUCTION}" '
                                      'requiredextensions="p" p:UUID="a"')))),
]  # fmt: skip

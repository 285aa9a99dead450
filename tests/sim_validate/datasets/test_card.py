import dataclasses
import re

import pytest

from sim_validate.datasets.card import card_text
from sim_validate.datasets.columns import TABLES
from sim_validate.datasets.layout import CARD
from sim_validate.datasets.manifest import read_manifest
from sim_validate.datasets.verify import verify
from tests.sim_validate.datasets.configs import SMALL

pytest.importorskip("pyarrow")
yaml = pytest.importorskip("yaml")
HOSTILE = (
    "one\ntwo\r\n---\nlicense: mit",
    "a | b || `c` **d** [e](f) # g ![h](i) <!-- j",
    "\u2028\x85\x1b[31m\x00\ufeff",
    "\udc80 no text at all",
    "gr\u00fc\u00dfe \U0001f916 \\U0001F916 {{x}} %s ${y}",
)


@pytest.fixture(scope="module")
def manifest(small_dataset):
    return read_manifest(small_dataset)


def split_card(text):
    """The parsed header and the text after it."""
    opening, header, body = text.split("---\n", 2)
    assert opening == ""
    return yaml.safe_load(header), body


def test_the_card_is_listed_in_the_manifest_and_the_dataset_is_whole(small_dataset, manifest):
    assert CARD in {each.path for each in manifest.files}
    assert verify(small_dataset) == []
    assert (small_dataset / CARD).read_text(encoding="utf-8") == card_text(SMALL, manifest)


def test_the_header_says_where_each_table_and_split_is(small_dataset):
    header, _ = split_card((small_dataset / CARD).read_text())
    assert header["license"] == "cc-by-4.0"
    assert header["pretty_name"] == SMALL.title
    assert header["task_categories"] == ["robotics"]
    assert header["size_categories"] == ["n<1K"]
    assert [each["config_name"] for each in header["configs"]] == list(TABLES)
    assert [each["config_name"] for each in header["configs"] if "default" in each] == ["grasps"]
    seen = set()
    for config in header["configs"]:
        assert [each["split"] for each in config["data_files"]] == ["train", "validation", "test"]
        for each in config["data_files"]:
            found = set(small_dataset.glob(each["path"]))
            assert found
            seen |= found
    assert seen == set(small_dataset.glob("data/*/*.parquet"))


@pytest.mark.parametrize("text", HOSTILE)
def test_words_of_the_user_stay_words(manifest, text):
    config = dataclasses.replace(SMALL, title=text, creator=text, url=text, license=text)
    card = card_text(config, manifest)
    header, body = split_card(card)
    plain, _ = split_card(card_text(SMALL, manifest))
    assert header.pop("pretty_name") == text
    assert header.pop("license_name") == text
    assert header.pop("license") == "other"
    assert header == {key: plain[key] for key in plain if key not in ("pretty_name", "license")}
    settings = re.compile(r"```toml\n.*?```\n", re.DOTALL)
    said, usual = (settings.sub("", each) for each in (body, card_text(SMALL, manifest)))
    assert not re.search(r"(?<!\\)(<script|<!--|\*\*d|\[e\]|!\[)", said)
    assert len(said.splitlines()) == len(split_card(usual)[1].splitlines())
    assert all(line.isprintable() for line in body.splitlines())
    card.encode()


def test_only_addresses_become_links(manifest):
    def said(url):
        return card_text(dataclasses.replace(SMALL, url=url), manifest)

    assert "- Address: <https://example.org/a_b?c=d>\n" in said("https://example.org/a_b?c=d")
    assert "javascript:alert(1)" in said("javascript:alert(1)")
    for url in ("javascript:alert(1)", "https://a.b/<script>", "https://a.b/c d"):
        assert f"<{url}>" not in said(url).split("## How")[0]


def test_a_dataset_without_rows_has_a_card(manifest):
    empty = dataclasses.replace(manifest, units=3, quarantined=3, files=())
    header, body = split_card(card_text(SMALL, empty))
    assert "configs" not in header
    assert "Of 3 units of work, 3 were left out" in body

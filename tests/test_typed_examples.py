"""The check of the pages' Python finds every block, and what is wrong in one."""

from importlib.util import find_spec

import pytest

from tests.typed_examples import PAGES, complaints, examples


def test_every_block_of_python_is_an_example():
    blocks = sum(page.read_text().count(f"\n```{name}\n") for page in PAGES
                 for name in ("python", "py"))  # fmt: skip
    assert len(examples()) == blocks >= 25
    assert all(code.strip() for code in examples().values())


@pytest.mark.slow
@pytest.mark.skipif(find_spec("pyright") is None, reason="pyright comes with the extra `lint`")
def test_a_wrong_example_is_found_at_its_line():
    wrong = "import grasp_core as gc\n\ngc.span_angle(normal=3)\n"
    found = complaints({"right": "import scenes\n\nscenes.example_names()\n", "wrong": wrong})
    assert found
    assert all(said.startswith("wrong:3: ") for said in found)

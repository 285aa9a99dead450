"""Reports work in a browser, on a desk and on a phone, by day and by night."""

import json

import pytest

from sim_validate.commands.exit_codes import Exit
from sim_validate.main import main
from sim_validate.report.report import write_report
from tests.browser import (
    CLIPPED,
    CONTRASTS,
    OWN,
    READABLE,
    headless,
    needs_browser,
    opened,
    requests_of,
)
from tests.scenes.drawing.standing import GRASP, run_with_hand

pytestmark = [pytest.mark.slow, needs_browser]


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    driver = headless(tmp_path_factory.mktemp("profile"))
    yield driver
    driver.quit()


def errors_of(browser):
    """Without warnings, such as that this test reads pixels often."""
    return [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]


def pages_of(report):
    return [report / "index.html", *sorted((report / "grasps").iterdir())]


def test_pages_open_without_errors_and_ask_nothing_of_a_network(browser, small_report):
    for path in pages_of(small_report):
        opened(browser, path)
        browser.execute_script("window.scrollTo(0, document.body.scrollHeight)")
        broken = browser.execute_async_script("""
            const done = arguments[0];
            const images = [...document.images];
            images.forEach((image) => { image.loading = "eager"; });
            Promise.allSettled(images.map((image) => image.decode())).then((ends) => done(
              images.map((image) => image.src).filter((_, i) => ends[i].status !== "fulfilled")));
        """)
        assert broken == []
        assert browser.get_log("browser") == []
        asked = requests_of(browser)
        assert len(asked) >= 4
        assert [url for url in asked if not url.startswith(OWN)] == []


def test_the_policy_of_the_pages_stops_what_would_leave_them(browser, small_report):
    """A negative control: a request is tried, and seen to be stopped."""
    opened(browser, small_report / "index.html")
    browser.execute_script(
        "document.body.append(Object.assign(new Image(), {src: 'http://127.0.0.1:9/a.png'}))"
    )
    said = [entry["message"] for entry in browser.get_log("browser")]
    assert any("Content Security Policy" in line for line in said)


def cards(browser):
    return browser.execute_script(
        "return [...document.querySelectorAll('.card')].filter((card) => !card.hidden && "
        "card.getClientRects().length).map((card) => card.querySelector('.id').textContent)"
    )


def ask(browser, name, value):
    browser.execute_script(
        "const part = document.forms[0].elements[arguments[0]]; part.value = arguments[1];"
        "part.dispatchEvent(new Event('input', {bubbles: true}))", name, value,
    )  # fmt: skip


def test_filters_and_orders_work(browser, small_report, small_run):
    grasps = json.loads((small_run / "grasps.json").read_text())["grasps"]
    ids = [grasp["id"] for grasp in grasps]
    opened(browser, small_report / "index.html")
    assert cards(browser) == ids
    for family in ("concurrent", "pencil"):
        ask(browser, "family", family)
        wanted = [grasp["id"] for grasp in grasps if grasp["family"] == family]
        assert 0 < len(wanted) < len(ids)
        assert cards(browser) == wanted
        said = browser.execute_script("return document.querySelector('output').value")
        assert said == f"{len(wanted)} of {len(ids)} grasps"
    ask(browser, "family", "")
    ask(browser, "find", ids[1].upper())
    assert cards(browser) == [ids[1]]
    ask(browser, "find", "")
    for order, key in (("friction", lambda each: each["critical_friction"]),
                       ("-quality", lambda each: -each["ferrari_canny"][0]),
                       ("-radius", lambda each: -round(1e3 * each["radius_m"], 6))):  # fmt: skip
        ask(browser, "order", order)
        assert cards(browser) == [grasp["id"] for grasp in sorted(grasps, key=key)]


PIXELS = """
const canvas = document.querySelector(".stage > canvas");
const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
let sum = 0, drawn = 0;
for (let at = 0; at < data.length; at += 4) {
  sum = (sum * 31 + data[at] + 7 * data[at + 1] + 13 * data[at + 3]) % 1000003;
  drawn += data[at + 3] > 0;
}
return [sum, drawn / (data.length / 4)];
"""


def test_the_grasp_turns_zooms_and_hides_its_parts(browser, small_report):
    from selenium.webdriver import ActionChains, Keys
    from selenium.webdriver.common.by import By

    opened(browser, pages_of(small_report)[1])
    canvas = browser.find_element(By.TAG_NAME, "canvas")
    pictures = [browser.execute_script(PIXELS)]
    assert pictures[0][1] > 0.1
    ActionChains(browser).drag_and_drop_by_offset(canvas, 60, 30).perform()
    pictures.append(browser.execute_script(PIXELS))
    for keys in (Keys.ARROW_LEFT, Keys.ARROW_UP, "+"):
        canvas.send_keys(keys)
        pictures.append(browser.execute_script(PIXELS))
    browser.find_element(By.CSS_SELECTOR, ".stage input").click()
    pictures.append(browser.execute_script(PIXELS))
    assert len({picture[0] for picture in pictures}) == len(pictures)
    assert pictures[-1][1] < pictures[-2][1]
    assert errors_of(browser) == []


@pytest.fixture(scope="module")
def shown(small_report, small_run, tmp_path_factory):
    """The three kinds of pages, and those of a report with a hand."""
    held = write_report(run_with_hand(tmp_path_factory.mktemp("hand")), jobs=1).index.parent
    folder = tmp_path_factory.mktemp("shown")
    asked = ["view", str(small_run / "grasps.json"), "--page", str(folder / "turn.html"), "-q"]
    assert main(asked) == Exit.GOOD
    return {
        "index": small_report / "index.html", "grasp": pages_of(small_report)[1],
        "turntable": folder / "turn.html",
        "hands": held / "index.html", "hand": held / "grasps" / f"{GRASP}.html",
    }  # fmt: skip


KINDS = ("index", "grasp", "turntable", "hands", "hand")
WIDTHS = (390, 1280)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("kind", KINDS)
def test_everything_is_on_the_screen_and_can_be_read_by_day_and_by_night(
    browser, shown, kind, width
):
    for dark in (False, True):
        opened(browser, shown[kind], width=width, dark=dark, touch=width < 500)
        browser.execute_script(
            "document.querySelectorAll('details').forEach((e) => { e.open = true; })"
        )
        found = browser.execute_script(CONTRASTS, "body *:not(script):not(style)")
        assert len(found) > 20
        assert [text for contrast, text in found if contrast < READABLE] == []
        light = browser.execute_script("return getComputedStyle(document.body).backgroundColor")
        assert (light == "rgb(255, 255, 255)") != dark
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    assert browser.execute_script(CLIPPED) == []
    small = browser.execute_script(
        "return [...document.querySelectorAll('p, td, label, dd')].map((node) => "
        "parseFloat(getComputedStyle(node).fontSize))"
    )
    assert min(small) >= 12.0


def test_what_is_cut_off_is_noticed(browser, shown):
    """A negative control of the test above."""
    opened(browser, shown["grasp"], width=1280)
    browser.execute_script(
        "document.querySelector('h1').style.marginLeft = '-120px';"
        "document.querySelector('.panels text').setAttribute('x', '-30')"
    )
    said = browser.execute_script(CLIPPED)
    assert [each.partition(":")[0] for each in said] == ["off the screen", "off its chart"]


def test_tables_sort_by_a_heading_and_with_keys(browser, shown):
    from selenium.webdriver import Keys
    from selenium.webdriver.common.by import By

    opened(browser, shown["grasp"])
    table = browser.find_elements(By.CSS_SELECTOR, "table.sorts")[1]
    buttons = table.find_elements(By.CSS_SELECTOR, "th button")
    column = [button.text.split()[0] for button in buttons].index("friction")

    def values():
        cells = table.find_elements(By.CSS_SELECTOR, f"tbody tr > :nth-child({column + 1})")
        return [float(cell.text) for cell in cells]

    before = values()
    buttons[column].click()
    assert values() == sorted(before)
    assert before != sorted(before)
    buttons[column].send_keys(Keys.ENTER)
    assert values() == sorted(before, reverse=True)
    heading = table.find_elements(By.CSS_SELECTOR, "thead th")[column]
    assert heading.get_attribute("aria-sort") == "descending"

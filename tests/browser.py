"""Opens files in a browser without a window, where there are a browser and Selenium."""

import json
import shutil
from importlib.util import find_spec

import pytest

BROWSER, DRIVER = (shutil.which(name) for name in ("chromium", "chromedriver"))
needs_browser = pytest.mark.skipif(
    not (BROWSER and DRIVER and find_spec("selenium")),
    reason="chromium, its driver or selenium (the extra test-slow) is missing",
)
READABLE = 4.5
"""Contrast of text that anyone can read, after WCAG 2.1."""
CONTRASTS = """
const light = (text) => {
  const parts = text.match(/[\\d.]+/g).slice(0, 3).map((part) => part / 255)
    .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
  return 0.2126 * parts[0] + 0.7152 * parts[1] + 0.0722 * parts[2];
};
const ground = (node) => {
  for (; node; node = node.parentElement) {
    const colour = getComputedStyle(node).backgroundColor;
    if (colour !== "rgba(0, 0, 0, 0)") return colour;
  }
  throw new Error("no background");
};
const written = (node) => [...node.childNodes].some((part) => part.nodeType === Node.TEXT_NODE
  && part.textContent.trim());
return [...document.querySelectorAll(arguments[0])]
  .filter((node) => written(node) && node.getClientRects().length)
  .map((node) => {
    const style = getComputedStyle(node);
    const own = node instanceof SVGElement ? style.fill : style.color;
    const [one, two] = [own, ground(node)].map(light);
    return [(Math.max(one, two) + 0.05) / (Math.min(one, two) + 0.05), node.textContent.trim()];
  });
"""
"""Contrast and text of every element that a selector finds and that has text of its own."""
CLIPPED = """
const wide = document.documentElement.clientWidth;
const scrolls = (node) => node && (/auto|scroll/.test(getComputedStyle(node).overflowX)
  || scrolls(node.parentElement));
const written = (node) => [...node.childNodes].some((part) => part.nodeType === Node.TEXT_NODE
  && part.textContent.trim());
const found = [];
for (const node of document.body.querySelectorAll("*")) {
  const hidden = !node.getClientRects().length;
  if (hidden || ["SCRIPT", "STYLE", "OPTION"].includes(node.tagName)) continue;
  const box = node.getBoundingClientRect();
  const sheet = node.ownerSVGElement && node.ownerSVGElement.getBoundingClientRect();
  const name = `${node.tagName} ${node.textContent.trim().slice(0, 40)}`;
  if (sheet && node.tagName === "text" && (box.left < sheet.left - 1
      || box.right > sheet.right + 1 || box.top < sheet.top - 1 || box.bottom > sheet.bottom + 1)) {
    found.push(`off its chart: ${name}`);
  }
  if (sheet) continue;
  if (!written(node) && !["IMG", "CANVAS", "INPUT", "SELECT"].includes(node.tagName)) continue;
  if (!scrolls(node) && (box.left < -1 || box.right > wide + 1)) {
    found.push(`off the screen: ${name}`);
  }
  const hides = getComputedStyle(node).overflowX === "hidden";
  if (hides && node.scrollWidth > node.clientWidth + 1) found.push(`cut: ${name}`);
}
for (const node of document.querySelectorAll(".wide")) {
  if (node.scrollWidth > node.clientWidth + 1) found.push(`scrolls: ${node.textContent.trim()}`);
}
return found;
"""
"""What of a page is not wholly on the screen, or not wholly on its chart."""
OWN = ("file://", "data:", "chrome://", "chrome-untrusted://")
"""How addresses begin that ask nothing of a network; the last two are the browser's own pages,
which a file cannot ask for."""
SHOWN = """
return document.readyState === "complete" && document.body?.innerText.trim().length > 0
  && decodeURIComponent(location.pathname).endsWith(`/${arguments[0]}`);
"""
"""Whether a file of a name is there and shows text; a driver may say so too early."""
PATIENCE = 60.0
"""Seconds until a page must show text."""


def headless(profile):
    """A browser without a window that tells of every request, and of what its console says."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    flags = ("headless", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run",
             "disable-background-networking", "disable-component-update", "disable-sync",
             "disable-dev-shm-usage", f"user-data-dir={profile}")  # fmt: skip
    for flag in flags:
        options.add_argument(f"--{flag}")
    options.add_experimental_option("prefs", {"session.restore_on_startup": 4,
                                              "session.startup_urls": ["about:blank"]})  # fmt: skip
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    return webdriver.Chrome(options=options, service=Service(DRIVER))


def opened(browser, path, *, width=1200, dark=False, touch=False):
    """Open a file, and wait until it shows text, which it may do only after it is loaded."""
    from selenium.webdriver.support.wait import WebDriverWait

    for log in ("browser", "performance"):
        browser.get_log(log)
    scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": touch}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(path.as_uri())
    WebDriverWait(browser, PATIENCE).until(lambda page: page.execute_script(SHOWN, path.name))


def requests_of(browser):
    """Addresses that were asked for since a file was opened."""
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    return [each["params"]["request"]["url"] for each in messages
            if each["method"] == "Network.requestWillBeSent"]  # fmt: skip

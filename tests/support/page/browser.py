"""A real browser, Debian's chromium, driven by Selenium; its pictures are kept in build/page."""

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from selenium.webdriver import Chrome, ChromeOptions, Keys
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.remote_connection import RemoteConnection

from support.paths import ROOT
from support.processes.waiting import PATIENCE_S

PICTURES = ROOT / "build" / "page"
CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
TABLET = (1280, 800)

LEGIBLE = 4.5  # of contrast, WCAG 2.2, success criterion 1.4.3
# The worst contrast of every text with its background, and the text.
CONTRAST = """
const channel = (c) => (c /= 255) <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
const light = ([r, g, b]) => 0.2126 * channel(r) + 0.7152 * channel(g) + 0.0722 * channel(b);
const parts = (colour) => colour.match(/[\\d.]+/g).map(Number);
const behind = (element) => {
  for (let e = element; e; e = e.parentElement) {
    const [r, g, b, a = 1] = parts(getComputedStyle(e).backgroundColor);
    if (a > 0) return [r, g, b];
  }
};
const found = [];
const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
while (texts.nextNode()) {
  const element = texts.currentNode.parentElement;
  const hidden = !element.checkVisibility() || element.closest(":disabled, noscript, .skip");
  if (hidden || !texts.currentNode.textContent.trim()) continue;
  const [one, other] = [light(parts(getComputedStyle(element).color)), light(behind(element))];
  found.push([(Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05), texts.currentNode.textContent]);
}
return found.sort((a, b) => a[0] - b[0])[0];
"""

# A machine without the browser may skip these tests; CI may not.
needs_browser = pytest.mark.skipif(
    not (CHROMIUM and DRIVER) and os.environ.get("CI") != "true", reason="needs chromium and chromium-driver"
)


def _as_nice_as_all_else(service: Service) -> Service:
    """Keep root's browser from raising its own priority above the laboratory's."""
    if os.geteuid() == 0 and (setpriv := shutil.which("setpriv")):
        driver, service.path = service.path, setpriv
        service.command_line_args = lambda: [  # pyrefly: ignore[method-assign]  # a stand-in
            "--bounding-set=-sys_nice",
            driver,
            f"--port={service.port}",
            *service.service_args,
        ]
    return service


@contextmanager
def browser(size: tuple[int, int] = TABLET, *, dark: bool = False) -> Iterator[Chrome]:
    """Yield a window of that size, which records its console and its requested addresses."""
    options = ChromeOptions()
    options.binary_location = CHROMIUM or ""
    for argument in (
        "--headless=new",
        "--no-sandbox",
        "--disable-dev-shm-usage",
        "--disable-gpu",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--no-first-run",
        "--hide-scrollbars",
        f"--window-size={size[0]},{size[1]}",
        *(["--force-dark-mode"] if dark else []),
    ):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = Chrome(options=options, service=_as_nice_as_all_else(Service(DRIVER)))
    if isinstance(driver.command_executor, RemoteConnection):
        driver.command_executor.client_config.timeout = int(PATIENCE_S)
    driver.set_page_load_timeout(PATIENCE_S)
    driver.set_script_timeout(PATIENCE_S)
    try:
        set_theme(driver, dark=dark)
        yield driver
    finally:
        driver.quit()


def set_theme(driver: Chrome, *, dark: bool) -> None:
    """Set the colour scheme that the system prefers."""
    wish = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": wish})


@contextmanager
def screen(driver: Chrome, width: int, height: int) -> Iterator[None]:
    """Give the page exactly this size in CSS pixels, inside the block."""
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    try:
        yield
    finally:
        driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def picture(driver: Chrome, name: str, *, whole: bool = False) -> Path:
    """Save the window, or the `whole` page, as build/page/NAME.png."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    path = PICTURES / f"{name}.png"
    if not whole:
        driver.save_screenshot(str(path))
        return path
    width, height = driver.execute_script("return [innerWidth, document.documentElement.scrollHeight]")
    with screen(driver, width, height):
        driver.save_screenshot(str(path))
    return path


def legible(driver: Chrome) -> None:
    """Assert that every text shown has enough contrast with its background."""
    contrast, words = driver.execute_script(CONTRAST)
    assert contrast >= LEGIBLE, words


def text(driver: Chrome, element: str) -> str:
    """Return the visible text of the element of that id."""
    return driver.find_element(By.ID, element).text


def type_line(driver: Chrome, words: str) -> None:
    """Type a line and Enter, as a keyboard or a scanner does, wherever the cursor is."""
    driver.switch_to.active_element.send_keys(words, Keys.ENTER)


def kind(driver: Chrome) -> str:
    """Return the run's state, by the page's own name for it."""
    return str(driver.execute_script("return document.body.dataset.kind"))


def severe(driver: Chrome) -> list[str]:
    """Return the console's errors since the last call."""
    entries: list[dict[str, Any]] = driver.get_log("browser")
    return [entry["message"] for entry in entries if entry["level"] == "SEVERE"]


def list_requested_hosts(driver: Chrome) -> set[str]:
    """Return the hosts of all addresses that the browser has requested since the last call."""
    hosts = set()
    for entry in driver.get_log("performance"):
        message = json.loads(entry["message"])["message"]
        if message["method"] == "Network.requestWillBeSent":
            address = urlsplit(message["params"]["request"]["url"])
            if address.scheme in ("http", "https", "ws", "wss"):  # chrome: and data: leave no wire
                hosts.add(address.hostname or "")
    return hosts

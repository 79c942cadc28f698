"""The page of a session by hand in a real browser: the line, the drawing, the tones, what is still open."""

from math import radians
from pathlib import Path

import pytest
from selenium.webdriver import Chrome
from selenium.webdriver.common.by import By

from rig.data.recording.hand_events import HandAsked, HandMoveRefused, HandRested
from rig.motion.by_hand import Face, HandMove, Instruction
from rig.motion.steps import Plan
from rig.page.about import About
from rig.page.arm import built
from rig.plans.by_hand import WantedMoves, still_open
from rig.station.events import ArmConnected, HandSeen, PhaseStarted
from rig.turners.turner_registry import load_turner_kinds
from support.page.browser import legible, needs_browser, picture, screen, text
from support.page.scripted_page import showing
from support.processes.waiting import wait_for

pytestmark = [pytest.mark.slow, needs_browser, pytest.mark.usefixtures("nothing_severe_and_nothing_from_elsewhere")]
KIND = load_turner_kinds()["hand"]
SECTION = KIND.section()
ABOUT = About(
    "runs/by hand", "by_hand", parts={"gyro": "lsm9ds1 HAND-1"}, arm=built(KIND.describe_configured(SECTION).kinematics)
)
TABLET, DESK, TELEPHONE = (768, 1024), (1280, 800), (390, 844)
SHOWN = "return document.getElementById('hand').checkVisibility()"


def seen(doing: str, peak_deg_s: float, taken: list[HandMove], faces: list[Face]) -> HandSeen:
    left = still_open(WantedMoves(12, 3), taken, faces)
    return HandSeen(
        5.0, doing, 0.8, radians(212), radians(peak_deg_s), radians(500), 2.5e-3, tuple(faces), left.pairs, left.turns,
        len(taken),
    )  # fmt: skip


def test_the_line_the_drawing_and_what_is_open(driver: Chrome, tmp_path: Path) -> None:
    with showing(driver, tmp_path, about=ABOUT) as tell:
        tell(ArmConnected(KIND.look(SECTION)), PhaseStarted("by_hand", Plan((), (), ()), {"gyro": "raw"}))
        tell(HandAsked(Instruction("lay", "+z")), seen("starting", 0, [], []))
        wait_for(lambda: text(driver, "hand-line").startswith("Lay it down with the side +z up"), "the line")
        tell(HandRested(1, 2, "+z"), HandAsked(Instruction("lay", "-x")), seen("resting", 90, [], ["+z"]))
        wait_for(lambda: "side −x up" in text(driver, "hand-line"), "the next line")
        drawing = driver.find_element(By.CSS_SELECTOR, "#hand-drawing svg")
        assert "−x up" in (drawing.get_attribute("aria-label") or "").replace("side ", "")
        named = [element.text for element in drawing.find_elements(By.CSS_SELECTOR, ".wanted")]
        assert named == ["−x", "−x"]  # as it lies now, and as it is to lie
        assert "12 moves from side to side, 3 whole turns" in text(driver, "hand-wanted")
        assert "✓ +z up" in text(driver, "hand-sides")
        for width, height in (TABLET, DESK, TELEPHONE):
            with screen(driver, width, height):
                assert driver.execute_script("return document.documentElement.scrollWidth <= innerWidth")
                picture(driver, f"by_hand_{width}")
        legible(driver)


def test_a_move_that_is_too_fast_or_to_be_repeated_is_reported(driver: Chrome, tmp_path: Path) -> None:
    with showing(driver, tmp_path, about=ABOUT) as tell:
        tell(PhaseStarted("by_hand", Plan((), (), ()), {"gyro": "raw"}), HandRested(1, 2, "+z"))
        tell(HandMoveRefused(1, 2, "turn_not_closed"))
        tell(HandAsked(Instruction("turn", "+z", 1), "turn_not_closed", "that turn ended 2.0° from where it began"))
        tell(seen("moving", 470, [], ["+z"]))
        wait_for(lambda: "Again: that turn ended 2.0°" in text(driver, "hand-why"), "why")
        wait_for(lambda: "too fast" in text(driver, "hand-peak"), "the peak")
        picture(driver, "by_hand_again")
        legible(driver)


def test_a_tone_comes_once_somebody_has_tapped(driver: Chrome, tmp_path: Path) -> None:
    count = "window.waves = 0; const make = AudioContext.prototype.createOscillator;"
    count += "AudioContext.prototype.createOscillator = function () { window.waves += 1; return make.call(this); };"
    with showing(driver, tmp_path, about=ABOUT) as tell:
        tell(HandAsked(Instruction("lay", "+z")), seen("starting", 0, [], []))
        wait_for(lambda: driver.execute_script(SHOWN), "the panel")
        driver.execute_script(count)
        tell(HandRested(1, 2, "+z"))
        assert driver.execute_script("return window.waves") == 0
        driver.find_element(By.ID, "hand-sound").click()
        wait_for(lambda: text(driver, "hand-sound") == "Sound is on", "the switch")
        before = driver.execute_script("return window.waves")
        tell(HandMoveRefused(1, 2, "clipping"))
        wait_for(lambda: driver.execute_script("return window.waves") > before, "a tone")

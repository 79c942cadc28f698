"""A whole run on a simulated servo: mountings, a fault on the way, the rest of it, and the documents of its end."""

import json
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from firmware_host.computer_load import load_factor
from rig.data.recording.run_file import read_run
from rig.turners.servo.servo_link import MAX_SILENCE_S
from support.laboratories.commands import rig, rig_here
from support.laboratories.servo_runs import Act, Seen, carry_out, configure

pytestmark = pytest.mark.slow

TURNS = "done: rest before sweep"  # the turn begins with it
FROZEN_S = 2.0
SCALE = (1.1771, 1.1554, 1.1440)


def asked(**request: object) -> Act:
    return lambda seen: (seen.control(request), None)[1]


def sent(number: signal.Signals) -> Act:
    return lambda seen: seen.process.send_signal(number)


def frozen(seen: Seen) -> None:
    seen.process.send_signal(signal.SIGSTOP)
    time.sleep(FROZEN_S)
    seen.process.send_signal(signal.SIGCONT)


@pytest.mark.thorough
def test_a_run_that_lost_its_supply_is_resumed_and_solved(tmp_path: Path) -> None:
    config, out = configure(tmp_path), tmp_path / "run"
    off = asked(do="servo_power", on=False)
    seen = carry_out("run", config, "--out", out, config=config, when=TURNS, times=2, act=off, after_s=0.8)
    said = "".join(seen.output)
    assert seen.process.returncode == 3 and "servo_link_lost" in said and "rig resume" in said
    assert seen.at_rest_after_s < 1.0 and seen.stood
    begun = [read_run(out / name) for name in ("run.h5", "run-2.h5")]
    assert [len(run.samples["gyro"]) > 1000 for run in begun] == [True, True] and len(begun[1].states) > 100

    rest = carry_out("resume", out, config=config)
    assert rest.process.returncode == 0, "".join(rest.output)
    assert "stage 1 of 3" not in "".join(rest.output).lower()

    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    gyro = result["gyroscopes"]["gyro"]
    assert (result["verdict"], gyro["estimator"], result["provenance"]["turner_kind"]) == ("pass", "newton", "servo")
    u = np.sqrt(np.diag(gyro["covariance_combined"]))[:3]
    assert np.all(np.abs(np.array(gyro["scale"]) - SCALE) < 4 * u)
    assert "A servo turns the items" in (out / "certificate.html").read_text(encoding="utf-8").replace("\n", " ")

    again = rig_here("solve", out, "--json")
    assert json.loads(again.stdout)["gyroscopes"]["gyro"]["scale"] == gyro["scale"]
    beside = json.loads(rig_here("solve", out, "--json", "--estimator", "vector").stdout)["gyroscopes"]["gyro"]
    assert beside["estimator"] == "vector"
    assert "verdict: PASS" in rig_here("show", out).stdout


def test_what_is_there_is_looked_at_and_nothing_turns(tmp_path: Path) -> None:
    config = configure(tmp_path, {"world": {"servo": {"firmware": 37}}})
    done = rig("check", config)
    assert done.returncode == 2 and "servo_firmware_old" in done.stderr
    assert "ROBOTIS XM430-W210, ID 1, firmware 37" in done.stdout and "torque off" in done.stdout


FAULTS: dict[str, tuple[Act, int, str]] = {
    "Ctrl-C": (lambda seen: seen.interrupt(), 130, "interrupted"),
    "adapter pulled out": (asked(do="servo_line", listen=False), 3, "servo_port_lost"),
    "bus cable pulled": (asked(do="servo_line", silent=True), 3, "servo_link_lost"),
    "supply off": (asked(do="servo_power", on=False), 3, "servo_link_lost"),
    "shaft held fast": (asked(do="servo_fault", held_fast=True), 3, "servo_overload"),
    "too hot": (asked(do="servo_fault", temperature_c=85), 3, "servo_overheated"),
    "torque switched off by another": (asked(do="servo_torque", on=0), 3, "servo_torque_lost"),
    "answers nothing more": (asked(do="servo_fault", dumb=True), 3, "servo_link_lost"),
    "every reply damaged": (asked(do="servo_fault", spoil=1000000), 3, "servo_replies_damaged"),
    "every reply lost": (asked(do="servo_fault", lose=1000000), 3, "servo_link_lost"),
    "the board's cable pulled": (asked(do="unplug_board"), 3, "board"),
    "the board silent": (asked(do="silence_board", on=True), 3, "board"),
    "the sensor silent": (asked(do="sensor_fault", sensor="gyro", fault="silent"), 3, "sensor_silent"),
    "supply off and on": (
        lambda seen: (asked(do="servo_power", on=False)(seen), asked(do="servo_power", on=True)(seen), None)[2],
        3,
        "servo_restarted",
    ),
    "voltage gone low": (asked(do="servo_fault", voltage_v=8.0), 3, "servo_hardware_error"),
    "the board reset": (asked(do="reset_board"), 3, "board"),
    "the board's line at another rate": (asked(do="host_baud", baud=9600), 3, "board"),
    "terminated": (sent(signal.SIGTERM), 130, "interrupted"),
    "the terminal closed": (sent(signal.SIGHUP), 130, "interrupted"),
    "the program frozen": (frozen, 3, "servo"),
}
MOMENTS = {"in the first turn": (1, 0.8), "in the second mounting": (2, 0.8), "as a turn begins": (2, 0.0),
           "braking": (3, 2.0), "in the last mounting": (3, 0.5)}  # fmt: skip
UNANSWERED = ("servo_link_lost", "servo_replies_damaged")  # of an instruction: the servo does not hear
ALSO = {"supply off and on": ("servo_torque_lost",)}  # which of two signs is seen first is a matter of milliseconds
STANDS_S = 1.1  # after a fault is known, and looked at every 10 ms
# An overload is known when it has lasted; that a board is silent, after 2 s of a turn, or where the turn has ended
# meanwhile, after 4 s without an answer.
KNOWN_S = {"shaft held fast": 2.0, "the board silent": 5.0, "the board's line at another rate": 5.0}


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("what", FAULTS)
def test_whatever_happens_the_shaft_stands_the_data_are_kept_and_the_run_goes_on(
    what: str, moment: str, tmp_path: Path
) -> None:
    (act, status, name), (times, after_s) = FAULTS[what], MOMENTS[moment]
    config, out = configure(tmp_path), tmp_path / "run"
    seen = carry_out("run", config, "--out", out, config=config, when=TURNS, times=times, act=act, after_s=after_s)
    said = "".join(seen.output)
    silent_s = MAX_SILENCE_S * load_factor()
    print(f"at rest after {seen.at_rest_after_s:.2f} s; a silence is known after {silent_s:.2f} s here")
    names = {name, *ALSO.get(what, ())}
    if moment == "as a turn begins" and name in UNANSWERED:
        names.add("servo_does_not_hear")
    assert seen.process.returncode == status and any(name in said for name in names), said
    assert seen.at_rest_after_s < KNOWN_S.get(what, 0.0) + silent_s + STANDS_S, seen.at_rest_after_s
    assert seen.stood
    last = read_run(sorted(out.glob("run*.h5"), key=lambda path: path.stat().st_mtime)[-1])
    assert len(last.samples["gyro"]) > 500 and len(last.states) > 100
    rest = carry_out("resume", out, config=config)
    assert rest.process.returncode == 0, "".join(rest.output)

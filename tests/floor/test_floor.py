"""What the floor shows of stations and of a history, and who may ask for it."""

import http.client
import json
import time
from datetime import date, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from urllib.parse import urlsplit

import numpy as np
import pytest

from rig.batch.batch_state import Begun, PartBegun, PartEnded, state_of
from rig.batch.status import Now, Present, after, last, update_by_batch
from rig.errors import Fault, Refused
from rig.floor import floor_content
from rig.floor.floor_feed import polled_feed
from rig.floor.heartbeat import heartbeat
from rig.history import stations
from rig.history.stations import StationState
from rig.history.storage.address import resolve_address
from rig.history.store import open_history
from rig.motion.turner_state import Report
from rig.page.server.control import Control
from rig.page.server.feed import frame_of
from rig.page.server.sections import Sections
from rig.page.server.serving import Page, PageAddress, serving
from rig.station.events import ArmConnected, Failed, Prompt, SamplingStarted
from support.history.past_runs import FIRST, finish_run
from support.processes.waiting import PATIENCE_S, wait_for

AT = "2026-11-25T08:00:00+00:00"


def told(now: Now, age_s: float = 0.4) -> StationState:
    return StationState("bench 1", "lab-1", now.json(), age_s)


def cards(*of: StationState) -> list[dict[str, Any]]:
    sections = floor_content.rigs(of)
    return [sections[f"rig {place}"] for place in range(sections["rigs"]["count"])]


def state(now: Now, age_s: float = 0.4) -> str:
    return str(cards(told(now, age_s))[0]["state"])


def test_a_station_tells_its_batch_and_its_run() -> None:
    passed = PartEnded("pass", AT)
    batch = state_of([Begun("A. Person", "W-17", AT), PartBegun("G-1", "01", AT), passed, PartBegun("G-2", "02", AT)])
    now = update_by_batch(Now(), batch)
    assert (now.state, now.part, now.operator) == ("checking", "G-2", "A. Person")
    assert now.counts == {"pass": 1, "open": 1} and now.parts == (("G-1", "pass"), ("G-2", "open"))
    assert after(now, Prompt(())).state == "asking"
    assert after(now, SamplingStarted()).state == "running"
    fault = after(now, Failed(Fault("board_link_lost", "the board is gone", "Plug it in")))
    assert (fault.state, fault.doing) == ("fault", "board_link_lost: the board is gone")
    assert after(now, Failed(Refused("no_port", "it is not there", "Plug it in"))).state == "refused"


def test_while_the_operator_is_asked_between_two_runs_the_station_says_so() -> None:
    told_of = list[Now]()
    present = Present(Now("fault", "G-1", "board_link_lost: …"), (told_of.append,))
    with present.asking("to mount the part"):
        pass
    assert [(each.state, each.doing) for each in told_of] == [("asking", "to mount the part"), ("checking", "")]


@pytest.mark.parametrize(("named", "shown_as"), [("", "20235599999"), ("bench 1", "bench 1")])
def test_a_rig_has_the_name_that_the_history_gives_it(named: str, shown_as: str) -> None:
    """Without `history.rig` that is the serial number of its arm, which is known once it is connected."""
    report = cast(Report, SimpleNamespace(serial_number="20235599999"))
    connected = after(Now(rig=named), ArmConnected(report))
    (card,) = cards(StationState(named or "192.0.2.7", "lab-1", connected.json(), 0.4))
    assert (card["rig"], card["at"]) == (shown_as, named or "192.0.2.7")
    assert cards(StationState("192.0.2.7", "lab-1", Now().json(), 0.4))[0]["rig"] == "192.0.2.7"


def test_a_rig_without_a_sign_of_life_is_dead_unless_it_said_its_last_word() -> None:
    running, ended = Now(state="running"), last(Now(state="ended"))
    fault = last(Now(state="fault", doing="board_link_lost: …"))
    assert [state(running), state(running, 60), state(last(running), 60), state(ended, 60), state(fault, 60)] == [
        "running", "dead", "stopped", "ended", "fault",
    ]  # fmt: skip
    assert cards(StationState("bench 1", "lab-1", "no JSON", 60))[0]["state"] == "dead"


@pytest.mark.parametrize("said", ["no JSON", '{"parts": 5}', '{"state": "flies"}', "[" * 20_000])
def test_what_is_nothing_a_station_says_is_shown_as_that_and_hides_no_other_rig(said: str) -> None:
    odd, running = cards(StationState("bench 0", "lab-0", said, 0.4), told(Now(state="running")))
    assert odd == {"rig": "bench 0", "at": "bench 0", "computer": "lab-0", "state": "unread", "age": ""}
    assert running["state"] == "running"
    (half_a_character,) = cards(StationState("bench 0", "lab-0", '{"doing": "\\ud800"}', 0.4))
    assert half_a_character["doing"] == "\\ud800"


@pytest.mark.slow
def test_todays_parts_standards_and_recalls_are_those_of_the_history(tmp_path: Path) -> None:
    with open_history(str(tmp_path / "history.sqlite")) as history:
        for day in range(12):
            drifting = tuple(np.array((1.01, 0.99, 1.0)) + 0.002 * day)
            history.enter(finish_run(10 * day, drifting, serial_number="G-9"))
            history.enter(finish_run(10 * day + 0.1, rig="bench B", serial_number="CHECK", check_standard=True))
        for day in range(12, 20):
            jumped = (1.02, 1.0, 1.01)
            history.enter(finish_run(10 * day + 0.1, jumped, rig="bench B", serial_number="CHECK", check_standard=True))
        pasts = history.calibrations()
    last = (FIRST + timedelta(days=110)).date()
    assert [(row["serial"], row["rig"]) for row in floor_content.todays(pasts, last)] == [
        ("CHECK", "bench B"), ("G-9", "bench A"),
    ]  # fmt: skip
    (standard,) = floor_content.standards(pasts)
    assert (standard["rig"], standard["control"]) == ("bench B", "out") and "kx" in standard["out"]
    due = floor_content.recalls(pasts, date(2030, 1, 1))
    assert "G-9" in {row["serial"] for row in due} and all(row["overdue"] for row in due)
    assert floor_content.recalls(pasts, date(2020, 1, 1)) == []


def states_become(feed: Sections, wanted: dict[str, str]) -> None:
    """Wait until the floor shows each rig in the state that is wanted."""

    def so() -> bool:
        shown_now = json.loads(feed.whole().split(b"data: ", 1)[1])
        here = [each for name, each in shown_now.items() if name.startswith("rig ") and each is not None]
        return {each["rig"]: each["state"] for each in here} == wanted

    wait_for(so, f"the floor shows {wanted}")


@pytest.mark.slow
def test_what_stations_tell_a_history_is_on_the_floor(tmp_path: Path) -> None:
    where = resolve_address(str(tmp_path / "history.sqlite"))
    with open_history(where), polled_feed(where) as feed:
        with heartbeat("bench 1", where, Now("running")), heartbeat("bench 2", where, Now("waiting")) as second:
            states_become(feed, {"bench 1": "running", "bench 2": "waiting"})
            second.hear(Now("fault", doing="board_link_lost: the cable was pulled out"))
            states_become(feed, {"bench 1": "running", "bench 2": "fault"})
        states_become(feed, {"bench 1": "stopped", "bench 2": "fault"})


HARM = {  # rows of the table: a rig's name, when it was heard, what it said
    "an age that is infinite": "SELECT 'bench 0', 9e999, '{}'",
    "an age before the beginning": "SELECT 'bench 0', -9e999, '{}'",
    "an age that is no number": "SELECT 'bench 0', 'soon', '{}'",
    "a year ahead": "SELECT 'bench 0', 4e9, '{}'",
    "a time left without end": """SELECT 'bench 0', 1e9, '{"left_s": NaN}'""",
    "counts without end": """SELECT 'bench 0', 1e9, '{"counts": {"pass": 1e999}}'""",
    "names that are bytes": "SELECT x'ff00', 1e9, x'ff'",
    "names that are not UTF-8": "SELECT CAST(x'ff41' AS TEXT), 1e9, CAST(x'ff' AS TEXT)",
    "names that are numbers": "SELECT 5, 1e9, 7",
    "a name of ten million characters": "SELECT hex(zeroblob(5000000)), 1e9, '{}'",
    "a report of ten million characters": """SELECT 'bench 0', 1e9, '{"doing": "' || hex(zeroblob(5000000)) || '"}'""",
    "three thousand rigs": """WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 3000)
        SELECT i || hex(zeroblob(75)), 1e9 + i, '{"doing": "' || hex(zeroblob(8000)) || '"}' FROM n""",
}


@pytest.mark.slow
@pytest.mark.parametrize("harm", HARM)
def test_no_row_hides_a_rig_or_makes_the_page_heavy(tmp_path: Path, harm: str) -> None:
    with open_history(str(tmp_path / "history.sqlite")) as history:
        stations.make_table(history.engine)
        with history.engine.connect().execution_options(rig_writes=True) as connection, connection.begin():
            made = connection.exec_driver_sql(f"INSERT INTO station(rig, heard_s, told, computer) "
                                              f"SELECT *, 'lab-0' FROM ({HARM[harm]})").rowcount  # fmt: skip
        stations.tell(history.engine, "bench 1", "lab-1", Now("running", "G-1").json())
        sections, again = (floor_content.rigs(*stations.heard(history.engine)) for _ in range(2))
    running = [section for section in sections.values() if section is not None and section.get("rig") == "bench 1"]
    assert [(each["state"], each["part"]) for each in running] == [("running", "G-1")]
    assert sections["rigs"] == {"count": min(made + 1, 100), "more": max(made + 1 - 100, 0)}
    frame = frame_of("all", sections)
    assert len(frame) < 100_000
    json.loads(frame.split(b"data: ", 1)[1], parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert again == sections, "a rig of which nothing is new is not sent again"


@pytest.mark.slow
def test_the_database_alone_tells_ages(tmp_path: Path) -> None:
    with open_history(str(tmp_path / "history.sqlite")) as history:
        assert stations.heard(history.engine) == ([], 0)
        stations.make_table(history.engine)
        for text in ("{}", '{"state":"running"}'):
            stations.tell(history.engine, "bench 1", "lab-1", text)
        time.sleep(0.3)
        (only,), _ = stations.heard(history.engine)
        assert only.age_s is not None and only.state == '{"state":"running"}' and 0.25 < only.age_s < 60
        assert list(history.broken()) == []


@pytest.mark.slow
def test_the_floor_is_guarded_as_the_operators_page_and_has_nothing_that_acts(tmp_path: Path) -> None:
    token = "a-token-of-two-and-twenty"
    feed = Sections()
    with serving(feed, Control(may_answer=False), None, PageAddress(port=0, token=token), Page("floor.html")) as page:
        port = urlsplit(page).port or 0

        def asked(method: str, path: str, **headers: str) -> tuple[int, str]:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
            connection.request(method, path, headers={"Authorization": f"Bearer {token}", **headers})
            answer = connection.getresponse()
            text = "" if path == "/events" and answer.status == 200 else answer.read().decode()
            connection.close()
            return answer.status, text

        status, text = asked("GET", "/")
        assert status == 200 and "floor.js" in text
        assert asked("GET", "/events")[0] == 200
        assert asked("GET", "/", Host="evil.example")[0] == 400
        assert asked("GET", "/events", Origin="http://evil.example")[0] == 403
        for path in ("/stop", "/answer", "/certificate.html"):
            assert asked("POST", path)[0] == 404
        assert asked("POST", "/")[0] == 405

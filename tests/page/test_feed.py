"""What gets from a run to browsers: all of it to one that reads, the newest to one that is slow, nothing waits."""

import asyncio
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rig.motion.turner_state import Report
from rig.page.page_state import PageState
from rig.page.recent_readings import POINTS, STEP_S
from rig.page.server.feed import Broadcast, Feed, Mailbox
from rig.station.events import ArmConnected, ArmSeen, HandSeen, RunEvent, SamplesTaken, SensorSamples
from rig.turners.turner_registry import load_turner_kinds
from support.page.scripted_runs import (
    ABOUT,
    before_it_moves,
    judge,
    look,
    moving,
    plan_demo,
    report,
    servo_report,
    servo_state,
    state,
)


def fed() -> Feed:
    return Feed(PageState(ABOUT))


def read(frame: bytes | None) -> tuple[str, dict[str, Any]]:
    assert frame is not None
    name, data = frame.decode().strip().split("\n")
    return name.removeprefix("event: "), json.loads(data.removeprefix("data: "))


def test_news_hold_what_has_changed_and_each_point_once() -> None:
    feed, plan = fed(), plan_demo()
    for event in before_it_moves(plan):
        feed.event(event)
    assert read(feed.news())[0] == "some" and feed.news() is None
    times: list[float] = []
    for number, event in enumerate(moving(plan, 30.0)):
        feed.event(event)
        if number % 7 == 0 and (frame := feed.news()) is not None:
            points = read(frame)[1]["points"]
            assert points["from"] == len(times) or not points["time_s"]
            times += points["time_s"]
            assert "about" not in read(frame)[1]
    times += read(feed.news() or feed.whole())[1]["points"]["time_s"]
    assert times[:200] == [round(STEP_S * number, 2) for number in range(200)]


def test_the_arm_is_named_as_it_was_found() -> None:
    feed = fed()
    for event in before_it_moves(plan_demo()):
        feed.event(event)
    arm = read(feed.whole())[1]["arm"]
    assert arm["model"] == "UR10e or UR12e" and arm["serial_number"] == "20225500001"


HAND = load_turner_kinds()["hand"]
AT_HAND = HandSeen(5.0, "resting", 0.8, 0.0, 0.0, 8.0, None, (), (), (), 0)
# How a turner is connected, how it is seen then, and what has an age before the first sample.
TURNERS: dict[str, tuple[Report, Callable[[float], RunEvent], dict[str, float]]] = {
    "arm": (report((0.0,) * 6), lambda time_s: ArmSeen(state(time_s, (0.0,) * 6, (0.0,) * 6), 0), {"arm": 47.0}),
    "servo": (
        servo_report(servo_state(0.0, 0.1)),
        lambda time_s: ArmSeen(servo_state(time_s, 0.1), 0),
        {"arm": 47.0},
    ),
    "hand": (HAND.look(HAND.section()), lambda _: AT_HAND, {}),
}


@pytest.mark.parametrize("turner", TURNERS)
@pytest.mark.parametrize("sensor", ["gyro", "lines"])
def test_what_arrives_has_the_age_of_its_last_arrival_whatever_turns_and_reads(turner: str, sensor: str) -> None:
    connected, seen, at_first = TURNERS[turner]
    now_s = [100.0]
    feed = Feed(PageState(ABOUT), lambda: now_s[0])

    def comes(number: int) -> None:
        feed.event(SamplesTaken((SensorSamples(sensor, 10 * number, 0, {"rate": (0.0, 0.0, 0.0)}),)))
        feed.event(seen(number * STEP_S))

    feed.event(ArmConnected(connected))
    now_s[0] += 47.0
    assert read(feed.whole())[1]["age_s"] == at_first
    comes(1)
    now_s[0] += 0.5
    comes(2)
    now_s[0] += 0.3
    assert read(feed.news())[1]["age_s"] == dict.fromkeys([*at_first, "readings"], 0.3)
    now_s[0] += 4.0
    comes(2)  # it is told again, but nothing has come
    assert (
        read(feed.news())[1]["age_s"] == dict.fromkeys([*at_first, "readings"], 4.3) == read(feed.whole())[1]["age_s"]
    )


def test_a_minute_is_kept_and_no_more() -> None:
    feed = fed()
    for number in range(3 * POINTS):
        feed.event(SamplesTaken((SensorSamples("gyro", number, 0, {"rate": (0.0, 0.0, math.nan)}),)))
        feed.event(ArmSeen(state(number * STEP_S * 1.01, (0.0,) * 6, (0.0,) * 6), 0))
    _, whole = read(feed.whole())
    assert len(whole["points"]["time_s"]) == POINTS and whole["points"]["first"] == 2 * POINTS
    assert whole["points"]["lines"]["gyro.rate_rad_s"][-1] == [0.0, 0.0, None]  # JSON knows no NaN


def test_who_is_behind_gets_everything_once_and_a_mailbox_holds_one_frame() -> None:
    async def slow() -> None:
        feed, mailbox = fed(), Mailbox()
        assert read(await mailbox.take(feed))[0] == "all"
        mailbox.put(b"event: some\ndata: {}\n\n")
        assert read(await mailbox.take(feed))[0] == "some"
        for _ in range(10_000):
            mailbox.put(b"event: some\ndata: {}\n\n")
        assert read(await mailbox.take(feed))[0] == "all"
        mailbox.put(b"event: some\ndata: {}\n\n")
        mailbox.close()
        assert read(await mailbox.take(feed))[0] == "some" and await mailbox.take(feed) is None

    asyncio.run(slow())


@pytest.mark.slow
def test_the_last_news_reach_who_reads_and_nobody_else_is_waited_for_long() -> None:
    async def ending() -> None:
        feed = fed()
        broadcast = Broadcast(feed)
        posting = asyncio.create_task(broadcast.run())
        stalled = broadcast.frames()
        await anext(stalled)

        async def reads() -> list[str]:
            return [read(frame)[0] async for frame in broadcast.frames()]

        reading = asyncio.create_task(reads())
        await asyncio.sleep(0.3)
        for event in judge(Path("nowhere"), passed=True):
            feed.event(event)
        await broadcast.close(0.3)
        assert (await reading)[-1] == "some"
        await stalled.aclose()
        await posting

    asyncio.run(ending())


def test_the_hosts_observation_takes_the_place_of_the_boards_and_a_result_that_of_what_was_so_far() -> None:
    shown, plan = PageState(ABOUT), plan_demo()
    for event in [*before_it_moves(plan), *moving(plan, 100.0)]:
        shown.take(event)
    assert [(row["sweep"], row["by"]) for row in shown.sections["observations"]] == [(n, "board") for n in range(6)]
    assert shown.sections["observations"][3]["refused"].startswith("saturation: ")
    shown.look(look(plan, 2))
    rows = shown.sections["observations"]
    assert [(row["sensor"], row["by"]) for row in rows[:5]] == [
        ("gyro", "host"), ("reference", "host"), ("gyro", "host"), ("reference", "host"), ("gyro", "board"),
    ]  # fmt: skip
    assert {row["joint"] for row in rows} == {"wrist_3", "wrist_1", "wrist_2"}

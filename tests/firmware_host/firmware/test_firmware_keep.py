"""The board averages what it kept and solves by itself: the core on this machine."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from firmware_host.frames import Frame
from firmware_host.parts import BOARD_PARTS, GYROSCOPES
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator
from support.board.host_board import PERIOD_US, HostBoard, configure, convert, error_of, settle

RAD_S = np.radians(8.75e-3)  # per count of the LSM9DS1 at 245 °/s
SPEED_RAD_S = 1.0472
DIRECTIONS = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=np.float64)
SCALE, BIAS_RAD_S = np.array([1.1771, 1.1554, 1.1440]), np.array([0.0077, -0.0100, -0.0051])


class Sweeps:
    """An LSM9DS1 that streams from `time_us` on, and its clock: `turn` lets it convert."""

    def __init__(self, time_us: int = 0) -> None:
        self.board = HostBoard()
        for now_us in range(0, time_us, 1 << 30):  # the counter wraps, and is read at least every half hour
            self.board.set_time(now_us)
            self.board.run()
        self.board.set_time(time_us)
        self.board.run()
        self.board.frames()
        configure(self.board, 0, 238, 245)
        self.board.ask("start", sensors=0)
        settle(self.board, time_us)
        self.time_us = time_us

    def turn(self, conversions: int, counts: ArrayLike = (1, -2, 3)) -> tuple[int, int]:
        """So many conversions of the same counts, or of rows of counts. Returns the first one's time and the next's."""
        start_us = self.time_us + PERIOD_US
        for row in np.broadcast_to(np.asarray(counts, dtype=int), (conversions, 3)).tolist():
            self.time_us += PERIOD_US
            convert(self.board, self.time_us, row)
        return start_us, self.time_us + PERIOD_US

    def keep(self, duration_s: float = 1.0) -> None:
        (answer,) = self.ask("keep", sensors=1, duration_s=duration_s)
        assert answer.name == "ack"

    def ask(self, name: str, **values: Any) -> list[Frame]:
        """A request; what it is answered, samples aside."""
        return [frame for frame in self.board.ask(name, **values) if frame.name not in ("samples", "rates")]

    def observe(self, index: int, start_us: int, end_us: int, speed_rad_s: float = SPEED_RAD_S) -> dict[str, Any]:
        (answer,) = self.ask(
            "observe", sensor=0, index=index, start_us=start_us, end_us=end_us, speed_rad_s=speed_rad_s
        )
        assert answer.name == "observed", error_of([answer])
        return answer.values

    def recall(self, index: int, mean_rad_s: Array, speed_rad_s: float = SPEED_RAD_S) -> list[Frame]:
        return self.ask("recall", sensor=0, index=index, mean_rad_s=tuple(mean_rad_s), speed_rad_s=speed_rad_s)

    def solve(self, method: int = 0) -> dict[str, Any]:
        (answer,) = self.ask("solve", sensor=0, method=method)
        assert answer.name == "solution"
        return answer.values


def means_of_a_sensor() -> Array:
    """What the sensor of SIX, table II, reads in six sweeps, rad/s."""
    means: Array = SPEED_RAD_S * DIRECTIONS / SCALE - BIAS_RAD_S
    return means


# Keeping and averaging


def test_an_observation_is_the_mean_of_exactly_the_samples_it_names() -> None:
    sweeps = Sweeps()
    counts = np.random.default_rng(1).integers(-32768, 32768, (300, 3))
    sweeps.keep(1.3)
    begun_us, _ = sweeps.turn(300, counts)
    times_us = begun_us + PERIOD_US * np.arange(300)
    observed = sweeps.observe(0, int(times_us[20]) - 7, int(times_us[270]) + 7)
    used = (times_us >= observed["start_us"]) & (times_us < observed["end_us"])
    assert observed["samples"] == used.sum() == 250
    assert observed["start_us"] == times_us[20] and observed["end_us"] == times_us[270]
    assert observed["mean_rad_s"] == pytest.approx(counts[used].mean(axis=0) * RAD_S, rel=3e-7, abs=1e-7)


@pytest.mark.slow
@settings(max_examples=40)
@given(st.floats(0.5, 60.0), st.integers(0, 250), st.integers(1, 250), st.integers(0, PERIOD_US))
def test_whole_blocks_within_the_span_are_averaged_whatever_their_length(
    duration_s: float, first: int, length: int, phase_us: int
) -> None:
    sweeps = Sweeps()
    counts = np.random.default_rng(2).integers(-1000, 1000, (600, 3))
    sweeps.keep(duration_s)
    begun_us, _ = sweeps.turn(600, counts)
    times_us = begun_us + PERIOD_US * np.arange(600)
    start_us, end_us = int(times_us[first]) - phase_us, int(times_us[first + length]) + phase_us
    frames = sweeps.ask("observe", sensor=0, index=0, start_us=max(start_us, begun_us), end_us=end_us, speed_rad_s=1.0)
    block = 1 + int(duration_s * 238 * 1.1 / (1024 - 3 * len(GYROSCOPES)))
    if frames[0].name == "error":
        too_long = first + length + 1 > (int(duration_s * 238 * 1.1) // block + 3) * block - block
        assert error_of(frames) == "not_kept" and (length < 2 * block or too_long)
        return
    observed = frames[0].values
    assert start_us <= observed["start_us"] < observed["end_us"] <= end_us
    used = (times_us >= observed["start_us"]) & (times_us < observed["end_us"])
    assert observed["samples"] == used.sum()
    assert length - observed["samples"] <= 2 * (block - 1)
    assert observed["mean_rad_s"] == pytest.approx(counts[used].mean(axis=0) * RAD_S, rel=3e-7, abs=1e-9)


def test_what_was_not_kept_is_refused() -> None:
    sweeps = Sweeps()
    before = sweeps.turn(50)
    assert error_of(sweeps.ask("observe", sensor=0, index=0, start_us=1, end_us=9, speed_rad_s=1.0)) == "not_kept"
    sweeps.keep(0.5)
    start_us, end_us = sweeps.turn(100)
    unfit = [
        (before[0], end_us - PERIOD_US),  # begins before the keeping
        (start_us, end_us + 1),  # not over yet
        (start_us + 1, start_us + PERIOD_US - 1),  # no conversion in it
    ]
    for span in unfit:
        frames = sweeps.ask("observe", sensor=0, index=0, start_us=span[0], end_us=span[1], speed_rad_s=1.0)
        assert error_of(frames) == "not_kept"
    assert sweeps.observe(0, start_us, end_us - PERIOD_US)["samples"] == 99
    sweeps.turn(400)  # the room is full long before
    late = sweeps.time_us - 10 * PERIOD_US
    frames = sweeps.ask("observe", sensor=0, index=1, start_us=start_us, end_us=late, speed_rad_s=1.0)
    assert error_of(frames) == "not_kept"
    sweeps.keep(0.5)
    frames = sweeps.ask("observe", sensor=0, index=1, start_us=start_us, end_us=end_us, speed_rad_s=1.0)
    assert error_of(frames) == "not_kept"


def test_what_was_kept_of_another_setting_and_while_the_part_settles_is_not_used() -> None:
    sweeps = Sweeps()
    sweeps.keep()
    span = sweeps.turn(100)
    sweeps.ask("stop")
    configure(sweeps.board, 0, 238, 500)
    frames = sweeps.ask("observe", sensor=0, index=0, start_us=span[0], end_us=span[1] - PERIOD_US, speed_rad_s=1.0)
    assert error_of(frames) == "not_kept"
    sweeps.keep()
    sweeps.ask("start", sensors=0)
    settle(sweeps.board, sweeps.time_us)
    start_us, end_us = sweeps.turn(50)
    frames = sweeps.ask("observe", sensor=0, index=0, start_us=start_us - 1, end_us=end_us - PERIOD_US, speed_rad_s=1.0)
    assert error_of(frames) == "not_kept"
    assert sweeps.observe(0, start_us, end_us - PERIOD_US)["samples"] == 49


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize("duration_s", [0.5, 3.0, 30.0])
def test_three_sensors_share_the_room_and_each_has_its_duration(duration_s: float) -> None:
    board = HostBoard()
    setups = [configure(board, sensor, rate_hz, 245) for sensor, rate_hz in enumerate((238, 200, 400))]
    (ack,) = board.ask("start", sensors=0)
    assert ack.name == "ack"
    for sensor in range(3):
        for _ in range(40):  # the parts settle
            convert(board, 0, (0, 0, 0), late_us=0, sensor=sensor)
    board.frames()
    (ack,) = board.ask("keep", sensors=7, duration_s=duration_s)
    assert ack.name == "ack"
    counts = np.array([[1, 0, 0], [2, -1, 100], [3, -2, 200]])
    conversions = [
        (round((0.1 + k / setup["rate_hz"]) * 1e6), sensor)
        for sensor, setup in enumerate(setups)
        for k in range(int(1.05 * duration_s * setup["rate_hz"]))
    ]
    for time_us, sensor in sorted(conversions):
        convert(board, time_us, counts[sensor].tolist(), late_us=5, sensor=sensor)
    board.frames()
    for sensor, setup in enumerate(setups):
        span = {"start_us": 150_000, "end_us": 100_000 + int(duration_s * 1e6)}
        frames = board.ask("observe", sensor=sensor, index=0, **span, speed_rad_s=1.0)
        (observed,) = [frame for frame in frames if frame.name == "observed"]
        assert observed.values["samples"] > 0.85 * (duration_s - 0.05) * setup["rate_hz"]
        expected = counts[sensor] * setup["sensitivity_rad_s"]
        assert observed.values["mean_rad_s"] == pytest.approx(expected, rel=1e-6)


def test_keep_refuses_what_it_cannot() -> None:
    board = HostBoard()
    assert error_of(board.ask("keep", sensors=1, duration_s=1.0)) == "not_configured"
    assert error_of(board.ask("keep", sensors=1 << len(BOARD_PARTS), duration_s=1.0)) == "no_such_sensor"
    configure(board, 0, 238, 245)
    for duration_s in (0.0, -1.0, float("nan"), float("inf"), 1e6):
        assert error_of(board.ask("keep", sensors=1, duration_s=duration_s)) == "bad_observation"


def test_board_time_beyond_32_bits_is_kept_too() -> None:
    sweeps = Sweeps((2 << 32) - 40 * PERIOD_US)
    sweeps.keep()
    start_us, end_us = sweeps.turn(100, (5, 6, 7))
    observed = sweeps.observe(0, start_us, end_us - PERIOD_US)
    assert start_us < 2 << 32 < end_us and (observed["start_us"], observed["samples"]) == (start_us, 99)


# Observations in their order


def test_the_first_index_begins_anew_the_next_adds_and_others_are_refused() -> None:
    sweeps = Sweeps()
    means = means_of_a_sensor()
    assert error_of(sweeps.recall(1, means[0])) == "bad_observation"
    for index in range(4):
        (observed,) = sweeps.recall(index, means[index])
        assert (observed.values["index"], observed.values["samples"]) == (index, 0)
        assert observed.values["mean_rad_s"] == pytest.approx(means[index], rel=1e-6)
    for wrong in (2, 5, 65535):
        assert error_of(sweeps.recall(wrong, means[0])) == "bad_observation"
    assert sweeps.solve()["observations"] == 4
    sweeps.recall(0, means[0])
    assert sweeps.solve()["observations"] == 1


def test_a_request_that_comes_twice_is_answered_twice_and_counted_once() -> None:
    sweeps = Sweeps()
    sweeps.keep()
    start_us, end_us = sweeps.turn(60, (100, 200, 300))
    first = sweeps.observe(0, start_us, end_us - PERIOD_US)
    sweeps.keep()  # what the first answer came from is gone
    assert sweeps.observe(0, start_us, end_us - PERIOD_US) == first
    assert sweeps.recall(1, means_of_a_sensor()[0])[0].name == "observed"
    assert sweeps.recall(1, means_of_a_sensor()[0])[0].name == "observed"
    assert sweeps.solve()["observations"] == 2
    assert error_of(sweeps.recall(1, means_of_a_sensor()[1])) == "bad_observation"


@pytest.mark.parametrize("speed_rad_s", [0.0, -1.0, float("nan"), float("inf")])
def test_a_speed_that_cannot_be_right_is_refused_and_changes_nothing(speed_rad_s: float) -> None:
    sweeps = Sweeps()
    sweeps.recall(0, means_of_a_sensor()[0])
    sweeps.keep()
    start_us, end_us = sweeps.turn(60)
    frames = sweeps.ask(
        "observe", sensor=0, index=0, start_us=start_us, end_us=end_us - PERIOD_US, speed_rad_s=speed_rad_s
    )
    assert error_of(frames) == "bad_observation"
    assert error_of(sweeps.recall(0, means_of_a_sensor()[0], speed_rad_s)) == "bad_observation"
    assert error_of(sweeps.recall(0, np.array([0.0, np.nan, 0.0]))) == "bad_observation"
    assert sweeps.solve()["observations"] == 1


def test_an_empty_span_is_a_bad_observation_and_an_unknown_sensor_is_named() -> None:
    sweeps = Sweeps()
    request: dict[str, Any] = {"index": 0, "start_us": 9, "end_us": 9, "speed_rad_s": 1.0}
    assert error_of(sweeps.ask("observe", sensor=0, **request)) == "bad_observation"
    assert error_of(sweeps.ask("observe", sensor=1, **request)) == "not_configured"
    assert error_of(sweeps.ask("observe", sensor=len(BOARD_PARTS), **request)) == "no_such_sensor"
    assert error_of(sweeps.ask("solve", sensor=len(BOARD_PARTS), method=0)) == "no_such_sensor"


def test_setting_a_sensor_up_forgets_what_was_observed_with_another_setting() -> None:
    board = HostBoard()
    configure(board, 0, 238, 245)
    board.ask("recall", sensor=0, index=0, mean_rad_s=(1.0, 0.0, 0.0), speed_rad_s=1.0)
    configure(board, 0, 238, 500)
    (solution,) = board.ask("solve", sensor=0, method=0)
    assert solution.values["observations"] == 0


# Solving


@pytest.mark.parametrize("method", [0, 1])
def test_the_board_calibrates_itself_from_six_sweeps_as_the_host_would(method: int) -> None:
    sweeps = Sweeps()
    accumulated = Accumulator.empty()
    for index, mean in enumerate(means_of_a_sensor()):
        counts = np.random.default_rng(index).normal(mean / RAD_S, 200.0, (240, 3)).round()
        sweeps.keep(1.2)
        start_us, end_us = sweeps.turn(240, counts)
        sweeps.turn(3)
        observed = sweeps.observe(index, start_us, end_us)
        exact = counts[: observed["samples"]].mean(axis=0) * RAD_S
        accumulated = accumulated.add(exact, np.ones(3), SPEED_RAD_S, weight=1.0)
    solution, expected = sweeps.solve(method), accumulated.solve("algorithm_1" if method else "newton")
    assert (solution["status"], solution["observations"], solution["method"]) == (0, 6, method)
    assert solution["scale"] == pytest.approx(expected.scale, rel=1e-4)
    assert solution["bias_rad_s"] == pytest.approx(expected.bias_rad_s, abs=1e-5)
    assert solution["scale"] == pytest.approx(SCALE, rel=0.02)
    assert solution["iterations"] >= 1


def test_too_few_observations_are_no_solution() -> None:
    sweeps = Sweeps()
    for index, mean in enumerate(means_of_a_sensor()[:5]):
        sweeps.recall(index, mean)
    solution = sweeps.solve()
    assert (solution["status"], solution["scale"], solution["bias_rad_s"]) == (1, (0, 0, 0), (0, 0, 0))

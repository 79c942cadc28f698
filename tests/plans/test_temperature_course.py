"""The way through a range of temperatures, with a simulated board on it: every gap is seen, nothing is too fast."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from rig.config.world.thermal import SimulatedThermalSection
from rig.data.recording.thermal_events import SetMeasured
from rig.plans.motions.temperature_course import Ramp, TemperatureCourse
from rig.world.board.heat import HeatedBody

LOOK_S = 0.25


def measured(temperature_c: float, *, warming: bool = True, **others: float) -> SetMeasured:
    return SetMeasured(0, 6, warming, {"gyro": temperature_c, **others})


def course(*temperatures_c: float, both_directions: bool = False) -> TemperatureCourse:
    found = TemperatureCourse(20, 40, 5, both_directions)
    found.begin(20.0)
    for temperature_c in temperatures_c:
        found.add_set(measured(temperature_c))
    return found


@pytest.mark.parametrize(
    ("temperatures_c", "missing"),
    [
        ((), "no set of sweeps was made"),
        ((21, 25, 30, 35, 39), None),
        ((21, 25, 31, 35, 39), "gyro was never between 25.0 and 31.0 °C"),
        ((22, 25, 30, 35, 39), "gyro was never between 20.0 and 22.0 °C"),
        ((21, 25, 30, 35, 38), "gyro was never between 38.0 and 40.0 °C"),
        ((10, 19, 24, 29, 34, 39, 50), None),
    ],
)
def test_a_range_is_covered_when_no_gap_of_it_is_wider_than_allowed(
    temperatures_c: tuple[float, ...], missing: str | None
) -> None:
    assert course(*temperatures_c).missing() == missing


def test_every_sensor_has_to_have_seen_the_range() -> None:
    found = TemperatureCourse(20, 30, 5, both_directions=False)
    for gyro_c, other_c in ((20, 20), (25, 23), (30, 26)):
        found.add_set(measured(gyro_c, other=other_c))
    assert found.missing() == "other was never between 26.0 and 30.0 °C"


def test_both_ways_are_covered_each_by_its_own_sets() -> None:
    found = course(20, 25, 30, 35, 40, both_directions=True)
    assert found.missing() == "no set of sweeps was made while cooling"
    assert found.warming is False, "at the end it turns round"
    for temperature_c in (36, 31, 25):
        found.add_set(measured(temperature_c, warming=False))
    assert found.missing() == "gyro was never between 20.0 and 25.0 °C while cooling"
    found.add_set(measured(21, warming=False))
    assert found.missing() == "gyro was never between 25.0 and 31.0 °C while cooling"
    found.add_set(measured(28, warming=False))
    assert found.missing() is None, "the set at 40 °C, after which it turned round, belongs to both ways"


def test_the_next_set_is_due_half_a_gap_on_for_the_slowest_sensor() -> None:
    found = TemperatureCourse(20, 40, 5, both_directions=False)
    found.begin(20.0)
    assert found.is_due({"gyro": 20.0, "other": 20.0})
    found.add_set(measured(22.0, other=21.0))
    assert not found.is_due({"gyro": 26.0, "other": 23.0})
    assert found.is_due({"gyro": 26.0, "other": 23.6})


def test_an_interrupted_way_is_gone_on() -> None:
    found = TemperatureCourse(20, 40, 5, both_directions=True, sets=[measured(39.5)])
    found.begin(22.0)  # it has cooled meanwhile
    assert found.warming is False
    found = TemperatureCourse(20, 40, 5, both_directions=True, sets=[measured(34.5)])
    found.begin(22.0)
    assert found.warming is True


@dataclass
class Bench:
    """A simulated board, its thermometer, and a course with a heater that follows a ramp."""

    section: SimulatedThermalSection
    course: TemperatureCourse
    ramp: Ramp
    set_s: float
    time_s: float = 0.0
    seen_c: list[float] = field(default_factory=list)
    powers: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.body = HeatedBody(self.section)
        self.part = self.body.part("gyro")
        self.course.begin(self.section.start_c)

    def live(self, duration_s: float) -> float:
        """So long; the mean of the thermometer."""
        first = len(self.seen_c)
        for _ in range(round(duration_s / LOOK_S)):
            self.time_s += LOOK_S
            now_c = self.part.thermometer_c(self.time_s)
            goal_c = self.course.to_c + 1 if self.course.warming else self.course.from_c - 1
            self.powers.append(self.ramp.power(self.time_s, now_c, goal_c))
            self.body.advance(self.time_s, self.powers[-1], powered=True)
            self.seen_c.append(now_c)
        return float(np.mean(self.seen_c[first:]))

    def carry_out(self, at_most_sets: int) -> None:
        while self.course.missing() is not None:
            assert len(self.course.sets) < at_most_sets, self.course.missing()
            began_s = self.time_s
            while not self.course.is_due({"gyro": self.part.thermometer_c(self.time_s)}):
                self.live(LOOK_S)
                assert self.time_s - began_s < 1200, "patience"
            warming = bool(self.course.warming)
            self.course.add_set(measured(self.live(self.set_s), warming=warming))


@pytest.mark.slow
@pytest.mark.parametrize("heater_w", [4.0, 10.0])
@pytest.mark.parametrize(("capacity_j_k", "loss_w_k"), [(6.0, 0.1), (20.0, 0.1), (60.0, 0.12)])
def test_a_heater_covers_the_range_both_ways_at_an_even_rate(
    capacity_j_k: float, loss_w_k: float, heater_w: float
) -> None:
    most_k_per_min, set_s = 4.0, 45.0
    section = SimulatedThermalSection(
        capacity_j_k=capacity_j_k, loss_w_k=loss_w_k, heater_w=heater_w, own_w=0.1, start_c=23, thermometer_lag_s=2
    )
    bench = Bench(section, TemperatureCourse(26, 50, 5, True), Ramp(0.6 * most_k_per_min / 60, 1.0), set_s)
    bench.carry_out(at_most_sets=40)
    seen = np.array(bench.seen_c)
    span = round(30 / LOOK_S)
    fastest_k_per_min = np.max(np.abs(seen[span:] - seen[:-span])) / 0.5
    assert fastest_k_per_min < most_k_per_min
    assert seen.max() < 50 + 3
    assert 0 < max(bench.powers) <= 1


def test_a_heater_that_is_too_weak_has_all_its_power_and_reaches_what_it_can() -> None:
    section = SimulatedThermalSection(heater_w=0.5, loss_w_k=0.1, own_w=0.0, capacity_j_k=5, start_c=22)
    bench = Bench(section, TemperatureCourse(22, 50, 5, False), Ramp(0.05, 0.8), 45)
    bench.live(1800)
    assert bench.powers[-1] == pytest.approx(0.8)
    assert bench.seen_c[-1] == pytest.approx(22 + 0.8 * 0.5 / 0.1, abs=0.1)


def test_the_boards_own_warm_up_is_a_way_too() -> None:
    section = SimulatedThermalSection(own_w=0.9, loss_w_k=0.06, capacity_j_k=20, start_c=22)
    bench = Bench(section, TemperatureCourse(24, 34, 4, False), Ramp(0.0, 0.0), 45)
    bench.carry_out(at_most_sets=20)
    assert max(bench.powers) == 0.0


def test_the_elements_lag_behind_the_thermometer_and_remember_where_they_came_from() -> None:
    section = SimulatedThermalSection(heater_w=10, element_lag_s=20, gradient_k_w=0.1, own_w=0, hysteresis_k=2)
    body = HeatedBody(section)
    part = body.part("gyro")
    for k in range(1, 1201):
        body.advance(0.1 * k, 1.0, powered=True)
    warming_k = part.temperature_c(120.0) - part.thermometer_c(120.0)
    assert part.branch(120.0) == pytest.approx(1.0)
    assert warming_k < 0.1 * 10, "it lags, and the gradient warms it"
    for k in range(1201, 6001):
        body.advance(0.1 * k, 0.0, powered=True)
    assert part.branch(600.0) == pytest.approx(-1.0)
    assert part.temperature_c(600.0) > part.thermometer_c(600.0), "it lags while it cools"

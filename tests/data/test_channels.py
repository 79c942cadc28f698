"""A source says in the recording what its samples hold: a scalar is recorded, shown and exported like any other."""

import io
import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from rich.console import Console
from rich.live import Live

from rig.data.quantity import FIELD, PRESSURE, RATE
from rig.data.recording.channel import Channel, stamp_samples, triad_channel
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import RunRecorder, read_run
from rig.errors import Refused
from rig.motion.steps import Rest
from rig.observation.observed_run import observe_run
from rig.observation.statistics.mean import even_mean
from rig.page.about import About
from rig.page.page_state import PageState
from rig.report.exports.exported_recording import WithMotion
from rig.report.exports.formats import writer_of_readings
from rig.runner.acquisition import Acquisition
from rig.station.events import Progress, SamplesTaken
from rig.station.view import LiveView
from support.recordings.synthetic_run import UR, Setup, synthetic_run

PRESSURE_PA = 96_480.0
BAROMETER = RecordedSensor(
    "toy_barometer", "B1", 10.0, (Channel(PRESSURE.name, "pressure", "<f8", 1.0),), clock="barometer"
)
IN_COUNTS = replace(BAROMETER, channels=(Channel(PRESSURE.name, "pressure_counts", "<i4", 0.5, 80_000.0, 40_000),))


def test_readings_become_the_nearest_numbers_that_fit_and_nothing_else_is_written() -> None:
    sensor = replace(BAROMETER, channels=(triad_channel(FIELD, 0.5, 100, None), *BAROMETER.channels))
    samples = stamp_samples(sensor.sample_dtype, np.array([3, 5]), np.array([30, 50]), 7.0)
    sensor.channel(FIELD).fill(samples, np.array([[0.2, 0.3, -1.0], [1e12, -1e12, 0.0]]))
    assert samples["field_counts"].tolist() == [[0, 1, -2], [2**31 - 1, 1 - 2**31, 0]]
    sensor.channel(PRESSURE).fill(samples, np.array([PRESSURE_PA, 0.25]))
    assert samples["pressure"].tolist() == [PRESSURE_PA, 0.25], "what is no count is not rounded"
    assert samples[["sequence", "board_time_us", "host_time_s"]].tolist() == [(3, 30, 7.0), (5, 50, 7.0)]


def beside_a_gyroscope(barometer: RecordedSensor) -> RunData:
    """A recording with a barometer that has a clock of its own, whose samples came when the arm's states did."""
    run = synthetic_run(Setup())
    samples = np.zeros(len(run.states) // 12, barometer.sample_dtype)
    samples["sequence"] = np.arange(len(samples))
    samples["host_time_s"] = run.states["host_time_s"][::12][: len(samples)]
    samples["board_time_us"] = np.round((samples["host_time_s"] - samples["host_time_s"][0] + 7.0) * 1e6)
    channel = barometer.channel(PRESSURE)
    samples[channel.column] = (PRESSURE_PA - channel.offset) / channel.unit_per_count
    return replace(
        run,
        sensors={**run.sensors, "barometer": barometer},
        samples={**run.samples, "barometer": samples},
    )


def recorded(run: RunData, path: Path) -> Path:
    with RunRecorder(
        path, config=run.config, settings=run.settings, provenance=run.provenance, turner=UR, sensors=run.sensors
    ) as recorder:
        for name, samples in run.samples.items():
            recorder.add_samples(name, samples)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("barometer", [BAROMETER, IN_COUNTS], ids=["in pascals", "in counts"])
def test_a_scalar_comes_back_as_it_was_recorded_and_is_no_gyroscope(barometer: RecordedSensor, tmp_path: Path) -> None:
    run = beside_a_gyroscope(barometer)
    found = read_run(recorded(run, tmp_path / "run.h5"))
    assert found.sensors == run.sensors and list(found.measuring(RATE)) == ["gyro"]
    np.testing.assert_array_equal(found.samples["barometer"], run.samples["barometer"])
    assert barometer.channel(PRESSURE).values(found.samples["barometer"]) == pytest.approx(PRESSURE_PA)


@pytest.mark.slow
def test_a_scalar_is_exported_in_its_unit_on_the_arms_clock(tmp_path: Path) -> None:
    run = beside_a_gyroscope(IN_COUNTS)
    writer_of_readings("csv")([WithMotion(observe_run(run, run.settings.observation))], tmp_path)
    header = (tmp_path / "barometer.csv").read_text(encoding="utf-8").splitlines()[0]
    time_s, pressure_pa = np.loadtxt(tmp_path / "barometer.csv", delimiter=",", skiprows=1).T
    assert header == "time_s,pressure_pa" and pressure_pa == pytest.approx(PRESSURE_PA)
    assert time_s == pytest.approx(run.states["time_s"][::12][: len(time_s)], abs=1e-3)
    assert not (tmp_path / "barometer_sweeps.csv").exists()


def test_a_scalar_is_shown_while_it_comes_on_the_terminal_and_on_the_page() -> None:
    run, acquisition = beside_a_gyroscope(BAROMETER), Acquisition()
    acquisition.expect("barometer", BAROMETER)
    acquisition.on_samples("barometer", run.samples["barometer"])
    (seen,) = acquisition.samples()
    console = Console(width=100, file=io.StringIO(), record=True)
    with Live(console=console, auto_refresh=False) as live:
        view = LiveView(live)
        view.event(SamplesTaken((seen,)))
        view.event(Progress(1, 4, Rest("rest", 3.0), 0.5, 1.5, 1.5, 0.0))
    assert f"+964.80 hPa, {seen.samples} samples, 0 lost" in console.export_text()
    page = PageState(About("run", "six_observation"))
    page.take(SamplesTaken((seen,)))
    assert page.sections["sensors"][0]["units"] == {"pressure_pa": ["pressure", "hPa"]}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"quantity": "phlogiston"}, "phlogiston"),
        ({"type": "O"}, "type"),
        ({"column": "host_time_s"}, "host_time_s"),
        ({"type": "<i4"}, "samples/barometer holds"),
        ({"unit_per_count": 0.0}, "unit_per_count"),
    ],
)
def test_a_channel_that_cannot_be_is_refused(change: dict[str, object], complaint: str, tmp_path: Path) -> None:
    path = recorded(beside_a_gyroscope(BAROMETER), tmp_path / "run.h5")
    with h5py.File(path, "r+") as file:
        attributes = file["samples/barometer"].attrs
        (channel,) = json.loads(attributes["channels"])
        attributes["channels"] = json.dumps([channel | change])
    with pytest.raises(Refused, match=complaint):
        read_run(path)


@pytest.mark.slow
def test_numbers_cut_toward_zero_are_twice_as_coarse_about_zero_alone() -> None:
    """And a mean of them is as uncertain as it errs, whatever an autopilot's offset has been added since."""
    milli, offset, rng = 1e-3, 0.03, np.random.default_rng(29)
    channel = Channel("rate", "counts", "<i4", 1e-8, step=2 * milli)
    trues = rng.uniform(-6, 6, (300, 3))
    in_std = []
    cut = np.trunc(trues[:, None] + 0.6 * rng.standard_normal((300, 300, 3)))
    everything = milli * (cut + 0.5 * np.sign(cut)) + offset
    steps = channel.steps(everything.reshape(-1, 3))
    for true, whole, readings in zip(trues, cut, everything, strict=True):
        wide = np.where((whole == 0).any(axis=0), 2 * milli, milli)
        assert steps.widths(readings) == pytest.approx(wide)
        found = even_mean(readings, steps)
        in_std.append((found.mean - offset - milli * true) / np.sqrt(found.variance))
    assert 0.7 < np.sqrt(np.mean(np.square(in_std))) < 1.3
    same = np.full((9, 3), offset)
    assert np.all(channel.steps(same).widths(same) == 2 * milli), "all the same tells nothing"


@pytest.mark.parametrize("step", [None, 0.01])
@pytest.mark.parametrize("trusts_counts", [False, True])
def test_a_sensor_of_two_axes_is_averaged_as_one_of_three(step: float | None, *, trusts_counts: bool) -> None:
    """As an inclinometer of somebody's own package has them."""
    readings = np.round(np.random.default_rng(1).normal(0.3, 0.02, (200, 2)), 2)
    channel = replace(triad_channel(FIELD, 0.01, 100, None), step=step)
    mean = even_mean(readings, channel.steps(readings, trusts_counts=trusts_counts))
    assert mean.mean == pytest.approx(readings.mean(axis=0), abs=0.01)
    assert mean.variance == pytest.approx(np.full(2, 2e-6), rel=0.5)

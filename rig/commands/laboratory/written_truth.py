"""The truth of a simulated laboratory, written by the laboratory into the run folder after the verdict."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.commands.laboratory.laboratory_process import send_request
from rig.data.run_folder import TRUTH_FILE
from rig.station.events import DocumentWritten
from rig.turners.turner_registry import kind_of

if TYPE_CHECKING:
    from rig.analysis.outcome import Outcome
    from rig.config.load import Loaded


def write_truth(
    control: str, written: Path, folder: Path, loaded: "Loaded", outcome: "Outcome"
) -> Iterator[DocumentWritten]:
    """Have the laboratory at `control` write the truth over the windows of a run; yield the event of its file.

    The laboratory writes to `written`, the path that it got at its start; then the file is moved to the run's `folder`.
    Nothing is written for a calibration over temperature, because its values belong to the reference temperature, not
    to the temperatures of the run.
    """
    if outcome.polynomials or not (outcome.results or outcome.accelerometers):
        return
    windows = _windows(outcome, follows_arm=kind_of(loaded.config.turner).name == "ur")
    with suppress(OSError, ValueError):  # the laboratory is gone: the run needs no truth
        if send_request(control, {"do": "write_truth", "windows": windows}).get("ok"):
            yield DocumentWritten(written.replace(folder / TRUTH_FILE))


def _windows(outcome: "Outcome", *, follows_arm: bool) -> dict[str, Any]:
    """Return the windows of all calibrated sensors in the form of `rig.world.board.windowed_truth`.

    Only an arm's controller shares the simulated laboratory's clock; otherwise the whole time is one window.
    """
    recordings = outcome.recordings if follows_arm else ()
    gyroscopes = {}
    accelerometers = {}
    for name, result in outcome.results.items():
        if name not in outcome.settings.to_calibrate:
            continue
        sensors = [recording.sensors[name] for recording in recordings]
        sweeps_s = [(turn.average.start_s, turn.average.end_s) for sensor in sensors for turn in sensor.revolutions]
        rests_s = [(rest.start_s, rest.end_s) for sensor in sensors for rest in sensor.rests]
        speeds = (
            list[float]()
            if outcome.settings.by_hand is not None
            else [turn.speed_rad_s for turn in result.observations]
        )
        gyroscopes[name] = {
            "sweeps_s": sweeps_s,
            "averages_s": sweeps_s + rests_s,
            "speeds_rad_s": [float(speed) for speed in speeds],
        }
    for name in outcome.accelerometers:
        sensors = [recording.sensors[name] for recording in recordings if name in recording.sensors]
        dwells_s = [(dwell.window.start_s, dwell.window.end_s) for sensor in sensors for dwell in sensor.dwells]
        sweeps_s = [
            (turn.average.start_s, turn.average.end_s)
            for sensor in sensors
            for turn in sensor.revolutions
            if turn.acceleration is not None
        ]
        accelerometers[name] = {"readings_s": dwells_s + sweeps_s}
    return {"gyroscopes": gyroscopes, "accelerometers": accelerometers}

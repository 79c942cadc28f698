"""The lines for events, at a terminal and in the log."""

import shlex
from collections.abc import Sequence
from traceback import format_exception

from firmware_host.installation import install_command
from rig.data.recording.thermal_events import SetMeasured, TemperatureWanted
from rig.motion.plan_warnings import doubts
from rig.station.by_hand_words import hand_event_line
from rig.station.events import (
    Advice,
    ArmConnected,
    BoardConnected,
    CalibrationStored,
    Crashed,
    Failed,
    Interrupted,
    ListenerDropped,
    NotPlotted,
    NotRemembered,
    PhaseRecorded,
    PhaseSkipped,
    Plotted,
    PreflightPassed,
    Prompt,
    Remembered,
    RunEvent,
    RunFolderWritten,
    RunResumed,
    SamplingStarted,
    SensorConnected,
    StepFinished,
    UncertaintySoFar,
)


def line(event: RunEvent) -> str | None:
    """Return an event in one line; None for frequent events of devices and for those printed elsewhere."""
    text: str | None
    match event:
        case Prompt(mounts=int(), announcement=(stage, *_)):
            text = f"to be mounted: {stage}"
        case RunResumed(planned=0):
            text = "resuming: the rests and moves so far count"
        case RunResumed(done, planned):
            text = f"resuming: {done} of {planned} sweeps and dwells are recorded and valid"
        case BoardConnected(port, identity):
            text = f"board: {identity.unique_id}, firmware {identity.firmware} at {port}"
        case SensorConnected(sensor, part, serial_number, port, corrected):
            text = f"{sensor}: {part} {serial_number} at {port}" + "".join(
                f"; {name} was {before}, corrected" for name, before in corrected.items()
            )
        case ArmConnected(report, called):
            text = f"{called}: {report.words} at {report.host}"
        case PreflightPassed(plan) if not plan.motions:
            text = "pre-flight: nothing moves by itself; the clock of each sensor is known"
        case PreflightPassed(plan, report, called):
            text = (
                f"pre-flight: {called} {report.serial_number} at {report.host} is ready; "
                f"{len(plan.motions)} motions within limits, {plan.duration_s:.0f} s"
            ) + "".join(f"; {doubt}" for doubt in doubts(plan))
        case SamplingStarted():
            text = "sampling: every sensor sends readings"
        case StepFinished(_, _, step, took_s):
            text = f"done: {step.name}, {took_s:.2f} s"
        case PhaseRecorded(sensors, missed_states):
            samples, lost = (sum(counts) for counts in zip(*((s.samples, s.lost) for s in sensors), strict=True))
            text = f"recorded: {samples} samples, {lost} lost"
            text += f"; {missed_states} arm states missed" if missed_states else ""
        case _:
            text = hand_event_line(event) or _temperature_line(event) or _outcome_line(event)
    return text


def _temperature_line(event: RunEvent) -> str | None:
    """Return an event of a calibration over temperature in words, else None."""
    match event:
        case TemperatureWanted(warming, now_c, next_c, heated):
            until = f"until it is at {next_c:.1f} °C; it is at {now_c:.1f} °C"
            if heated:
                return f"the heater {'warms the board' if warming else 'lets the board cool'} {until}"
            return f"your turn: {'warm' if warming else 'cool'} the board {until}"
        case SetMeasured(temperatures_c=temperatures):
            return "set measured: " + ", ".join(f"{name} at {value:.1f} °C" for name, value in temperatures.items())
        case _:
            return None


def _outcome_line(event: RunEvent) -> str | None:
    """Return an event after the last motion in words, else None."""
    text: str | None
    match event:
        case CalibrationStored(sensor, part, serial_number, record):
            text = f"stored on the board: {sensor}, {part} {serial_number}, record {record}"
        case UncertaintySoFar(scale_u, bias_u_rad_s, repeats_left, as_wanted):
            text = f"U = {scale_u:.3g} of the scale factors, {bias_u_rad_s:.3g} rad/s of the biases, "
            text += "target reached" if as_wanted else "above the target"
            text += f": {repeats_left} more {'repeat' if repeats_left == 1 else 'repeats'} "
            text += f"{'is' if repeats_left == 1 else 'are'} skipped" if as_wanted else "at most"
        case PhaseSkipped():
            text = "not verified: the calibration failed its limits, so the board keeps its old calibration"
        case Plotted(names):
            text = f"plotted: {', '.join(names)} (.png, .svg)"
        case NotPlotted():
            text = f"no plots: they need matplotlib. Install it: {install_command('study')}"
        case Remembered(history, numbers, usual=usual):
            text = _entry_words(history, numbers, usual=usual)
        case NotRemembered(folder, why):
            later = f"rig history import {shlex.quote(str(folder))}"
            text = f"not entered in the history; the run itself is not affected ({why}); later: {later}"
        case RunFolderWritten(folder):
            text = f"written: {folder}"
        case Advice(folder, command, repeats):
            to_do = "to repeat refused sweeps" if repeats else "after correcting the cause, continue with"
            text = f"the data are kept in {folder}; {to_do}: {command}"
        case ListenerDropped(listener, error):
            text = f"{listener} was disconnected from this run: it failed ({error})"
        case _:
            text = None
    return text


def calibrations_in_words(numbers: Sequence[int]) -> str:
    """Return calibrations of a history in words: "calibration 8", "calibrations 8 to 10", "calibrations 8, 11"."""
    match list(numbers):
        case []:
            return "a run without calibrations"
        case [number]:
            return f"calibration {number}"
        case [first, *_, last] if last - first == len(numbers) - 1:
            return f"calibrations {first} to {last}"
        case several:
            return f"calibrations {', '.join(map(str, several))}"


def _entry_words(history: str, numbers: Sequence[int], *, usual: bool) -> str:
    option = "" if usual else f" --history {shlex.quote(history)}"
    shown = f" (rig history show {numbers[0]}{option})" if numbers else ""
    return f"entered in {history} as {calibrations_in_words(numbers)}{shown}"


def reason(event: RunEvent) -> str | None:
    """Return, for the log, the reason of an event that ends a run early, else None; a terminal shows it at the end."""
    match event:
        case Failed(error) if error.name == "script_failed" and error.__cause__ is not None:
            return f"{error}\n{''.join(format_exception(error.__cause__)).rstrip()}"
        case Failed(error):
            return str(error)
        case Interrupted(text) | Crashed(text):
            return text
        case _:
            return None

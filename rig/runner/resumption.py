"""The finished part of an interrupted run, and the check that its continuation belongs to the same run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rig.analysis.consistency.contradictions import contradicting_sweeps
from rig.data.recording.provenance import Provenance
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import RunSettings
from rig.errors import Refused
from rig.observation.onboard_window import find_averaged_sweeps
from rig.observation.sound_steps import sound_dwells, sound_sweeps
from rig.plans.script_file import ScriptFile

REMEDY = "Undo the change in config.yaml, or start a new run with `rig run`"
JUDGED_BY = {  # settings by which a recording is solved and judged, with the key of the configuration
    "limits": "limits",
    "observation": "observation",
    "uncertainty": "uncertainty",
    "site": "site",
    "to_calibrate": "sensors.….role",
    "reference": "sensors.….turntable",
    "matrix_corrected": "sensors.….correction",
    "second_order": "procedure.second_order",
    "finds_earth_rate": "procedure.earth_rate",
    "reference_c": "procedure.reference_c",
    "extension_m": "arm.extension_mm",
}


@dataclass(frozen=True, slots=True)
class Resumption:
    """The recordings so far, oldest first, and the indices of their valid sweeps and dwells; empty in a new run."""

    earlier: Sequence[RunData] = ()
    done: frozenset[int] = frozenset()

    def refuse_other_instruments(self, provenance: Provenance, sensors: Mapping[str, RecordedSensor]) -> None:
        """Raise Refused `another_board`, `another_arm`, `another_sensor` if the devices differ.

        Readings of different devices or settings do not belong in one calibration.
        """
        for run in self.earlier:
            begun = run.provenance
            for what, before, now in (
                ("board", begun.board_unique_id, provenance.board_unique_id),
                ("arm", begun.arm_serial_number, provenance.arm_serial_number),
            ):
                if before != now:
                    raise Refused(
                        "another_board" if what == "board" else "another_arm",
                        f"the run was begun with the {what} {before}, but this is {now}",
                        f"Connect the {what} that the run began with, or start a new run with `rig run`",
                    )
            if run.sensors != sensors:
                raise Refused(
                    "another_sensor",
                    "the sensors are not those of the recording, or have other settings",
                    REMEDY,
                )


def resumption(earlier: Sequence[RunData], settings: RunSettings, script: ScriptFile) -> Resumption:
    """Return the valid steps of an interrupted run: dwells, and sweeps that a board, if there is one, has averaged too.

    A sweep that contradicts the others is not valid. Steps are identified by index, so script and movement must be the
    same. Settings that judge the recordings must be the same too, because those of the first recording hold for all.
    Raise Refused `another_script`, `another_procedure`, `another_setting`.
    """
    for run in earlier:
        if run.provenance.script_sha256 != script.sha256:
            raise Refused(
                "another_script",
                f"{script.name} in the run folder is not the script that the run began with",
                "Undo the change in it, or start a new run with `rig run`",
            )
        if run.settings.movement != settings.movement:
            raise Refused(
                "another_procedure",
                "config.yaml in the run folder describes another procedure or home pose than the recording there",
                REMEDY,
            )
        changed = [key for name, key in JUDGED_BY.items() if getattr(run.settings, name) != getattr(settings, name)]
        if changed:
            raise Refused(
                "another_setting",
                f"the configuration has other values than the recording: {', '.join(changed)}; a run is solved and "
                "judged by those with which it began",
                "Undo the change in the configuration, or start a new run with `rig run`; a finished run is judged "
                "otherwise by `rig solve --set`",
            )
    sound = (
        sound_sweeps(run, settings.observation) & find_averaged_sweeps(run, settings.to_calibrate) for run in earlier
    )
    dwelt = (sound_dwells(run, settings.observation) for run in earlier)
    return Resumption(earlier, frozenset[int]().union(*sound, *dwelt) - contradicting_sweeps(earlier))

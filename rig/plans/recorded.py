"""Which procedure a recording is of: what judges it again is what judged it when the run ended."""

from pathlib import Path

from rig.data.run_file import RunData
from rig.data.run_folder import SCRIPT
from rig.errors import Refused
from rig.plans.registry import AnyProcedure, Readings, installed
from rig.plans.script_file import load_script


def readings_of(run: RunData) -> Readings:
    """What the sensors to calibrate streamed."""
    return "calibrated" if any(sensor.mode == "calibrated" for sensor in run.sensors.values()) else "raw"


def procedure_of(run: RunData, folder: Path) -> AnyProcedure:
    """The procedure the recording names: an installed one, or the script kept in its `folder`.

    Raises Refused `another_script` when the script there is not the one it was recorded with, and as `load_script`.
    """
    name = run.settings.procedure
    procedures = installed()
    if name not in procedures:
        script = load_script(folder / SCRIPT)
        if run.provenance.get("script_sha256") != script.sha256:
            raise Refused(
                "another_script",
                f"{folder / SCRIPT} is not the script the recording was made with",
                "Undo the change in it",
            )
        procedures = {**procedures, name: script.procedure}
    found = procedures[name]
    # Recordings of before there were phases name the procedure that the run began with.
    return procedures[found.then] if found.then and found.readings != readings_of(run) else found

"""How the arm moved in a recording."""

from rig.data.run_file import RunData
from rig.observation.timebase import ArmMotion


def motion_of(run: RunData) -> ArmMotion:
    """Raises Fault as `ArmMotion` does."""
    return ArmMotion(run.arm, run.provenance.kinematics, as_before=not run.settings.smooths_rates)

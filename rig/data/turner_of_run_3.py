"""The turner of recordings of schemas "rig.run/1" to "rig.run/3", which do not describe it: an arm of six joints."""

from rig.data.provenance import Provenance
from rig.data.recorded_turner import RecordedTurner
from rig.motion.geometry import NOMINAL
from rig.motion.state import ARM_FIELDS, JOINT_NAMES

KIND = "ur"


def turner_of_provenance(provenance: Provenance) -> RecordedTurner:
    """The arm as the provenance tells it; its geometry is a UR10e's where it does not. Raises ValueError."""
    geometry = provenance.arm_kinematics or NOMINAL
    turner = RecordedTurner(KIND, provenance.arm_maker, provenance.arm_model, JOINT_NAMES, geometry, ARM_FIELDS)
    if geometry.joints != len(JOINT_NAMES):
        raise ValueError(f"its arm has {len(JOINT_NAMES)} joints and a geometry of {geometry.joints}")
    return turner

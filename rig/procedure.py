"""The interface for procedures: all that a script in procedures/, or a laboratory's own, may import.

    from rig.procedure import Plan, Procedure, Rest, Sweep, Transfer, Verbs, run_script

These names are public; the modules that define them may change. docs/how-to/with-code/own-procedure.md shows their use.
"""

from rig.cli import run_script  # first: it keeps linear algebra to one thread

# isort: split
from rig.analysis.analyses import (
    calibrate,
    calibrate_by_hand,
    estimate_bias_drift,
    verify_calibration,
    verify_stored_calibrations,
)
from rig.analysis.check import Check, fitness
from rig.analysis.outcome import Outcome
from rig.config.models import ArmSection, ProcedureSection, RigConfig, TurnerSection
from rig.config.procedures.hand_sections import ByHandSection, HandSection
from rig.config.procedures.procedure_sections import (
    AttitudesSection,
    BiasDriftSection,
    ImuSection,
    SixObservationSection,
    SixSweepsSection,
    StaticAttitudesSection,
    ThermalSection,
    VerifySection,
)
from rig.config.procedures.servo_procedure import ServoSixObservationSection
from rig.config.procedures.servo_section import ServoSection
from rig.data.recording.run_data import RunData
from rig.errors import Fault, Refused
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep, Transfer, trapezoid_duration, travel
from rig.motion.turner_state import Joints
from rig.plans.by_hand import plan_by_hand
from rig.plans.motions.servo_sweeps import plan_servo_six_observation
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.plans.motions.static_attitudes import plan_static_attitudes
from rig.plans.motions.sweeps_and_attitudes import plan_imu
from rig.plans.motions.thermal_sweeps import plan_thermal
from rig.plans.procedure_registry import Procedure
from rig.plans.verbs import Verbs

__all__ = [
    "ArmSection", "AttitudesSection", "BiasDriftSection", "ByHandSection", "Check", "Dwell", "Fault", "HandSection",
    "ImuSection", "Joints", "Outcome", "Plan", "Procedure", "ProcedureSection", "Refused", "Rest", "RigConfig",
    "RunData", "ServoSection", "ServoSixObservationSection", "SixObservationSection", "SixSweepsSection",
    "StaticAttitudesSection", "Step", "Sweep", "ThermalSection", "Transfer", "TurnerSection", "Verbs",
    "VerifySection", "calibrate", "calibrate_by_hand", "estimate_bias_drift", "fitness", "plan_by_hand", "plan_imu",
    "plan_servo_six_observation", "plan_six_observation", "plan_static_attitudes", "plan_thermal", "run_script",
    "trapezoid_duration", "travel", "verify_calibration", "verify_stored_calibrations",
]  # fmt: skip

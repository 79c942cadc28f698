"""A servo's reports of itself: one state per reply, and the report for pre-flight."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from operator import attrgetter

from rig.motion.chain import DenavitHartenberg
from rig.motion.state_rows import StateField, state_dtype
from rig.motion.turner_state import Row
from rig.turners.servo.servo_models import MAKER, PULSE_RAD, SPEED_RAD_S, ServoModel
from rig.turners.servo.servo_registers import STATE

SERVO_FIELDS = (
    StateField("took_s", "f8"),
    StateField("tick", "u2"),
    StateField("moving", "u1"),
    StateField("moving_status", "u1"),
    StateField("hardware_error", "u1"),
    StateField("load", "f8"),
    StateField("voltage_v", "f8"),
    StateField("temperature_c", "f8"),
)
SERVO_STATE_DTYPE = state_dtype(1, SERVO_FIELDS)
JOINTS = ("shaft",)
REST_PROOF_S, REST_PROOF_STATES = 0.15, 5  # duration and number of the states that show a shaft at rest
REST_RANGE_RAD = 6.5 * PULSE_RAD  # of its angles: a shaft at rest dithers by ±3 pulses (forum.robotis.com 7582)


@dataclass(frozen=True, slots=True)
class ServoState:
    """One reply of the servo. The field names are those of `SERVO_STATE_DTYPE`.

    - time_s: the reference time in the middle of the transaction.
    - host_time_s: `time.monotonic()` when the reply was read.
    - q_rad (1,): the shaft's angle by its encoder, revolutions included, ccw positive.
    - qd_rad_s (1,): the servo's own coarse rate, in steps of 1.4 °/s.
    - took_s: the duration of the transaction; the position was measured within it.
    - tick: the servo's clock, ms.
    - moving, moving_status, hardware_error: the registers of these names.
    - load: a current in A, or a fraction of full load (`ServoModel.load_unit`).
    - voltage_v, temperature_c: the registers of supply voltage and temperature.
    """

    time_s: float
    host_time_s: float
    q_rad: tuple[float, ...]
    qd_rad_s: tuple[float, ...]
    took_s: float
    tick: int
    moving: int
    moving_status: int
    hardware_error: int
    load: float
    voltage_v: float
    temperature_c: float

    def to_record(self) -> Row:
        """Return the values in the order of `SERVO_STATE_DTYPE`."""
        return _IN_ORDER(self)


_IN_ORDER: Callable[[ServoState], Row] = attrgetter(*(field.name for field in fields(ServoState)))


def decode(
    data: bytes, model: ServoModel, transaction_s: tuple[float, float], host_time_s: float, hardware_error: int
) -> ServoState:
    """Return the state in a reply's 27 bytes; `transaction_s` has the times before the request and after the reply."""
    began_s, ended_s = transaction_s
    tick, moving, status, _, load, velocity, position, _, _, voltage, temperature = STATE.unpack(data)
    return ServoState(
        time_s=(began_s + ended_s) / 2,
        host_time_s=host_time_s,
        q_rad=(position * PULSE_RAD,),
        qd_rad_s=(velocity * SPEED_RAD_S,),
        took_s=ended_s - began_s,
        tick=tick,
        moving=moving,
        moving_status=status,
        hardware_error=hardware_error,
        load=load * model.load_unit,
        voltage_v=voltage / 10,
        temperature_c=float(temperature),
    )


def stands(states: Sequence[ServoState]) -> bool:
    """Return whether the newest `REST_PROOF_STATES` of `states`, in order, show a shaft at rest."""
    if len(states) < REST_PROOF_STATES:
        return False
    newest = states[-1]
    lately = sum(newest.time_s - state.time_s <= REST_PROOF_S for state in states)
    recent = states[-max(lately, REST_PROOF_STATES) :]
    covered = newest.time_s - states[0].time_s >= REST_PROOF_S
    angles = [state.q_rad[0] for state in recent]
    return covered and not any(state.moving for state in recent) and max(angles) - min(angles) <= REST_RANGE_RAD


@dataclass(frozen=True, slots=True)
class ServoReport:
    """A `Report` of the servo's settings and state for pre-flight; `startup` is None if the servo has no such register.

    `round_trip_s` is the duration of reading a state.
    """

    port: str
    servo_id: int
    servo: ServoModel
    firmware: int
    drive_mode: int
    operating_mode: int
    secondary_id: int
    homing_offset: int
    temperature_limit_c: int
    voltage_limits_v: tuple[float, float]
    velocity_limit_rad_s: float
    startup: int | None
    shutdown: int
    torque_on: bool
    round_trip_s: float
    state: ServoState

    @property
    def host(self) -> str:
        """The servo's port."""
        return self.port

    @property
    def serial_number(self) -> str:
        """A substitute for the serial number, which these servos do not have."""
        return f"with ID {self.servo_id}"

    @property
    def software(self) -> str:
        """The version of the servo's firmware."""
        return f"firmware {self.firmware}"

    @property
    def model(self) -> str | None:
        """The model, in the maker's spelling."""
        return self.servo.title

    @property
    def kinematics(self) -> DenavitHartenberg | None:
        """The servo's geometry: None, because no servo reports its geometry."""
        return None

    @property
    def joints(self) -> tuple[str, ...]:
        """The name of the servo's only joint."""
        return JOINTS

    @property
    def words(self) -> str:
        """The servo described in a line of text."""
        return f"{MAKER} {self.servo.title}, ID {self.servo_id}, firmware {self.firmware}"

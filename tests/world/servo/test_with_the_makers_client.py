"""The simulated servo before the maker's own, unmodified client, and byte by byte against the maker's manual."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from rig.world.servo.control_tables import MODELS
from rig.world.servo.servo import SimulatedServo
from rig.world.servo.truth import LineTruth, ServoTruth
from rig.world.servo.wire_format import Receiver, ServoPacket, encode, encode_status
from support.processes.waiting import wait_for
from support.wires.servo_on_a_wire import PLAIN, ServoOnAWire, servo_on_a_wire

dynamixel_sdk = pytest.importorskip("dynamixel_sdk")
from dynamixel_easy_sdk.control_table import ControlTable  # noqa: E402

NO_REPLY, CORRUPT = -3001, -3002
OTHER_NAMES = {"Secondary(Shadow) ID": "Secondary ID", "Indirect Address Write": "Indirect Address 1"}
OTHER_NAMES |= {"Indirect Data Write": "Indirect Data 1", "Indirect Address Read": "Indirect Address 29"}
OTHER_NAMES |= {"Indirect Data Read": "Indirect Data 29"}
FAST = {"Baud Rate": 3, "Return Delay Time": 0}


@contextmanager
def client(
    *truths: ServoTruth, line: LineTruth = PLAIN, patience_ms: float = 200_000.0
) -> Iterator[tuple[Any, Any, ServoOnAWire]]:
    """Port and packet handler of the client, and what they talk to; `patience_ms` is for a reply."""
    with servo_on_a_wire(*truths, line=line, pty=True) as wire:
        dynamixel_sdk.port_handler.LATENCY_TIMER = patience_ms / 2  # no busy machine is a lost reply
        port = dynamixel_sdk.PortHandler(wire.port)
        assert port.openPort()
        try:
            yield port, dynamixel_sdk.PacketHandler(2.0), wire
        finally:
            port.closePort()


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_every_register_of_the_maker_s_own_table_is_there(model: str) -> None:
    table = ControlTable.getControlTable(MODELS[model].number)
    with client(ServoTruth(model, settings=FAST)) as (port, packets, _):
        assert packets.ping(port, 1) == (MODELS[model].number, 0, 0)
        own = SimulatedServo(ServoTruth(model), 0.0).memory
        for name, item in table.items():
            data, result, error = packets.readTxRx(port, 1, item.address, item.size)
            assert (result, error, len(data)) == (0, 0, item.size), name
            register = own._by_address[item.address]
            assert (register.size, register.name) == (item.size, OTHER_NAMES.get(name, name))


@pytest.mark.parametrize("model", MODELS)
def test_there_is_no_register_of_which_the_maker_s_table_knows_nothing(model: str) -> None:
    table = ControlTable.getControlTable(MODELS[model].number)
    known = {item.address for item in table.values()} | {60, 147}  # the manual has these two
    own = SimulatedServo(ServoTruth(model), 0.0).memory
    spare = {r.name for r in own._by_name.values() if r.address not in known and not r.name.startswith("Indirect")}
    assert spare == set()


@pytest.mark.slow
def test_a_negative_position_comes_as_two_s_complement_and_the_block_in_one_packet() -> None:
    with client(ServoTruth(settings=FAST | {"Homing Offset": -1000}, start_deg=1.0)) as (port, packets, _):
        position, *_ = packets.read4ByteTxRx(port, 1, 132)
        assert 2**32 - 1000 <= position < 2**32
        data, result, error = packets.readTxRx(port, 1, 120, 27)
        assert (len(data), result, error) == (27, 0, 0)


@pytest.mark.slow
def test_errors_have_the_manual_s_numbers() -> None:
    with client(ServoTruth(settings=FAST | {"Operating Mode": 4})) as (port, packets, _):
        assert packets.write1ByteTxRx(port, 1, 11, 2) == (0, 4), "no such mode: data range"
        assert packets.write2ByteTxRx(port, 1, 116, 5) == (0, 5), "half a goal: data length"
        assert packets.write2ByteTxRx(port, 1, 120, 5) == (0, 7), "read only: access"
        assert packets.readTxRx(port, 1, 14, 2)[1:] == (0, 7), "nothing there: access"
        assert packets.write4ByteTxRx(port, 1, 104, 900) == (0, 6), "beyond Velocity Limit: data limit"
        assert packets.write4ByteTxRx(port, 1, 116, 1_048_576) == (0, 4), "beyond 256 turns: data range"
        assert packets.write1ByteTxRx(port, 1, 64, 1) == (0, 0)
        assert packets.write1ByteTxRx(port, 1, 11, 4) == (0, 7), "EEPROM while torque is on: access"
        assert packets.factoryReset(port, 1, 2) == (0, 2), "instruction"
        assert packets.clearMultiTurn(port, 1) == (0, 0)


@pytest.mark.slow
def test_sync_read_is_answered_by_one_after_the_other() -> None:
    with client(ServoTruth(settings=FAST), ServoTruth(settings=FAST | {"ID": 2}, start_deg=90.0)) as (port, packets, _):
        group = dynamixel_sdk.GroupSyncRead(port, packets, 132, 4)
        assert group.addParam(1) and group.addParam(2)
        assert group.txRxPacket() == 0
        assert abs(group.getData(1, 132, 4) - 30 / 360 * 4096) < 20
        assert abs(group.getData(2, 132, 4) - 90 / 360 * 4096) < 20
        both = {1: [1020, 48], 2: [1020, 48]}
        wait_for(lambda: packets.broadcastPing(port) == (both, 0), "both answers")


@pytest.mark.slow
def test_two_with_one_id_spoil_each_other_s_answers() -> None:
    with client(ServoTruth(settings=FAST), ServoTruth(settings=FAST, start_deg=200.0), patience_ms=200.0) as (
        port,
        packets,
        _,
    ):
        results = [packets.readTxRx(port, 1, 120, 27)[1] for _ in range(5)]
        assert CORRUPT in results


def test_an_echo_is_skipped_by_the_client() -> None:
    with client(ServoTruth(settings=FAST), line=LineTruth(echo=True)) as (port, packets, _):
        assert packets.read2ByteTxRx(port, 1, 0) == (1020, 0, 0)


@pytest.mark.slow
def test_another_baud_rate_is_silence() -> None:
    with client(ServoTruth(settings=FAST | {"Baud Rate": 1}), patience_ms=200.0) as (port, packets, _):
        assert packets.ping(port, 1)[1] in (NO_REPLY, CORRUPT)
        assert port.setBaudRate(57600)
        wait_for(lambda: packets.ping(port, 1) == (1020, 0, 0), "its answer")


def test_the_alert_bit_is_in_every_reply_until_a_reboot() -> None:
    with client(ServoTruth(settings=FAST, boot_s=0.02)) as (port, packets, far):
        assert packets.write1ByteTxRx(port, 1, 64, 1) == (0, 0)
        far.do("fault", "temperature_c", 85.0)
        data, result, error = packets.readTxRx(port, 1, 64, 1)
        data, result, error = packets.readTxRx(port, 1, 64, 1)
        assert (data, result, error) == ([0], 0, 128)
        assert packets.read1ByteTxRx(port, 1, 70) == (4, 0, 128)
        assert packets.write1ByteTxRx(port, 1, 64, 1)[1] & 0x7F == 7
        far.do("fault", "temperature_c", 40.0)
        assert packets.reboot(port, 1) == (0, 0), "the answer comes from after it"


# The manual's own examples, protocol2.md: what is sent to an XM430-W210 of firmware 38, and what it answers.
EXAMPLES = {
    "ping": ("FF FF FD 00 01 03 00 01 19 4E", "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D"),
    "read Present Position, 166": (
        "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15",
        "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0",
    ),
    "write Goal Position, 512": (
        "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89",
        "FF FF FD 00 01 04 00 55 00 A1 0C",
    ),
    "reg write Goal Velocity, 200": (
        "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E",
        "FF FF FD 00 01 04 00 55 00 A1 0C",
    ),
    "action": ("FF FF FD 00 01 03 00 05 02 CE", "FF FF FD 00 01 04 00 55 00 A1 0C"),
    "reboot": ("FF FF FD 00 01 03 00 08 2F 4E", "FF FF FD 00 01 04 00 55 00 A1 0C"),
    "sync read": (
        "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
        "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0",
    ),
}


def test_the_manual_s_examples_are_answered_byte_by_byte() -> None:
    still = ServoTruth("XM430-W210", 38, start_deg=166.5 / 4096 * 360, encoder_noise_deg=0.0, ripple_fraction=0.0)
    servo, receiver = SimulatedServo(still, 0.0), Receiver()
    for time_s, (name, (sent, answered)) in enumerate(EXAMPLES.items()):
        packets = list(receiver.receive(bytes.fromhex(sent), float(time_s)))
        assert [packet.is_valid for packet in packets] == [True], name
        assert servo.obey(packets[0], float(time_s)) == bytes.fromhex(answered), name
    clear = "FF FF FD 00 01 08 00 10 01 44 58 4C 22 B1 DC"  # firmware 42 and later; 38 does not know it
    assert encode(1, 0x10, b"\x01DXL\x22") == bytes.fromhex(clear)
    assert encode_status(2, 0, (2079).to_bytes(4, "little")) == bytes.fromhex(
        "FF FF FD 00 02 08 00 55 00 1F 08 00 00 BA BE"
    )


def test_a_header_inside_a_packet_is_stuffed_and_found_again_after_garbage_and_in_pieces() -> None:
    data = b"\x74\x00\xff\xff\xfd\x00\xff\xff\xfd\xfd"
    packet = encode(1, 3, data)
    assert len(packet) == 7 + 1 + len(data) + 2 + 2
    receiver = Receiver()
    heard = [found for byte in b"\x00\xff\xff\xfd" + packet for found in receiver.receive(bytes([byte]), 0.0)]
    assert heard == [ServoPacket(1, 3, data, True)]


def test_a_damaged_instruction_is_answered_by_crc_error_and_not_obeyed() -> None:
    servo, receiver = SimulatedServo(ServoTruth(), 0.0), Receiver()
    packet = bytearray(encode(1, 3, b"\x40\x00\x01"))
    packet[-3] ^= 0x02
    (damaged,) = receiver.receive(bytes(packet), 0.0)
    assert servo.obey(damaged, 0.0) == encode_status(1, 3)
    assert servo.memory["Torque Enable"] == 0

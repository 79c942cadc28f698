"""The emulated counter counts once the firmware has switched it on, and not before."""

from firmware_host.emulator.chip.clocks import Clocks
from firmware_host.emulator.chip.timers import Tim2
from firmware_host.emulator.timeline import TICK_HZ, Timeline


def test_a_counter_that_was_not_switched_on_stays_at_zero() -> None:
    timeline = Timeline()
    registers = {register.name: register for register in Tim2(timeline, Clocks()).registers()}

    def write(name: str, value: int) -> None:
        accept = registers[name].write
        assert accept is not None
        accept(value)

    def count() -> int:
        read = registers["CNT"].read
        assert read is not None
        return read()

    write("ARR", 0xFFFF_FFFF)
    timeline.now += TICK_HZ
    assert count() == 0
    write("CR1", 1)
    timeline.now += TICK_HZ
    assert count() == Clocks().pclk1_hz

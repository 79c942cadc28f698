"""The emulated board: the shipped image runs on it, and firmware that breaks a rule fails by name."""

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest

from firmware_host.emulator.chip.flash_memory import STORE_OFFSET, FlashMemory
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.emulator.parts.gyroscope import GyroTruth
from firmware_host.emulator.parts.lsm9ds1 import WHO_AM_I, Lsm9ds1
from firmware_host.errors import BoardError
from firmware_host.frames import encode
from firmware_host.protocol import BAUD_RATE, RESET_CAUSES
from support.board import tiny_firmware
from support.board.emulated_session import CRYSTAL_PPM, UNIQUE_ID, Session, make_shipped_flash

SETTLING = 8  # conversions the firmware throws away after a configure


def run(source: str, folder: Path, duration_s: float = 0.02) -> bytes:
    """What a tiny image sends in `duration_s`."""
    board = tiny_firmware.board(source, folder)
    board.advance(duration_s)
    return board.take_sent()


def failure(source: str, folder: Path) -> BoardError:
    """The error that ends a run of a tiny image."""
    board = tiny_firmware.board(source, folder)
    with pytest.raises(BoardError) as caught:
        board.advance(0.02)
    with pytest.raises(BoardError, match=re.escape(str(caught.value))):
        board.advance(0.04)  # a board that failed stays failed
    return caught.value


# --- the shipped image


def test_the_image_says_who_it_is() -> None:
    session = Session()
    identity = session.ask("hello") if session.run(0.2) == [] else None
    assert identity is not None, "a booted board waits for half a second before it speaks first"
    assert identity.values["unique_id"] == UNIQUE_ID
    assert RESET_CAUSES[identity.values["reset_cause"]] == "power"
    assert identity.items[0]["part"] == b"LSM9DS1"
    assert (identity.items[0]["present"], identity.items[0]["who_am_i"]) == (1, 0x68)


def test_nothing_happens_before_power_up() -> None:
    session = Session(boot_time_s=1.0)
    assert session.run(0.99) == []
    assert session.board.baud_rate is None
    session.run(0.1)
    assert session.board.baud_rate == pytest.approx(BAUD_RATE, rel=0.003)


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [14.9, 119.0, 238.0, 952.0])
def test_samples_are_one_data_period_apart_on_the_board_clock(rate_hz: float) -> None:
    session = Session()
    session.run(0.2)
    stream = session.stream(1.0, rate_hz)
    assert 0.9 * rate_hz - SETTLING <= len(stream) <= rate_hz - SETTLING
    assert np.all(np.diff(stream["sequence"]) == 1)
    board_seconds = 122 * 32768 / 4e6 * (1 + CRYSTAL_PPM * 1e-6)  # the clock is locked to the 32768 Hz crystal
    period_us = 1e6 / rate_hz * board_seconds
    expected = (stream["sequence"] - stream["sequence"][0]) * period_us
    # A time stamp is a whole microsecond and waits for the end of whatever interrupt is running
    assert np.max(np.abs((stream["time_us"] - stream["time_us"][0]) - expected)) <= 3.0


def test_samples_carry_the_sensor_s_motion_and_temperature() -> None:
    session = Session(rate_at=lambda _time_s: (0.5, 0.0, -1.0), noise_rad_s=0.0)
    session.run(0.2)
    stream = session.stream(0.3)
    per_count = np.radians(8.75e-3)
    expected = np.array([0.5 / 1.1771 - 0.0077, 0.0100, -1.0 / 1.1440 + 0.0051]) / per_count
    assert np.all(np.abs(stream["counts"] - expected) <= 0.5)
    assert set(stream["temperature"] / 16 + 25) == {22.0}


@pytest.mark.slow
def test_equal_inputs_give_equal_bytes() -> None:
    def digest(tick_s: float) -> str:
        session = Session(tick_s=tick_s)
        session.run(0.2)
        session.stream(2.0)
        session.ask("status")
        return hashlib.sha256(session.sent).hexdigest()

    first = digest(0.002)
    assert digest(0.002) == first
    assert digest(0.01) == first, "the size of the world's tick must not matter"


def test_bytes_come_at_the_pace_of_the_line() -> None:
    session = Session()
    session.run(0.2)
    board, tick_s = session.board, 1e-6
    assert board.baud_rate is not None
    byte_s = 10 / board.baud_rate
    board.receive(encode("hello", 1))
    arrivals_s: list[float] = []
    for step in range(1, 2000):
        board.advance(session.time_s + step * tick_s)
        arrivals_s += [step * tick_s] * len(board.take_sent())
    assert len(arrivals_s) > 40
    assert arrivals_s[0] > (len(encode("hello", 1)) + 1) * byte_s, "the answer cannot come before the question is over"
    np.testing.assert_allclose(np.diff(arrivals_s), byte_s, atol=1.1 * tick_s)


@pytest.mark.slow
def test_noise_on_the_line_harms_nothing() -> None:
    session = Session()
    session.run(0.2)
    random = np.random.default_rng(1)
    for _ in range(20):
        session.board.receive(random.bytes(400))
        session.run(0.01)
    session.board.receive(b"\0")
    session.run(0.01)
    assert session.ask("hello").values["unique_id"] == UNIQUE_ID
    assert session.ask("status").values["rx_errors"] > 20


@pytest.mark.slow
def test_reboot_starts_the_image_afresh() -> None:
    session = Session()
    session.run(0.2)
    session.stream(0.2)
    assert session.ask("reboot").name == "ack"
    session.run(0.1)
    identity = session.ask("hello")
    assert RESET_CAUSES[identity.values["reset_cause"]] == "software"
    assert not session.ask("status").values["streaming"]
    assert len(session.stream(0.2)) > 40 - SETTLING


def test_the_reset_button_starts_the_image_afresh() -> None:
    session = Session()
    session.run(0.2)
    session.board.reset()
    session.run(0.1)
    assert RESET_CAUSES[session.ask("hello").values["reset_cause"]] == "pin"


@pytest.mark.parametrize(
    ("pin", "level"),
    [("PB4", "up"), ("PA15", "up"), ("PA8", "down"), ("PA12", "down"), ("PA1", "down")],  # MISO, RX, data-ready
)
def test_what_nobody_drives_is_pulled_to_rest(pin: str, level: str) -> None:
    session = Session()
    session.run(0.2)
    (port,) = [block for block in session.board.peripherals if block.name == f"GPIO{pin[1]}"]
    (pulls,) = [register.read for register in port.registers() if register.name == "PUPDR"]
    assert pulls is not None
    assert pulls() >> 2 * int(pin[2:]) & 3 == {"up": 1, "down": 2}[level]


def test_an_image_whose_tick_fails_is_restarted_by_its_watchdog() -> None:
    image = bytearray(make_shipped_flash().data[:STORE_OFFSET])
    systick, usart2 = 4 * 15, 4 * (16 + 38)
    image[systick : systick + 4] = image[usart2 : usart2 + 4]  # another's handler, so that nothing ever ticks
    session = Session(flash=FlashMemory(bytes(image)))
    session.run(0.4)
    assert RESET_CAUSES[session.ask("hello").values["reset_cause"]] == "power"
    session.run(0.9)
    assert RESET_CAUSES[session.ask("hello").values["reset_cause"]] == "watchdog"


# --- what firmware must not do


def test_an_unmodelled_register_fails_by_name(tmp_path: Path) -> None:
    error = failure(
        """
        __attribute__((noinline)) void usart_init(void) { REG(0x4000442C) = 5; REG(0x4000440C) = 87; }
        int main(void) { setup(); usart_init(); for (;;); }
        """,
        tmp_path,
    )
    assert error.name == "unmodelled_register"
    assert "USART2+0x2C" in error.what
    assert "in function usart_init" in error.what


@pytest.mark.one_in(4)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "statement", "what"),
    [
        ("unmodelled_bits", "REG(0x40004400) |= 1u << 12;", "USART2 CR1 = 0x0000100D"),
        ("unmodelled_register", "*(volatile uint8_t *)0x4000440C = 1;", "8-bit write of 0x1: USART2+0x0C"),
        ("register_access", "(void)REG(0x40004428);", "read: USART2 TDR does not allow it"),
        ("clock_off", "(void)REG(0x40020000);", "DMA1 ISR has no clock"),
        ("core_too_fast", "REG(0x40022000) = 3;\\n REG(0x40021008) = 3;", "80 MHz with 3 flash wait states"),
        ("no_system_clock", "REG(0x40021008) = 1;", "not running"),
        ("firmware_fault", "*(volatile int *)0x60000000 = 1;", "write to address 0x60000000"),
        ("firmware_fault", "*(volatile int *)0x08001000 = 1;", "write to read-only address 0x08001000"),
        ("firmware_fault", '__asm volatile("ldrd r0, r1, [%0]" :: "r"(0x20000102) : "r0", "r1");', "0x20000102"),
        ("firmware_fault", '__asm volatile("stmia %0!, {r0, r1}" :: "l"(0x20000101));', "unaligned access"),
        (
            "firmware_fault",
            'ENABLE_FLOAT();\\n __asm volatile("vldr s0, [%0]" :: "r"(0x20000101));',
            "unaligned access",
        ),
        (
            "firmware_fault",
            '__asm volatile("msr msp, %0" :: "r"(0x1000));\\n REG(0xE000ED04) = 1u << 28;\\n WFI();',
            "memory write",
        ),
        ("firmware_fault", '__asm volatile("udf #0");', "nvalid instruction"),
        ("firmware_fault", '__asm volatile("bkpt #0");', "breakpoint"),
        ("firmware_fault", '__asm volatile("svc #0");', "supervisor call"),
        ("bad_vector", "REG(0xE000E100) = 1;\\n REG(0xE000E200) = 1;\\n WFI();", "exception 16"),
        ("firmware_fault", "((void (*)(void))0x60000001)();\\n WFI();", "execution at address 0x60000000"),
        ("firmware_fault", '__asm volatile("vmov.f32 s0, #1.0");', "floating point before CPACR enables it"),
        ("spi_setup", "REG(0x40013000) = 0x37C;\\n REG16(0x4001300C) = 0;", "PB3, PB4, PB5"),
        ("iwdg_locked", "REG(0x40003004) = 1;", "IWDG"),
    ],
)
def test_a_broken_rule_is_named_with_its_function(name: str, statement: str, what: str, tmp_path: Path) -> None:
    error = failure(
        f"""
        __attribute__((noinline)) void culprit(void) {{ {statement} }}
        int main(void) {{ setup(); culprit(); for (;;); }}
        """.replace("\\n", "\n"),
        tmp_path,
    )
    assert error.name == name
    assert what in error.what
    assert "culprit" in error.what


@pytest.mark.slow
def test_an_access_may_be_right_many_times_before_it_is_wrong(tmp_path: Path) -> None:
    error = failure(
        """
        __attribute__((noinline)) void culprit(uint32_t address)
        {
            __asm volatile("ldrd r0, r1, [%0]" :: "r"(address) : "r0", "r1");
        }
        int main(void) { setup(); for (int i = 0; i < 600; i++) culprit(0x20000100 + i / 599); for (;;); }
        """,
        tmp_path,
    )
    assert "unaligned access by address 0x20000101" in error.what


@pytest.mark.slow
def test_memory_is_not_zero_at_power_up(tmp_path: Path) -> None:
    source = "uint8_t bytes[8]; int main(void) { setup(); for (int i = 0; i < 8; i++) put(bytes[i]); for (;;); }"
    assert run(source, tmp_path) == b"\xa5" * 8


@pytest.mark.slow
def test_a_starved_watchdog_resets_the_board(tmp_path: Path) -> None:
    sent = run(
        """
        int main(void)
        {
            setup();
            put(REG(0x40021094) >> 24); /* reset flags */
            REG(0x40021094) |= 1u << 23;
            REG(0x40003000) = 0x5555;
            REG(0x40003004) = 0; /* / 4 */
            REG(0x40003008) = 31;
            REG(0x40003000) = 0xCCCC; /* 4 ms */
            for (;;);
        }
        """,
        tmp_path,
        duration_s=0.0219,
    )
    power_and_pin, watchdog_and_pin = b"\x0c", b"\x24"
    assert sent == power_and_pin + 5 * watchdog_and_pin


@pytest.mark.slow
def test_a_kicked_watchdog_does_not(tmp_path: Path) -> None:
    sent = run(
        """
        volatile int ticks;
        void systick(void) { ticks++; REG(0x40003000) = 0xAAAA; }
        int main(void)
        {
            setup();
            put('!');
            REG(0x40003000) = 0x5555;
            REG(0x40003004) = 0;
            REG(0x40003008) = 31;
            REG(0x40003000) = 0xCCCC; /* 4 ms */
            REG(0xE000E014) = 80000 - 1; /* 1 ms */
            REG(0xE000E018) = 0;
            REG(0xE000E010) = 7;
            for (;;) WFI();
        }
        """,
        tmp_path,
    )
    assert sent == b"!"


# --- exceptions


@pytest.mark.slow
def test_interrupts_preserve_floating_point_work(tmp_path: Path) -> None:
    source = """
        volatile float disturbed;
        volatile int ticks;
        void systick(void) { disturbed = disturbed * 1.5f + 1.0f; ticks++; }
        int main(void)
        {
            setup();
            ENABLE_FLOAT();
            disturbed = 1.0f;
            ticks = 0;
            REG(0xE000E014) = 799;
            REG(0xE000E018) = 0;
            REG(0xE000E010) = %d;
            float a = 1, b = 2, c = 3, d = 4;
            for (int i = 0; i < 5000; i++) {
                a = a * 1.0001f + b * 1e-4f;
                b = b * .9999f + c * 1e-4f;
                c = c * .9998f + d * 1e-5f;
                d = d * 1.00001f + a * 1e-6f;
            }
            REG(0xE000E010) = 0;
            union { float value; uint8_t bytes[4]; } sum = {a + b + c + d};
            for (int i = 0; i < 4; i++) put(sum.bytes[i]);
            put(ticks);
            for (;;) WFI();
        }
        """
    undisturbed, disturbed = run(source % 4, tmp_path), run(source % 7, tmp_path)
    assert undisturbed[4] == 0
    assert disturbed[4] > 50
    assert disturbed[:4] == undisturbed[:4]


@pytest.mark.slow
def test_the_higher_priority_preempts_and_the_equal_waits(tmp_path: Path) -> None:
    source = """
        void pendsv(void) { put('p'); REG(0xE000ED04) = 1u << 26; put('q'); }
        void systick(void) { put('s'); }
        int main(void)
        {
            setup();
            REG(0xE000ED20) = %#xu << 16 | %#xu << 24; /* priorities of PendSV and SysTick */
            REG(0xE000ED04) = 1u << 28;
            put('m');
            for (;;) WFI();
        }
        """
    assert run(source % (0x40, 0x20), tmp_path) == b"psqm"
    assert run(source % (0x40, 0x40), tmp_path) == b"pqsm"
    assert run(source % (0x40, 0x80), tmp_path) == b"pqsm"


@pytest.mark.slow
def test_a_masked_interrupt_wakes_the_core_and_runs_once_unmasked(tmp_path: Path) -> None:
    sent = run(
        """
        void systick(void) { put('s'); REG(0xE000E010) = 0; }
        int main(void)
        {
            setup();
            REG(0xE000E014) = 80000 - 1;
            REG(0xE000E018) = 0;
            REG(0xE000E010) = 7;
            __asm volatile("cpsid i");
            WFI();
            put('w');
            __asm volatile("cpsie i\\n isb");
            put('m');
            for (;;) WFI();
        }
        """,
        tmp_path,
    )
    assert sent == b"wsm"


@pytest.mark.slow
def test_a_byte_that_arrives_is_an_interrupt(tmp_path: Path) -> None:
    board = tiny_firmware.board(
        """
        void usart2(void) { put(REG(0x40004424) + 1); }
        int main(void)
        {
            setup();
            REG(0x40004400) |= 1u << 5;
            REG(0xE000E104) = 1u << 6;
            for (;;) WFI();
        }
        """,
        tmp_path,
    )
    board.receive(b"lost: the port is still off")
    board.advance(0.001)
    board.receive(b"HAL")
    board.advance(0.002)
    assert board.take_sent() == b"IBM"


@pytest.mark.slow
def test_instructions_take_a_cycle_each_and_every_line_of_the_flash_its_wait_states(tmp_path: Path) -> None:
    """A loop of four narrow instructions in one line of 64 bits, then in two; the chip's cache would spare the wait."""
    source = """
        #define LOOP(before) __asm volatile( \\
            "mov r0, #100\\n .balign 8\\n" before "1: subs r0, #1\\n nop\\n nop\\n bne 1b" ::: "r0", "cc")
        int main(void)
        {
            setup();
            REG(0x40021058) |= 1;
            REG(0x4000002C) = ~0u;
            REG(0x40000014) = 1;
            REG(0x40000000) = 1; /* TIM2 at 80 MHz */
            for (int i = 0; i < 2; i++) {
                uint32_t from = REG(0x40000024);
                if (i == 0)
                    LOOP("");
                else
                    LOOP("nop\\n");
                uint32_t cycles = REG(0x40000024) - from;
                put(cycles); put(cycles >> 8);
            }
            for (;;);
        }
        """
    sent = run(source, tmp_path)
    in_one_line, over_two = (int.from_bytes(sent[i : i + 2], "little") for i in (0, 2))
    assert 800 <= in_one_line <= 850
    assert 1200 <= over_two <= 1250


@pytest.mark.slow
def test_an_exception_takes_its_cycles(tmp_path: Path) -> None:
    """Twelve to enter, ten to return, and the vector from the flash."""
    source = """
        void pendsv(void) {}
        __attribute__((noinline)) uint32_t time(void) { __asm volatile(""); return REG(0x40000024); }
        int main(void)
        {
            setup();
            REG(0x40021058) |= 1;
            REG(0x4000002C) = ~0u;
            REG(0x40000014) = 1;
            REG(0x40000000) = 1;
            for (int i = 0; i < 2; i++) {
                uint32_t from = time();
                REG(0xE000ED04) = i << 28; /* pends it */
                put(time() - from);
            }
            for (;;);
        }
        """
    without, with_exception = run(source, tmp_path)
    assert 26 <= with_exception - without <= 60


# --- the sensor's bus


_ASK_THE_GYRO = """
    int main(void)
    {{
        setup();
        REG(0x48000420) |= 5u << 12 | 5u << 16 | 5u << 20;
        REG(0x48000400) = (REG(0x48000400) & ~(0x3Fu << 6)) | 0x2Au << 6;
        REG(0x48000018) = 1u << 11;
        REG(0x48000000) = (REG(0x48000000) & ~(3u << 22)) | 1u << 22;
        REG(0x40013000) = {control:#x};
        REG(0x48000018) = 1u << 27;
        REG16(0x4001300C) = 0x8F;
        while (!(REG(0x40013008) & 1));
        {after}
        REG(0x48000018) = 1u << 11;
        put(REG16(0x4001300C) >> 8);
        for (;;);
    }}
    """
_MODE_3_AT_625_KHZ = 0x377
_AWAIT_QUIET = "while (REG(0x40013008) & 1u << 7);"


def board_with_gyro(source: str, folder: Path) -> EmulatedBoard:
    gyro = Lsm9ds1(lambda _time_s: (0.0, 0.0, 0.0), GyroTruth(), temperature_c=25.0, seed=1)
    return tiny_firmware.board(source, folder, [gyro])


@pytest.mark.slow
def test_the_wrong_spi_mode_is_refused(tmp_path: Path) -> None:
    board = board_with_gyro(_ASK_THE_GYRO.format(control=0x35C, after=""), tmp_path)
    with pytest.raises(BoardError, match="SPI1 speaks mode 0 at 5 MHz to the LSM9DS1") as caught:
        board.advance(0.001)
    assert caught.value.name == "spi_setup"


@pytest.mark.slow
def test_a_part_is_deselected_only_when_the_last_bit_is_over(tmp_path: Path) -> None:
    board = board_with_gyro(_ASK_THE_GYRO.format(control=_MODE_3_AT_625_KHZ, after=_AWAIT_QUIET), tmp_path)
    board.advance(0.001)
    assert board.take_sent() == bytes([WHO_AM_I])
    board = board_with_gyro(_ASK_THE_GYRO.format(control=_MODE_3_AT_625_KHZ, after=""), tmp_path)
    with pytest.raises(BoardError) as caught:  # all bits are in, but the last one has half its time to go
        board.advance(0.001)
    assert caught.value.name == "spi_busy"

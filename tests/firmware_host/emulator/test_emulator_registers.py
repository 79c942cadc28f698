"""The emulator's registers are where the chip's maker says, are called so, and hold the same after a reset."""

import pytest

from firmware_host.emulator.chip.bus import Peripheral
from support.board.emulated_session import Session
from support.board.svd import number, peripherals

pytestmark = pytest.mark.slow

MODELLED = {peripheral.name: peripheral for peripheral in Session().board.peripherals}
MAKERS_NAMES = {"SysTick": "STK"}
MISSING = {("SCB", "CPACR")}  # the maker lists it as a peripheral of its own, FPU_CPACR
BEFORE_ANY_DATA = {"DR", "RDR"}  # reading them without data is an error here
# Where the maker's file differs from the maker's manual (RM0394: pins start as analog) and from the core's (ARMv7-M)
RESET_VALUES = {
    ("GPIOA", "MODER"): 0xABFF_FFFF,
    ("GPIOA", "OSPEEDR"): 0x0C00_0000,
    ("GPIOB", "MODER"): 0xFFFF_FEBF,
    ("GPIOB", "OSPEEDR"): 0,
    ("SPI1", "CR2"): 0x0700,
    ("SCB", "AIRCR"): 0xFA05_0000,
}


def described(peripheral: Peripheral) -> dict[int, tuple[str, int]]:
    """Offset → name and value after reset, as the maker describes them."""
    element = peripherals()[MAKERS_NAMES.get(peripheral.name, peripheral.name)]
    assert peripheral.base == number(element, "baseAddress")
    element = peripherals()[element.get("derivedFrom", element.findtext("name"))]
    return {
        number(r, "addressOffset"): (r.findtext("name", ""), int(r.findtext("resetValue", "0"), 0))
        for r in reversed(list(element.iter("register")))  # of one place with two names the first counts
    }


@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", MODELLED)
def test_every_modelled_register_is_the_makers(name: str) -> None:
    peripheral = MODELLED[name]
    makers = described(peripheral)
    for register in peripheral.registers():
        if (name, register.name) in MISSING:
            continue
        word = register.offset & ~3  # registers that allow it are also listed byte by byte
        makers_name, reset_value = makers[word]
        assert register.name == makers_name
        if register.read is not None and register.name not in BEFORE_ANY_DATA and register.size == 4:
            assert register.read() == RESET_VALUES.get((name, register.name), reset_value), register.name

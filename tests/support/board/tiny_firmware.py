"""Tiny Cortex-M4 images, compiled during the test, for actions that the product's own image must never do."""

import subprocess
from collections.abc import Sequence
from pathlib import Path

from firmware_host.emulator.chip.flash_memory import FlashMemory
from firmware_host.emulator.chip.spi_device import SpiDevice
from firmware_host.emulator.machine import EmulatedBoard

_FLAGS = (
    "-mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -O1 -g -ffreestanding -nostdlib -Wl,--build-id=none"
)

_LINKER_SCRIPT = """
MEMORY
{
  FLASH (rx) : ORIGIN = 0x08000000, LENGTH = 256K
  RAM (rwx) : ORIGIN = 0x20000000, LENGTH = 48K
}
SECTIONS
{
  .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) } > FLASH
  .bss (NOLOAD) : { *(.data*) *(.bss*) *(COMMON) } > RAM
}
"""

# Vectors and entry. Handlers are weak: a test defines those it needs.
_START = """
int main(void);
static void start(void) { main(); for (;;); }
static void unexpected(void) { for (;;); }
#define HANDLER(name) void name(void) __attribute__((weak, alias("unexpected")))
HANDLER(nmi);
HANDLER(pendsv);
HANDLER(systick);
HANDLER(exti9_5);
HANDLER(usart2);
__attribute__((section(".vectors"), used)) static const void *const vectors[16 + 39] = {
    (void *)0x2000C000, start, [2] = nmi, [14] = pendsv, [15] = systick, [16 + 23] = exti9_5, [16 + 38] = usart2,
};
"""

# setup(): 80 MHz, USART2 at 919540 Bd on its pins. put(): one byte out. Words, because images need no C library.
_PRELUDE = """
#include <stdint.h>
#define REG(address) (*(volatile uint32_t *)(address))
#define REG16(address) (*(volatile uint16_t *)(address))
#define ENABLE_FLOAT() do { REG(0xE000ED88) |= 0xF << 20; __asm volatile("dsb\\n isb"); } while (0)
#define WFI() __asm volatile("wfi" ::: "memory")
__attribute__((noinline, unused)) static void setup(void)
{
    REG(0x40022000) = 4;
    REG(0x4002100C) = 1u | 40u << 8 | 1u << 24;
    REG(0x40021000) |= 1u << 24;
    REG(0x40021008) = 3;
    REG(0x4002104C) |= 3;
    REG(0x40021058) |= 1u << 17;
    REG(0x40021060) |= 1u << 12 | 1;
    REG(0x48000020) |= 7u << 8;
    REG(0x48000024) |= 3u << 28;
    REG(0x48000000) = (REG(0x48000000) & ~(3u << 4 | 3u << 30)) | 2u << 4 | 2u << 30;
    REG(0x4000440C) = 87;
    REG(0x40004400) = 1u | 1u << 2 | 1u << 3;
}
__attribute__((noinline, unused)) static void put(uint8_t byte)
{
    while (!(REG(0x4000441C) & 1u << 7))
        ;
    REG(0x40004428) = byte;
}
#line 1 "tiny.c"
"""


def build(source: str, folder: Path, includes: Sequence[Path] = ()) -> tuple[bytes, bytes]:
    """Compile `source`, which defines main, after the prelude. Return the flash image and the ELF file."""
    searched = [f"-I{path}" for path in includes]
    (folder / "tiny.ld").write_text(_LINKER_SCRIPT)
    (folder / "start.c").write_text(_START)
    (folder / "tiny.c").write_text(_PRELUDE + source)
    for command in (
        ["arm-none-eabi-gcc", *_FLAGS.split(), *searched, "-T", "tiny.ld", "start.c", "tiny.c", "-o", "tiny.elf"],
        ["arm-none-eabi-objcopy", "-O", "binary", "tiny.elf", "tiny.bin"],
    ):
        subprocess.run(command, cwd=folder, check=True)
    return (folder / "tiny.bin").read_bytes(), (folder / "tiny.elf").read_bytes()


def board(source: str, folder: Path, devices: Sequence[SpiDevice] = ()) -> EmulatedBoard:
    """Return a board with an exact crystal, powered up at time 0, that runs `source`."""
    image, elf = build(source, folder)
    return power_up(FlashMemory(image), elf, devices)


def power_up(flash: FlashMemory, elf: bytes, devices: Sequence[SpiDevice] = ()) -> EmulatedBoard:
    """Return a board with an exact crystal, powered up at time 0, that runs the program in `flash`."""
    return EmulatedBoard(flash=flash, elf=elf, devices=devices, unique_id=bytes(12), crystal_ppm=0.0, boot_time_s=0.0)

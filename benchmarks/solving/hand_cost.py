"""The cost of a calibration by hand on the board: instructions of a reading and of a move, and stack.

python benchmarks/solving/hand_cost.py

The firmware's hand.c, hand_motion.c and hand_solver.c are compiled with its compiler and flags, and given the readings
of a simulated hand on an emulated Cortex-M4F. Counts are instructions, not time.
"""

import os
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from solver_cost import CODE, FIRMWARE, MEANS, RAM, Core, Cost

from firmware_host.protocol import MESSAGE_BY_NAME
from rig.world.hand.habits import FLIPS, FlipAction, Habits
from rig.world.hand.hand import SimulatedHand

SOURCES = [
    *(FIRMWARE / "core" / "by_hand" / f"hand{part}.c" for part in ("", "_motion", "_solver")),
    Path(__file__).with_suffix(".c"),
]
RATE_HZ, REST_S, NOISE_RAD_S = 119.0, 1.6, 1e-3
PER_RAD_S, PER_M_S2 = np.radians(0.0175), 0.122e-3 * 9.80665
STATE = RAM + 0x4000
SETTLING = 1_000  # instructions: only a reading that ends a block costs more
SOLVING = 20_000  # only a block that ends a move costs more


def build(folder: Path) -> Path:
    """Compile the program with the compiler and the flags of the firmware's Makefile; return its path."""
    environment = {
        name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")
    }
    show = ["make", "-s", "--no-print-directory", "-C", str(FIRMWARE), "--eval=show: ; @echo $(CC) $(CFLAGS)", "show"]
    command = subprocess.run(show, check=True, capture_output=True, text=True, env=environment).stdout.split()
    elf = folder / "hand.elf"
    link = ["-nostartfiles", "--specs=nano.specs", "-Wl,--entry=0", f"-Wl,-Ttext={CODE:#x}", f"-Wl,-Tbss={STATE:#x}"]
    subprocess.run([*command, *link, *map(str, SOURCES), "-o", str(elf)], check=True, cwd=FIRMWARE)
    return elf


def main() -> int:
    """Print the cost of a reading, of a block of them, and of a move."""
    hand, now_s = SimulatedHand(Habits(), 1), 1.5
    for face in FLIPS:
        now_s = hand.act(FlipAction(face), now_s) + REST_S
    time_s = np.arange(0.0, now_s, 1 / RATE_HZ)
    motion, rng = hand.motion_at(time_s), np.random.default_rng(1)
    noisy = motion.rate_rad_s + NOISE_RAD_S * rng.normal(size=motion.rate_rad_s.shape)
    rates, forces = (
        np.round(quantity / scale).astype(np.int16)
        for quantity, scale in ((noisy, PER_RAD_S), (motion.specific_force_m_s2, PER_M_S2))
    )
    setup: dict[str, float] = dict.fromkeys((field.name for field in MESSAGE_BY_NAME["setup"].fields), 0)
    setup |= {"rate_hz": RATE_HZ, "range_deg_s": 500.0, "sensitivity_rad_s": PER_RAD_S, "range_m_s2": 40.0}
    costs: list[Cost] = []
    with tempfile.TemporaryDirectory() as folder:
        core = Core(build(Path(folder)))
        core.write(MEANS, MESSAGE_BY_NAME["setup"].head.pack(*setup.values()))
        core.call("begin", MEANS)
        for number, (at_s, rate, force) in enumerate(
            zip(time_s.tolist(), rates.tolist(), forces.tolist(), strict=True)
        ):
            core.write(MEANS, struct.pack("<QI7h", round(1e6 * at_s), number, *rate, *force, 0))
            costs.append(core.call("add", MEANS)[1])
    counts = np.array([cost.instructions for cost in costs])
    plain, blocks, moves = counts[counts < SETTLING], counts[counts >= SETTLING], counts[counts >= SOLVING]
    blocks = blocks[blocks < SOLVING]
    print(f"a reading           {np.median(plain):8.0f} instructions, {plain.max()} at most")
    print(f"the last of a block {np.median(blocks):8.0f} instructions, {blocks.max()} at most")
    print(f"a move solved       {np.median(moves):8.0f} instructions, {moves.max()} at most; {len(moves)} moves")
    print(f"in all              {counts.sum():8} instructions for {len(counts)} readings, {counts.mean():.0f} each")
    print(f"stack               {max(cost.stack_bytes for cost in costs):8} B at most")
    return 0


if __name__ == "__main__":
    sys.exit(main())

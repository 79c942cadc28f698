"""The cost of a calibration on the board: instructions of one solve, counted on an emulated Cortex-M4F, and stack.

python benchmarks/solving/solver_cost.py

The firmware's own solver.c and a Levenberg–Marquardt in C (benchmarks/solving/levenberg_marquardt.c) are compiled with
the firmware's compiler and flags and called with the same observations. Counts are instructions, not time.

Both must be equally accurate: every answer is compared with the same observations solved in double precision.
Levenberg–Marquardt stops after a step below its tolerance. This is the largest power of ten with which its
root-mean-square differences, in scale and in bias, are at most twice those of the closed form, as far as single
precision permits. It must work for any number of observations; the last row is for six only, with every loop written
out as the closed form's are.
"""

import os
import struct
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from unicorn.arm_const import (
    UC_ARM_REG_LR,
    UC_ARM_REG_R0,
    UC_ARM_REG_R1,
    UC_ARM_REG_R2,
    UC_ARM_REG_S0,
    UC_ARM_REG_SP,
)

from firmware_host.emulator.engine import Engine
from firmware_host.emulator.hooks import BlockTicks
from firmware_host.emulator.thumb import instructions
from firmware_host.emulator.timeline import NEVER, Timeline
from firmware_host.protocol import METHODS
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator
from rig.study.simulation import ARM_SPEED_RAD_S, DIRECTIONS, EXTREME, NORMAL, Population

FIRMWARE = Path(__file__).parents[2] / "firmware_host" / "firmware"
SOURCES = (FIRMWARE / "core" / "calibration" / "solver.c", Path(__file__).parent / "levenberg_marquardt.c")

CODE, CODE_BYTES, RAM, RAM_BYTES = 0x0800_0000, 64 * 1024, 0x2000_0000, 64 * 1024
MEANS, SPEEDS, THETA, PROBLEM, ACCUMULATOR, SOLUTION = (RAM + 0x400 * i for i in range(6))
RETURN = STACK_TOP = RAM + RAM_BYTES - 16
STACK_BYTES, PAINT = 4096, 0xA5
WAIT_FOR_INTERRUPT = b"\x30\xbf"  # which ends a run of the engine
ARGUMENTS = (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_S0, UC_ARM_REG_SP, UC_ARM_REG_LR)

CASES = 100
AS_EXACT = 2.0
TOLERANCES = tuple(10.0**-power for power in range(1, 8))


@dataclass(frozen=True, slots=True)
class Cost:
    """The cost of one call, or the greatest cost of several."""

    instructions: int
    stack_bytes: int


@dataclass(frozen=True, slots=True)
class Answer:
    """Scale (3,), bias (3,) in rad/s, the number of iterations, and their cost."""

    scale: Array
    bias_rad_s: Array
    iterations: int
    cost: Cost


@dataclass(frozen=True, slots=True)
class Observations:
    """Mean readings (6, 3) and speeds (6,), rad/s, as single precision holds them."""

    means_rad_s: NDArray[np.float32]
    speeds_rad_s: NDArray[np.float32]

    def solve_in_double_precision(self) -> tuple[Array, Array]:
        accumulated = Accumulator.empty()
        for mean, speed in zip(self.means_rad_s, self.speeds_rad_s, strict=True):
            accumulated = accumulated.add(mean, np.ones(3), float(speed), weight=1.0)
        solution = accumulated.solve()
        return solution.scale, solution.bias_rad_s


class Core:
    """A Cortex-M4F without peripherals, which calls functions of an ELF file."""

    def __init__(self, elf: Path) -> None:
        self._engine, self._timeline = Engine(), Timeline()
        self._engine.map_rom(CODE, CODE_BYTES)
        self._engine.map_ram(RAM, RAM_BYTES)
        self._engine.write(RETURN, WAIT_FOR_INTERRUPT)
        self._arguments = self._engine.registers(ARGUMENTS)
        with elf.open("rb") as file:
            program = ELFFile(file)
            for segment in program.iter_segments("PT_LOAD"):
                self._engine.write(segment["p_paddr"], segment.data())
            symbols = program.get_section_by_name(".symtab")
            assert isinstance(symbols, SymbolTableSection)
            self._functions = {symbol.name: symbol["st_value"] for symbol in symbols.iter_symbols()}
        self._timeline.run_until(NEVER)
        self._lengths = BlockTicks(CODE, CODE_BYTES)  # in instructions
        self._engine.meter(self._timeline, self._lengths, self._measure)

    def _measure(self, address: int, size: int) -> int:
        self._lengths[address] = len(instructions(self._engine.read(address, size)))
        return self._lengths[address]

    def write(self, address: int, data: bytes) -> None:
        self._engine.write(address, data)

    def read(self, address: int, size: int) -> bytes:
        return self._engine.read(address, size)

    def read_floats(self, address: int, count: int) -> Array:
        return np.frombuffer(self.read(address, 4 * count), dtype="<f4").astype(np.float64)

    def call(self, function: str, *words: int, number: float = 0.0) -> tuple[int, Cost]:
        """Call a function; return its word and its cost. `number` is its one argument in a floating-point register."""
        self._engine.write(STACK_TOP - STACK_BYTES, bytes([PAINT]) * STACK_BYTES)
        (number_word,) = struct.unpack("<I", struct.pack("<f", number))
        self._arguments.write([*words, *[0] * (3 - len(words)), number_word, STACK_TOP, RETURN | 1])
        start = self._timeline.now
        self._engine.run(self._functions[function] & ~1)
        stack = self._engine.read(STACK_TOP - STACK_BYTES, STACK_BYTES)
        waiting = 1  # the instruction it returned to
        used = len(stack.lstrip(bytes([PAINT])))
        return self._arguments.read()[0], Cost(self._timeline.now - start - waiting, used)


def build(folder: Path, *defines: str) -> Path:
    """Compile both solvers with the compiler and the flags of the firmware's Makefile; return the program's path."""
    environment = {
        name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MAKELEVEL", "MFLAGS")
    }
    show = ["make", "-s", "--no-print-directory", "-C", str(FIRMWARE), "--eval=show: ; @echo $(CC) $(CFLAGS)", "show"]
    command = subprocess.run(show, check=True, capture_output=True, text=True, env=environment).stdout.split()
    elf = folder / f"solvers{len(defines)}.elf"
    link = ["-nostartfiles", "--specs=nano.specs", "-Wl,--entry=0", f"-Wl,-Ttext={CODE:#x}"]
    subprocess.run([*command, *defines, *link, *map(str, SOURCES), "-o", str(elf)], check=True, cwd=FIRMWARE)
    return elf


def observe(population: Population, seed: int) -> Observations:
    """Simulate six sweeps at 60°/s of a gyroscope of the population, mounted some degrees off, with noise."""
    rng = np.random.default_rng(seed)
    scale, bias = population.draw(rng)
    mounting = Rotation.from_rotvec(np.radians(5) * rng.normal(size=3))
    speeds = ARM_SPEED_RAD_S * rng.uniform(0.999, 1.001, 6)
    noise = 0.035 / np.sqrt(1428) * rng.normal(size=(6, 3))
    means = speeds[:, None] * mounting.apply(DIRECTIONS) / scale - bias + noise
    return Observations(means.astype(np.float32), speeds.astype(np.float32))


def add_observations(core: Core, observations: Observations) -> list[Cost]:
    """Let the board accumulate; return the cost of each observation."""
    core.call("solver_begin", ACCUMULATOR)
    costs = []
    for mean, speed in zip(observations.means_rad_s, observations.speeds_rad_s, strict=True):
        core.write(MEANS, mean.tobytes())
        costs.append(core.call("solver_add", ACCUMULATOR, MEANS, number=float(speed))[1])
    return costs


def solve(core: Core, observations: Observations, method: str) -> Answer:
    """Solve by `method`; the cost is that of all steps after the last observation: gates, solution, parameters."""
    add_observations(core, observations)
    _, cost = core.call("solver_solve", ACCUMULATOR, METHODS.index(method), SOLUTION)
    status, iterations = core.read(SOLUTION, 2)
    assert status == 0, "not solved"
    parameters = core.read_floats(SOLUTION + 4, 6)
    return Answer(parameters[:3], parameters[3:], iterations, cost)


def levenberg_marquardt(core: Core, observations: Observations, tolerance: float) -> Answer:
    """Solve by Levenberg–Marquardt from the scale 1 and the bias 0 of an uncalibrated sensor, as the paper SIX does."""
    core.write(MEANS, observations.means_rad_s.tobytes())
    core.write(SPEEDS, observations.speeds_rad_s.tobytes())
    core.write(PROBLEM, struct.pack("<III", MEANS, SPEEDS, len(observations.speeds_rad_s)))
    core.write(THETA, np.array([1, 1, 1, 0, 0, 0], dtype="<f4").tobytes())
    passes, cost = core.call("levenberg_marquardt", PROBLEM, THETA, number=tolerance)
    assert passes < 1 << 31, "not converged"
    parameters = core.read_floats(THETA, 6)
    return Answer(np.abs(parameters[:3]), parameters[3:], passes, cost)


@dataclass(frozen=True, slots=True)
class Row:
    """A solver's results over all cases: medians of the counts, the most stack, root-mean-square differences."""

    name: str
    instructions: float
    iterations: float
    stack_bytes: int
    scale_difference: float
    bias_difference_rad_s: float

    @classmethod
    def summarize(cls, name: str, answers: Sequence[Answer], exact: Sequence[tuple[Array, Array]]) -> Self:
        pairs = list(zip(answers, exact, strict=True))
        return cls(
            name,
            float(np.median([answer.cost.instructions for answer in answers])),
            float(np.median([answer.iterations for answer in answers])),
            max(answer.cost.stack_bytes for answer in answers),
            float(np.sqrt(np.mean([(answer.scale / scale - 1) ** 2 for answer, (scale, _) in pairs]))),
            float(np.sqrt(np.mean([(answer.bias_rad_s - bias) ** 2 for answer, (_, bias) in pairs]))),
        )

    def is_as_exact_as(self, other: Self) -> bool:
        return (
            self.scale_difference <= AS_EXACT * other.scale_difference
            and self.bias_difference_rad_s <= AS_EXACT * other.bias_difference_rad_s
        )


def compare(population: Population, plain: Core, written_out: Core) -> list[Row]:
    """Return the rows of the solvers, the closed form first."""
    cases = [observe(population, seed) for seed in range(CASES)]
    exact = [case.solve_in_double_precision() for case in cases]
    closed_form, algorithm_1 = (
        Row.summarize(method.replace("_", " "), [solve(plain, case, method) for case in cases], exact)
        for method in METHODS
    )
    rows = [closed_form, algorithm_1]
    for core, kind in ((plain, ""), (written_out, ", for six only, written out")):
        for tolerance in TOLERANCES:
            answers = [levenberg_marquardt(core, case, tolerance) for case in cases]
            row = Row.summarize(f"Levenberg–Marquardt{kind} (step {tolerance:g})", answers, exact)
            if row.is_as_exact_as(closed_form):
                rows.append(row)
                break
        else:
            raise SystemExit(f"Levenberg–Marquardt{kind} does not reach the accuracy of the closed form")
    return rows


def main() -> None:
    """Print a table for each population: instructions, their ratio, differences from double precision."""
    with tempfile.TemporaryDirectory() as folder:
        plain, written_out = (Core(build(Path(folder), *defines)) for defines in ((), ("-DEXACTLY_SIX",)))
    for population in (NORMAL, EXTREME):
        rows = compare(population, plain, written_out)
        print(f"\n{population.name} gyroscopes of SIX: scale {population.scale}, |bias| {population.bias_rad_s} rad/s")
        print(f"{'solver':62}{'instructions':>13}{'ratio':>7}{'passes':>8}{'stack B':>9}{'scale':>11}{'rad/s':>11}")
        for row in rows:
            print(
                f"{row.name:62}{row.instructions:13.0f}{row.instructions / rows[0].instructions:7.1f}"
                f"{row.iterations:8.0f}{row.stack_bytes:9}{row.scale_difference:11.1e}{row.bias_difference_rad_s:11.1e}"
            )
    costs = add_observations(plain, observe(NORMAL, 0))
    dearest = max(cost.instructions for cost in costs)
    print(f"\nTo add an observation: {dearest} instructions, {max(cost.stack_bytes for cost in costs)} B of stack.")


if __name__ == "__main__":
    main()

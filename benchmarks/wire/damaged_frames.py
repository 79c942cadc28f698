"""Damaged messages by the million: `python benchmarks/wire/damaged_frames.py [--frames N] [--messages N] [--seed N]`.

Ten million damaged frames to the firmware's receiver, under the sanitizers for addresses and undefined behaviour, and
ten million to the host's: bits flipped, runs lost, doubled, swapped, overwritten and inserted, ends cut, delimiters
lost, blocks over-long, a wrong CRC in a frame of the right length, a right CRC around nonsense. A third receiver,
written from the protocol's description alone, decides bit by bit which frames to accept: the firmware's must accept the
same, block by block, and the board must continue to answer; the host's must receive the same frames as from the intact
blocks alone. A hundred thousand damaged messages each of RTDE, dashboard and primary interface to the rig's readers and
to the simulated controller's: no crash, no hang, a named end.

The expected number of wrong frames: a damaged block that is still valid COBS passes a CRC of 32 bits with a probability
of 2⁻³².
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names
from support.board.damaged_frames import Sent, build, damage_answers, damage_requests, write_sound
from support.wires.damaged_messages import carry_to_rig, carry_to_world, readers

ROOT = Path(__file__).parents[2]
WARM_UP = 2000  # messages, after which memory may not grow
GROWTH_MAX = 20 * 2**20  # bytes


def report(receiver: str, sent: Sent, spent_s: float) -> list[str]:
    """Print the fate of the frames sent to a receiver; return the defects."""
    print(
        f"{receiver}: {sent.frames} damaged frames, {sent.blocks} blocks between delimiters, {sent.refused} refused, "
        f"{sent.as_sent} intact all the same, {sent.made} of nonsense with a right CRC, {sent.chance} right by chance "
        f"(expected {sent.refused * 2**-32:.1g}); {spent_s:.0f} s",
        flush=True,
    )
    return [f"{receiver}: {sent.chance} damaged blocks passed the CRC"] if sent.chance > 1 else []


def check_receivers(number: int, seed: int) -> list[str]:
    """Send damaged frames to both receivers of the serial line; return the defects."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        program = build(folder)
        began_s = time.perf_counter()
        sent = damage_requests(program, number, seed, write_sound(folder / "host", "host", seed))
        defects = report("the firmware's receiver", sent, time.perf_counter() - began_s)
        print(f"  the board answered {sent.answers} of the accepted, {sent.errors} of them by a refusal", flush=True)
        began_s = time.perf_counter()
        sent, received, received_intact = damage_answers(
            program, number, seed, write_sound(folder / "board", "board", seed)
        )
        defects += report("the host's receiver", sent, time.perf_counter() - began_s)
    print(f"  it accepted {received.accepted}, of them {received.repeated} as repeated, and refused {received.damaged}")
    if (received.frames, received.digest, received.repeated) != (
        received_intact.frames,
        received_intact.digest,
        received_intact.repeated,
    ):
        defects.append(f"the host heard other frames than came whole: {received}, {received_intact}")
    if received.accepted + received.damaged != sent.blocks:
        defects.append(f"the host took {received.accepted} blocks and refused {received.damaged}: {sent}")
    return defects


def check_readers(side: str, carry: Callable[[str, int, int], Counter[str]], number: int, seed: int) -> list[str]:
    """Send damaged messages of the controller's protocols to one side; return the defects."""
    defects: list[str] = []
    for name in readers():
        carry(name, min(number, WARM_UP), seed + 1)
        before, began_s = read_resident_bytes(), time.perf_counter()
        ends = carry(name, number, seed)
        growth, spent_s = read_resident_bytes() - before, time.perf_counter() - began_s
        endings = ", ".join(f"{end} {count}" for end, count in ends.most_common())
        print(
            f"{side}, {name}: {number} damaged messages: {endings}; {growth / 2**20:+.1f} MiB, {spent_s:.0f} s",
            flush=True,
        )
        if growth > GROWTH_MAX:
            defects.append(f"{side}, {name}: memory has grown by {growth / 2**20:.0f} MiB")
    return defects


def read_resident_bytes() -> int:
    """Return the resident memory of this process, bytes."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * resource.getpagesize()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=10_000_000, metavar="N", help="to each of both receivers")
    parser.add_argument("--messages", type=int, default=100_000, metavar="N", help="of each protocol, to each side")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    options = parser.parse_args()
    commit = subprocess.run(
        ["git", "-C", ROOT, "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    defects = check_receivers(options.frames, options.seed)
    defects += check_readers("the simulated controller", carry_to_world, options.messages, options.seed)
    defects += check_readers("the rig", carry_to_rig, options.messages, options.seed)
    print(
        "\n".join(defects) or "no crash, no hang, every end has its name, and nothing was accepted that should not be"
    )
    print(f"at commit {commit.stdout.strip() or 'unknown'}")
    return 1 if defects else 0


if __name__ == "__main__":
    sys.exit(main())

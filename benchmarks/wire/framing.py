"""A million frames over a line that damages them, to both receivers: `python benchmarks/wire/framing.py [frames]`.

Prints, for lines of several qualities, the numbers of damaged, accepted and lost frames. Fails if the host's receiver
or the firmware's accepts a frame that was not sent, misses an intact one, or counts a loss wrong.

The expected number of wrong frames: a damaged block that is still valid COBS is random to the CRC, so it passes a CRC
of 32 bits with a probability of at most 2⁻³²; it would pass one of 16 bits with 2⁻¹⁶.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names
from support.board.damaged_stream import Outcome, carry

FAULTS_PER_FRAME = (0.01, 0.1, 1.0)
ROUND = 50_000  # frames at a time


def list_defects(outcome: Outcome) -> list[str]:
    """Return the deviations of both receivers from the frames sent."""
    defects = []
    for name, receiver in (("host", outcome.host), ("firmware", outcome.firmware)):
        if receiver.wrong:
            defects.append(f"the {name} accepted {receiver.wrong} frames that were not sent")
        if receiver.missed:
            defects.append(f"the {name} missed {receiver.missed} frames that nothing had touched")
        if receiver.accepted != outcome.intact:
            defects.append(f"the {name} accepted {receiver.accepted} frames, {outcome.intact} came as they were sent")
        if receiver.refused != outcome.damaged:
            defects.append(f"the {name} counted {receiver.refused} damaged blocks, there were {outcome.damaged}")
    if outcome.frames_lost_by_sequence != outcome.frames_lost:
        defects.append(f"{outcome.frames_lost} frames were lost, by their sequence {outcome.frames_lost_by_sequence}")
    if outcome.samples_lost_by_sequence != outcome.samples_lost:
        defects.append(
            f"{outcome.samples_lost} samples were lost, by their sequence {outcome.samples_lost_by_sequence}"
        )
    return defects


def main(frames: int) -> int:
    failed = False
    for faults_per_frame in FAULTS_PER_FRAME:
        began_s = time.perf_counter()
        rounds = [carry(seed, ROUND, round(ROUND * faults_per_frame)) for seed in range(max(1, round(frames / ROUND)))]
        defects = [defect for outcome in rounds for defect in list_defects(outcome)]
        faults, damaged = sum(o.faults for o in rounds), sum(o.damaged for o in rounds)
        lost = sum(o.frames_lost for o in rounds)
        print(
            f"{faults_per_frame:g} faults a frame: {sum(o.sent for o in rounds)} frames sent, {faults} faults, "
            f"{damaged} damaged blocks, {lost} frames lost ({lost / faults:.3f} a fault); wrong frames: "
            f"host {sum(o.host.wrong for o in rounds)}, firmware {sum(o.firmware.wrong for o in rounds)}, "
            f"expected {damaged * 2**-32:.1g} (with 16 bits {damaged * 2**-16:.1g}); "
            f"{time.perf_counter() - began_s:.0f} s"
        )
        print("\n".join(defects) or "  every loss counted, nothing wrong, nothing missed")
        failed = failed or bool(defects)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000))

"""Full rates over the serial link without a loss: `python benchmarks/wire/throughput.py [simulated seconds]`.

The image streams from the emulated board at 921600 Bd: for 10 simulated minutes three sensors at their usual rates and
one at 952 Hz, for one minute all three as fast as they convert, raw and calibrated. Fails if a conversion is missing.
"""

import sys
import time
from pathlib import Path

from firmware_host.protocol import BAUD_RATE

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names
from support.board.full_rate import CASES, stream

BYTES_PER_S = BAUD_RATE / 10  # of the line


def main(longest_s: float) -> int:
    failed = False
    for name, (rates_hz, calibrated) in CASES.items():
        duration_s = longest_s if sum(rates_hz.values()) < 1000 else longest_s / 10
        began_s = time.perf_counter()
        result = stream(rates_hz, duration_s, calibrated)
        elapsed_s = time.perf_counter() - began_s
        load = result.bytes_sent / duration_s / BYTES_PER_S
        print(f"{name}: {duration_s:g} s, {load:.0%} of the line, {duration_s / elapsed_s:.1f} times real time")
        for part, account in result.accounts.items():
            print(
                f"  {part:10}{account.rate_hz:8.1f} Hz: {account.readings} conversions of the part, of them "
                f"{account.readings - account.samples} before the first sample, {account.samples} samples, "
                f"{account.lost} lost, {account.dropped} dropped"
            )
        for complaint in result.complaints:
            print(f"  {complaint}")
        failed = failed or bool(result.complaints)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 600.0))

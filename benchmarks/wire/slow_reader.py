"""A slow reader's effect on the simulated laboratory: `python benchmarks/wire/slow_reader.py [--pace N] [--reads N]`.

Starts the demonstration's world at N times real time. A prompt reader of the arm's states measures how fast the world's
time passes, in turns alone and together with a client that reads N times a second, so that both see the same machine.
Prints both paces, the change by the slow client, and the longest wait of the prompt reader.
"""

import argparse
import json
import socket
import struct
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path
from statistics import median

DEMO = Path(__file__).parents[2] / "configs" / "demo.yaml"
STATE = struct.Struct(">HBBd")  # size, type, recipe, time stamp


def package(kind: str, payload: bytes) -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


def reader(host: str) -> socket.socket:
    """Return a connection that receives the controller's time stamp 125 times per second of its clock."""
    client = socket.create_connection((host, 30004), 10.0)
    setup = (("V", struct.pack(">H", 2), 4), ("O", struct.pack(">d", 125.0) + b"timestamp", 10), ("S", b"", 4))
    for kind, payload, answer in setup:
        client.sendall(package(kind, payload))
        client.recv(answer, socket.MSG_WAITALL)
    return client


def measure_pace(
    prompt: socket.socket, slow: socket.socket | None, reads_hz: float, duration_s: float
) -> tuple[float, float]:
    """Return the world's seconds per wall second over `duration_s`, and the longest wait for a state, wall s."""
    times_s, read_s = [time.monotonic()], time.monotonic()
    stamps_s = []
    while times_s[-1] - times_s[0] < duration_s:
        stamps_s.append(STATE.unpack(prompt.recv(STATE.size, socket.MSG_WAITALL))[3])
        times_s.append(time.monotonic())
        if slow is not None and times_s[-1] - read_s > 1.0 / reads_hz:
            read_s = times_s[-1]
            slow.recv(1 << 22)
    longest_s = max(after - before for before, after in pairwise(times_s))
    return (stamps_s[-1] - stamps_s[0]) / (times_s[-1] - times_s[1]), longest_s


def main() -> int:
    """Print the world's pace alone and with a client that reads slowly; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pace", type=float, default=4.0, metavar="N", help="how many times as fast as real")
    parser.add_argument("--reads", type=float, default=1.0, metavar="N", help="how often a second the client reads")
    parser.add_argument(
        "--turns", type=int, default=3, metavar="N", help="turns of ten seconds, alone and with a slow reader"
    )
    options = parser.parse_args()
    command = [sys.executable, "-m", "rig.world", str(DEMO), "--until-eof"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as world:
        assert world.stdin is not None and world.stdout is not None
        ready = json.loads(world.stdout.readline())
        host, port = ready["control"].rsplit(":", 1)
        with socket.create_connection((host, int(port)), 10.0) as control:
            control.sendall(json.dumps({"do": "pace", "time_scale": options.pace}).encode() + b"\n")
            control.recv(4096)
        alone = []
        with_slow_reader = []
        with reader(ready["arm"]) as prompt:
            for _ in range(options.turns):
                alone.append(measure_pace(prompt, None, options.reads, 10.0))
                with reader(ready["arm"]) as slow:
                    with_slow_reader.append(measure_pace(prompt, slow, options.reads, 10.0))
        world.stdin.close()
    for name, turns in (("alone", alone), ("with a slow reader", with_slow_reader)):
        print(f"{name}: {median(t[0] for t in turns):.3f} times real, longest wait {max(t[1] for t in turns):.3f} s")
    change = median(after[0] / before[0] for before, after in zip(alone, with_slow_reader, strict=True)) - 1.0
    print(f"a client that reads {options.reads:g} times a second changes the pace by {change:+.2%}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

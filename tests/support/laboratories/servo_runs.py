"""Complete runs on a simulated servo in real time, and actions on them while they run."""

import json
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS
from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module

# As fast as it goes: no seconds are spared by a clock that runs faster.
QUICK: dict[str, Any] = {
    "turner": {"model": "xm430_w210", "transfer_speed_deg_s": 240, "watchdog_s": 0.5},
    "sensors": {"gyro": {"range_deg_s": 500}},
    "procedure": {"speed_deg_s": 240, "acceleration_deg_s2": 800, "rest_s": 0.8},
    "limits": {"scale_std": 0.01, "bias_std_rad_s": 0.02, "condition": 30},
}
STANDS_RAD_S = 1e-6
Act = Callable[["Seen"], None]


@dataclass(slots=True)
class Seen:
    """A run's output and end, and the shaft's true rate: times (monotonic) and rates."""

    process: "subprocess.Popen[str]"
    control_at: tuple[str, int]
    output: list[str] = field(default_factory=list)
    rates: list[tuple[float, float]] = field(default_factory=list)
    acted_s: float = 0.0

    def control(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Send one request to the laboratory, and return its reply."""
        with socket.create_connection(self.control_at, PATIENCE_S) as channel:
            channel.sendall(json.dumps(dict(request)).encode() + b"\n")
            reply: dict[str, Any] = json.loads(channel.makefile("rb").readline())
        assert reply["ok"], reply
        return reply

    def interrupt(self) -> None:
        """Send Ctrl-C."""
        self.process.send_signal(signal.SIGINT)

    @property
    def at_rest_after_s(self) -> float:
        """The time from the action to the shaft's last movement, s; the world ends soon after that."""
        moved = [time_s for time_s, rate in self.rates if abs(rate) > STANDS_RAD_S]
        return max([0.0, *(time_s - self.acted_s for time_s in moved if time_s > self.acted_s)])

    @property
    def stood(self) -> bool:
        """Whether the shaft was at rest in the end."""
        return bool(self.rates) and abs(self.rates[-1][1]) <= STANDS_RAD_S


def configure(folder: Path, changes: Mapping[str, Any] | None = None) -> Path:
    """Write configs/servo.yaml, shortened and changed, at an address of its own."""
    host = fresh_host()
    document = yaml.safe_load((CONFIGS / "servo.yaml").read_text(encoding="utf-8"))
    address = {"turner": {"port": f"socket://{host}:7323"}, "board": {"port": f"socket://{host}:7321"}}
    document = merge(merge(merge(document, QUICK), address), {"history": {"off": True}, **(changes or {})})
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "servo.yaml"
    path.write_text(yaml.safe_dump(document, sort_keys=False, allow_unicode=True), encoding="utf-8")
    return path


def carry_out(*command: str | Path, config: Path, when: str = "", times: int = 1, act: Act | None = None,
                after_s: float = 0.0) -> Seen:  # fmt: skip
    """Run `rig …` to its end; when it prints the words `when` the `times`-th time, call `act` after `after_s`."""
    document = yaml.safe_load(config.read_text(encoding="utf-8"))
    host = document["board"]["port"].removeprefix("socket://").partition(":")[0]
    process = start_module(*command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    record = Seen(process, (host, 7322))
    watching = threading.Thread(target=_watch, args=(record,), daemon=True)
    assert process.stdout is not None
    heard = 0
    for line in process.stdout:
        record.output.append(line)
        heard += bool(when) and when in line
        if act is not None and heard == times and not record.acted_s:
            watching.start()
            time.sleep(after_s)
            record.acted_s = time.monotonic()
            act(record)
    process.stdout.close()
    process.wait(PATIENCE_S)
    if record.acted_s:
        watching.join(PATIENCE_S)
    return record


def _watch(record: Seen) -> None:
    """Follow the shaft's speed until the laboratory has ended."""
    try:
        with socket.create_connection(record.control_at, PATIENCE_S) as channel:
            replies = channel.makefile("rb")
            while True:
                channel.sendall(b'{"do": "state"}\n')
                state = json.loads(replies.readline())
                record.rates.append((time.monotonic(), state["rate_rad_s"]))
                time.sleep(0.01)
    except (OSError, ValueError):
        return

"""A session by hand played to the board's core: readings in, reports of every move and the solution out."""

import ctypes
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from firmware_host.frames import Frame
from firmware_host.hand_answers import BoardHandSolution, HandReport
from rig.analysis.by_hand.on_board import BoardReadings, HandAgreement, compare_with_board
from rig.estimation.arrays import Array
from support.board.host_board import HostBoard, configure
from support.external.handled_body import Recorded

RANGE_DEG_S, RANGE_G = 500.0, 4.0
POLLED_US = 200_000


class CReading(ctypes.Structure):
    """`struct reading` of core/drivers/sensor.h."""

    _fields_ = (("counts", ctypes.c_int16 * 3), ("acceleration", ctypes.c_int16 * 3), ("temperature", ctypes.c_int16))


@dataclass(frozen=True)
class Played:
    """The readings of a session, and the board's answers: a report of each judged move, and the solution."""

    times_us: np.ndarray
    rates: Array
    reports: list[HandReport]
    solved: BoardHandSolution

    @property
    def outcomes(self) -> list[str]:
        return [report.outcome for report in self.reports]

    @property
    def scale(self) -> Array:
        """The scale factors k (3,) of g = K (m + b)."""
        return np.asarray(1 / np.linalg.norm(np.linalg.inv(np.array(self.solved.matrix)), axis=1))

    @property
    def agreement(self) -> HandAgreement:
        return compare_with_board(self.readings, self.reports, self.solved)

    @property
    def readings(self) -> BoardReadings:
        """The readings as the host would have received them."""
        return BoardReadings(self.times_us, np.arange(len(self.times_us)), self.rates, 1e-6)


def begun(rate_hz: float = 119.0, moves: int = 12, scale_std: float = 1e-3) -> tuple[HostBoard, dict[str, Any]]:
    """Return a board that calibrates its LSM9DS1 by hand from now on, and the sensor's setup."""
    board = HostBoard()
    setup = configure(board, 0, rate_hz, RANGE_DEG_S, RANGE_G)
    (answer,) = board.ask("by_hand", sensor=0, moves=moves, scale_std=scale_std)
    assert answer.name == "ack"
    return board, setup


def query(board: HostBoard, name: str) -> Frame:
    """Return the answer to a request without fields."""
    (answer,) = (frame for frame in board.ask(name, 7) if frame.values.get("reply_to") == 7)
    return answer


def convert_to_counts(recorded: Recorded, setup: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times in µs, rates and accelerations in the part's counts."""
    rates, forces = (
        np.clip(np.round(values / per_count), -32768, 32767).astype(np.int16)
        for values, per_count in (
            (recorded.rates, setup["sensitivity_rad_s"]),
            (recorded.acceleration, setup["sensitivity_m_s2"]),
        )
    )
    return np.round(1e6 * recorded.time_s).astype(np.int64), rates, forces


def give(board: HostBoard, time_us: int, number: int, rate: np.ndarray, force: np.ndarray) -> None:
    """Pass one reading to the board."""
    reading = CReading((ctypes.c_int16 * 3)(*rate.tolist()), (ctypes.c_int16 * 3)(*force.tolist()), 0)
    board.core.hand_add(0, ctypes.c_uint64(time_us), number, ctypes.byref(reading))


def play(recorded: Recorded, moves: int = 12, scale_std: float = 1e-3, number: np.ndarray | None = None) -> Played:
    """Play a whole recording, whose readings have the numbers `number`; the host asks for reports 5 times a second."""
    board, setup = begun(1 / float(np.median(np.diff(recorded.time_s))), moves, scale_std)
    times_us, counts, forces = convert_to_counts(recorded, setup)
    numbers = np.arange(len(times_us)) if number is None else number
    reports: list[HandReport] = []
    asked_us = 0
    for time_us, sample_number, rate, force in zip(times_us.tolist(), numbers.tolist(), counts, forces, strict=True):
        give(board, time_us, sample_number, rate, force)
        if time_us >= asked_us + POLLED_US:
            asked_us = time_us
            report = HandReport.decode(query(board, "hand_status"))
            if report.judged > len(reports):
                reports.append(report)
    solved = BoardHandSolution.decode(query(board, "hand_solve"))
    return Played(times_us, counts * setup["sensitivity_rad_s"], reports, solved)


@contextmanager
def serve(board: HostBoard) -> Iterator[str]:
    """Serve a board's serial line as a `socket://` port; only one client may use it in the `with` block."""
    ended = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.02)

        def serve() -> None:
            while not ended.is_set():
                try:
                    host, _ = server.accept()
                except TimeoutError:
                    continue
                with host:
                    host.settimeout(0.02)
                    _answer(board, host, ended)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"socket://127.0.0.1:{server.getsockname()[1]}"
        finally:
            ended.set()
            thread.join()


def _answer(board: HostBoard, host: socket.socket, ended: threading.Event) -> None:
    """Pass on the host's bytes until it hangs up."""
    while not ended.is_set():
        try:
            heard = host.recv(4096)
        except TimeoutError:
            continue
        except ConnectionError:
            return
        if not heard:
            return
        board.receive(heard)
        answer = bytes(board.wire)
        board.wire.clear()
        host.sendall(answer)


def press(board: HostBoard, begin_us: int, lasts_us: int = 60_000) -> None:
    """Press the button for `lasts_us`, while the main loop runs."""
    board.core.host_press(True)
    for time_us in range(begin_us, begin_us + lasts_us, 5_000):
        board.set_time(time_us)
        board.run()
    board.core.host_press(False)
    board.run()


def alone(*, locked: bool = True) -> HostBoard:
    """Return a board without any request from a host."""
    board = HostBoard()
    board.core.host_lock_clock(locked)
    return board


def run_button_session(recorded: Recorded) -> HostBoard:
    """Return a board after a session started by its button, as recorded, without a computer."""
    board = alone()
    press(board, 100_000)
    setup = {"sensitivity_rad_s": np.radians(0.0175), "sensitivity_m_s2": 0.244e-3 * 9.80665}
    times_us, counts, forces = convert_to_counts(recorded, setup)
    for number, (time_us, rate, force) in enumerate(zip(times_us.tolist(), counts, forces, strict=True)):
        give(board, 200_000 + time_us, number, rate, force)
    return board

"""The simulated operator's ears: what the one at the rig is told by hand goes to the laboratory."""

import json
import socket

from rig.commands.laboratory.laboratory import MOUNT_TIMEOUT_S
from rig.data.recording.hand_events import HandAsked
from rig.station.events import RunEvent


class SimulatedOperator:
    """A listener of a run: hands on to the laboratory's operator what the one at the rig is told to do by hand.

    The line of text and the drawing are made of the same: what to do, and with which side up. Nothing else is told.
    """

    def __init__(self, control: str) -> None:
        """`control` is the laboratory's control channel."""
        host, _, port = control.rpartition(":")
        self._address = host, int(port)

    def event(self, event: RunEvent) -> None:
        """Take an event, as a Listener does. Raises OSError where the laboratory is gone."""
        if isinstance(event, HandAsked):
            asked = event.instruction
            told = {"do": "instruct", "say": asked.say, "face": asked.face, "turns": asked.turns}
            told["again"] = event.again is not None
            with socket.create_connection(self._address, MOUNT_TIMEOUT_S) as channel:
                channel.sendall(json.dumps(told).encode() + b"\n")
                channel.makefile("rb").readline()

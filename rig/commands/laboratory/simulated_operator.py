"""The simulated operator, who receives the instructions of a session by hand."""

from rig.commands.laboratory.laboratory_process import send_request
from rig.data.recording.hand_events import HandAsked
from rig.station.events import RunEvent


class OperatorListener:
    """A listener of a run that passes instructions by hand on to the laboratory's operator.

    The operator receives only the content of the line of text and the drawing: the motion, and the side that points up.
    """

    def __init__(self, control: str) -> None:
        """Connect to the laboratory's control channel `control` for each instruction."""
        self._control = control

    def event(self, event: RunEvent) -> None:
        """Handle an event, as a Listener does. Raise OSError or ValueError if the laboratory has ended."""
        if isinstance(event, HandAsked):
            instruction = event.instruction
            request = {"do": "instruct", "say": instruction.say, "face": instruction.face, "turns": instruction.turns}
            request["again"] = event.again is not None
            send_request(self._control, request)

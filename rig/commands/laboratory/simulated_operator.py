"""The link from a run to the simulated operator, who turns the item by hand as instructed."""

from rig.commands.laboratory.laboratory_process import send_request
from rig.data.recording.hand_events import HandAsked
from rig.station.events import RunEvent


class OperatorListener:
    """A listener of a run that passes its instructions on to the simulated operator.

    The operator receives only what a person reads in the text and the drawing: the motion, and the side that points up.
    """

    def __init__(self, control: str) -> None:
        """Connect to the simulated laboratory's control channel `control` for each instruction."""
        self._control = control

    def event(self, event: RunEvent) -> None:
        """Handle an event, as a Listener does. Raise OSError or ValueError if the laboratory has ended."""
        if isinstance(event, HandAsked):
            instruction = event.instruction
            request = {"do": "instruct", "say": instruction.say, "face": instruction.face, "turns": instruction.turns}
            request["again"] = event.again is not None
            send_request(self._control, request)

"""Changes parameters of an autopilot: entered in the journal first, then written one by one, then read back."""

from collections.abc import Iterator, Mapping

from rig.sensors.errors import SensorError
from rig.sensors.mavlink.journal import Change, begun
from rig.sensors.mavlink.link import Link
from rig.sensors.mavlink.parameters import Parameter


def place_of(link: Link) -> str:
    """The mark by which an autopilot is known again: its own number, its port where it tells none."""
    return link.known.uid or link.port


def change(link: Link, planned: Change, to: Mapping[str, Parameter]) -> None:
    """Bring an autopilot to one of the two sets of a change.

    Raises SensorError as `Link.set_parameter`, and `autopilot_not_stored` where it reads back something else; then and
    after any other end the journal still tells of it. Raises Refused as `Change.begin`.
    """
    planned.begin()
    for parameter in to.values():
        link.set_parameter(parameter)
    found = link.parameters(to)
    wrong = [name for name, each in to.items() if name not in found or found[name].field != each.field]
    if wrong:
        raise SensorError(
            "autopilot_not_stored",
            f"the autopilot at {link.port} reads back other values than were written of {', '.join(wrong)}",
            f"Restore the old ones: rig autopilot restore CONFIG {planned.kept}",
        )
    planned.end()


def unfinished(link: Link) -> Iterator[SensorError]:
    """A change of this autopilot that was begun and left between the sets, `autopilot_mixture`.

    One that ended before the first parameter or after the last is taken out of the journal. Raises Refused as `begun`.
    """
    left = begun(place_of(link))
    if left is None:
        return
    found = link.parameters(left.old)
    if left.state(found) != "mixture":
        left.end()
        return
    new = [name for name, each in left.new.items() if name in found and found[name].field == each.field]
    yield SensorError(
        "autopilot_mixture",
        f"the autopilot at {link.port} holds a mixture: writing its parameters was broken off after {len(new)} of "
        f"{len(left.new)}",
        f"Bring it to the old ones: rig autopilot restore CONFIG {left.kept}, or to the new ones: the same with --new",
    )

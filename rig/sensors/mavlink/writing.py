"""Changes of an autopilot's parameters: entered in the journal, written one by one, read back."""

from collections.abc import Iterator, Mapping

from rig.sensors.errors import SensorError
from rig.sensors.mavlink.autopilot_link import AutopilotLink
from rig.sensors.mavlink.parameter_encoding import AutopilotParameter
from rig.sensors.mavlink.parameter_journal import ParameterChange, find_change


def autopilot_id(link: AutopilotLink) -> str:
    """Return the identifier of an autopilot: its unique number, or else its port."""
    return link.identity.uid or link.port


def change(link: AutopilotLink, planned: ParameterChange, target: Mapping[str, AutopilotParameter]) -> None:
    """Write the parameters `target` to an autopilot: the old or the new ones of a planned change.

    Raise SensorError as `AutopilotLink.set_parameter` does, and `autopilot_not_stored` if another value is read back;
    the journal then still holds the change. Raise Refused as `ParameterChange.begin` does.
    """
    planned.begin()
    for parameter in target.values():
        link.set_parameter(parameter)
    actual = link.parameters(target)
    wrong = [name for name, parameter in target.items() if name not in actual or actual[name].field != parameter.field]
    if wrong:
        raise SensorError(
            "autopilot_not_stored",
            f"the autopilot at {link.port} reads back other values than those written for {', '.join(wrong)}",
            f"Restore the old ones: rig autopilot restore CONFIG {planned.backup}",
        )
    planned.end()


def find_unfinished_change(link: AutopilotLink) -> Iterator[SensorError]:
    """Yield the error `autopilot_mixture` if a change of this autopilot's parameters stopped half-way.

    A change that stopped before the first parameter or after the last is removed from the journal. Raise as
    `find_change` does.
    """
    begun = find_change(autopilot_id(link))
    if begun is None:
        return
    values = link.parameters(begun.old)
    if begun.state(values) != "mixture":
        begun.end()
        return
    new = [name for name, parameter in begun.new.items() if name in values and values[name].field == parameter.field]
    yield SensorError(
        "autopilot_mixture",
        f"the autopilot at {link.port} holds a mixture: writing its parameters was broken off after {len(new)} of "
        f"{len(begun.new)}",
        f"Bring it to the old ones: rig autopilot restore CONFIG {begun.backup}, or to the new ones: the "
        "same with --new",
    )

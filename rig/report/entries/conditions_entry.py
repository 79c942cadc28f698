"""The conditions of a value as an entry of `result.json`."""

from rig.analysis.measurement_conditions import When
from rig.data.entries.result_types import ConditionsEntry
from rig.report.entry import entry


def when_entry(when: When) -> ConditionsEntry:
    """Return time and temperature of a value, times to the second."""
    times = {name: getattr(when, name).isoformat(timespec="seconds") for name in ("from_utc", "to_utc", "mean_utc")}
    return entry(ConditionsEntry, when, **times)

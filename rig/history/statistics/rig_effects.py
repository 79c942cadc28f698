"""What a rig adds to every result, told apart from what each sensor is: by sensors calibrated on several rigs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.history.statistics.random_effects import fit


@dataclass(frozen=True, slots=True)
class RigEffect:
    """What `rig` finds more than `reference` does of the same sensors, with its std and Student's factor for 95 %."""

    rig: str
    reference: str
    value: float
    std: float
    coverage_factor: float
    between_std: float
    sensors: int

    @property
    def expanded(self) -> float:
        """Expanded uncertainty of the effect, for 95 %."""
        return self.coverage_factor * self.std


def rig_effects(rigs: Sequence[str], sensors: Sequence[str], values: Array, std: Array) -> tuple[RigEffect, ...]:
    """The effects of rigs on results (n,) with stds (n,), each by one of `rigs` (n) of one of `sensors` (n).

    The two-way model value = sensor + rig + run, runs random (`random_effects.fit`). Within each group of rigs that
    sensors connect, the effects are relative to the rig with the most results; a rig that shares no sensor has none.
    """
    found: list[RigEffect] = []
    names = np.array(rigs)
    for group in _connected(rigs, sensors):
        of_rig = [rig for rig in dict.fromkeys(rigs) if rig in group]
        if len(of_rig) < 2:
            continue
        reference = max(of_rig, key=lambda rig: int(np.sum(names == rig)))
        others = [rig for rig in of_rig if rig != reference]
        rows = np.flatnonzero(np.isin(names, of_rig))
        subjects = np.array(sensors)[rows]
        subject_names = list(dict.fromkeys(subjects.tolist()))
        design = np.column_stack(
            [names[rows] == rig for rig in others] + [subjects == name for name in subject_names]
        ).astype(np.float64)
        if len(rows) <= design.shape[1]:
            continue
        fitted = fit(design, values[rows], std[rows])
        for i, rig in enumerate(others):
            shared = len(set(subjects[names[rows] == rig]) & set(subjects[names[rows] != rig]))
            value, of_value = float(fitted.coefficients[i]), float(fitted.std[i])
            found.append(RigEffect(rig, reference, value, of_value, fitted.coverage_factor, fitted.between_std, shared))
    return tuple(found)


def _connected(rigs: Sequence[str], sensors: Sequence[str]) -> list[set[str]]:
    """Groups of rigs between which a way leads over sensors that they share."""
    rig_names, sensor_names = list(dict.fromkeys(rigs)), list(dict.fromkeys(sensors))
    nodes = len(rig_names) + len(sensor_names)
    rows = [rig_names.index(rig) for rig in rigs]
    columns = [len(rig_names) + sensor_names.index(sensor) for sensor in sensors]
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(nodes, nodes))
    _, labels = connected_components(graph, directed=False)
    groups: dict[int, set[str]] = {}
    for rig, label in zip(rig_names, labels, strict=False):
        groups.setdefault(int(label), set()).add(rig)
    return list(groups.values())

"""Effects of rigs on results, separated from the effects of sensors by sensors that several rigs have calibrated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.history.statistics.random_effects import fit


@dataclass(frozen=True, slots=True)
class RigEffect:
    """The mean difference of `rig` from the rig `reference` for the same sensors, with its standard deviation.

    `coverage_factor` is Student's t for 95 %. `between_std` is the scatter between runs. `sensors` is the number of
    sensors that `rig` shares with other rigs.
    """

    rig: str
    reference: str
    value: float
    std: float
    coverage_factor: float
    between_std: float
    sensors: int

    @property
    def expanded(self) -> float:
        """The expanded uncertainty of the effect, for 95 %."""
        return self.coverage_factor * self.std


def rig_effects(rigs: Sequence[str], sensors: Sequence[str], values: Array, std: Array) -> tuple[RigEffect, ...]:
    """Return the effects of rigs on results: result i has `values[i]` and `std[i]`, from `rigs[i]` and `sensors[i]`.

    The two-way model is value = sensor + rig + run, where the runs' effects are random (`random_effects.fit`). Within
    each group of rigs connected by shared sensors, effects are relative to the rig with the most results. Rigs that
    share no sensor, and groups with too few results, are left out.
    """
    effects: list[RigEffect] = []
    names = np.array(rigs)
    for group in _find_connected_groups(rigs, sensors):
        group_rigs = [rig for rig in dict.fromkeys(rigs) if rig in group]
        if len(group_rigs) < 2:
            continue
        reference = max(group_rigs, key=lambda rig: int(np.sum(names == rig)))
        others = [rig for rig in group_rigs if rig != reference]
        rows = np.flatnonzero(np.isin(names, group_rigs))
        subjects = np.array(sensors)[rows]
        subject_names = list(dict.fromkeys(subjects.tolist()))
        # Columns: one for each rig except the reference, then one for each sensor.
        design = np.column_stack(
            [names[rows] == rig for rig in others] + [subjects == name for name in subject_names]
        ).astype(np.float64)
        if len(rows) <= design.shape[1]:
            continue
        fitted = fit(design, values[rows], std[rows])
        for i, rig in enumerate(others):
            shared = len(set(subjects[names[rows] == rig]) & set(subjects[names[rows] != rig]))
            value, value_std = float(fitted.coefficients[i]), float(fitted.std[i])
            effects.append(
                RigEffect(rig, reference, value, value_std, fitted.coverage_factor, fitted.between_std, shared)
            )
    return tuple(effects)


def _find_connected_groups(rigs: Sequence[str], sensors: Sequence[str]) -> list[set[str]]:
    """Return groups of rigs that are connected by shared sensors."""
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

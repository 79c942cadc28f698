"""The readings of a sensor in known attitudes: the equations that all methods of `triaxial` solve."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.external.inverted import solve_unless_inverted
from rig.data.quantity import ACCELERATION, Quantity
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt_each
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import Dwells
from rig.estimation.reference.attitude_error import AttitudeReadings
from rig.estimation.reference.reference_model import KnownNorm, KnownVector, ReferencePrior
from rig.estimation.reference.triaxial import Method, TriaxialSolution, solve_triaxial
from rig.observation.external.attitude_import import PlacedReadings, Rows
from rig.observation.external.placements import Placements


@dataclass(frozen=True, slots=True)
class Equations:
    """The mean readings of a sensor, and the attitudes in which they were taken.

    - `means`, `variances` (N, 3): the means and their variances; `dof` (N, 3): degrees of freedom of the variances.
    - `attitudes` (N, 3, 3); `std_rad` (N,): their stated standard deviations, None if not stated.
    - `reference`: the norm of a constant reference, or, for a gyroscope, the rates (N, 3) of the table.
    - `second_order`: whether quadratic terms are estimated.
    """

    means: Array
    variances: Array
    attitudes: Array
    std_rad: Array | None
    reference: ReferencePrior
    dof: Array
    second_order: bool = False

    @staticmethod
    def from_rows(placed: PlacedReadings, *, exact_rates: bool) -> "Equations":
        """Return a gyroscope's equations, with the rates that its reference states.

        Raise Fault `no_rates` unless rates are stated and are exact; `too_few_observations` if their noise is unknown.
        """
        rows = placed.rows
        if isinstance(rows, Fault):
            raise rows
        if rows is None or rows.rates_rad_s is None or not exact_rates:
            raise Fault(
                "no_rates",
                "the attitudes do not state how the table turned, or not that this is exact",
                "Use increments, which need no rates; or give the columns rate_x_rad_s, rate_y_rad_s, rate_z_rad_s "
                "in body coordinates, with --exact-rates where their noise is far below the sensor's",
            )
        reference = KnownVector(rows.rates_rad_s)
        if rows.variances is None or rows.dof is None:
            variances, dof = _estimate_variances(rows, reference)
        else:
            variances, dof = rows.variances, rows.dof
        return Equations(rows.means, variances, rows.attitudes, rows.attitude_std_rad, reference, dof)

    @staticmethod
    def from_placements(
        placements: Placements, quantity: Quantity, reference: KnownNorm, *, second_order: bool
    ) -> "Equations":
        """Return the equations of a sensor that measures a constant reference, such as gravity, at rest."""
        return Equations(
            placements.read.means[quantity],
            placements.read.variances[quantity],
            placements.attitudes,
            placements.attitude_std_rad,
            reference,
            placements.read.dof[quantity],
            second_order and quantity == ACCELERATION,
        )

    @property
    def measurements(self) -> Dwells:
        """The means with their variances and attitudes."""
        return Dwells(self.means, self.variances, self.attitudes)

    @property
    def placed(self) -> AttitudeReadings:
        """The mean readings with their attitudes, in a constant reference of known norm."""
        std_rad = np.zeros(len(self.means)) if self.std_rad is None else self.std_rad
        nothing = np.zeros_like(self.means)
        return AttitudeReadings(self.means, self.variances, self.attitudes, nothing, std_rad, norm_known=True)

    def solve(self, method: Method) -> TriaxialSolution:
        """Return the solution. Raise Fault `inverted_attitudes`, and what `solve_triaxial` raises."""
        return solve_unless_inverted(self.attitudes, partial(self._solve, method), ["attitude_untrustworthy"])

    def _solve(self, method: Method, attitudes: Array) -> TriaxialSolution:
        return solve_triaxial(
            self.means,
            attitudes,
            self.variances,
            self.reference,
            second_order=self.second_order,
            method=method,
            attitude_std_rad=self.std_rad,
        )

    def solve_others(self, method: Method, *others: Method) -> Attempts[Method, TriaxialSolution]:
        """Return the solution by each of the `others` that is not `method`, or the Fault if there is no solution."""
        return attempt_each({other: partial(self.solve, other) for other in others if other != method})


def _estimate_variances(rows: Rows, reference: KnownVector) -> tuple[Array, Array]:
    """Return the variances (N, 3) of the means, and the degrees of freedom (N, 3) of these variances.

    All samples of an axis have one variance, which follows from the residuals of a fit without attitude errors. Raise
    Fault `too_few_observations` if there are too few rows to determine it.
    """
    counts = rows.samples[:, None]
    quiet = np.full_like(rows.means, (1e-9 * np.abs(rows.means).max()) ** 2) / counts
    residuals = solve_triaxial(rows.means, rows.attitudes, quiet, reference).residuals
    dof = len(rows.means) - 15 / 3
    if dof < 1:
        raise Fault(
            "too_few_observations",
            f"{len(rows.means)} rows of few samples do not show their noise",
            "Give longer rows, or more of them",
        )
    variances: Array = np.maximum(np.sum(residuals**2 * counts, axis=0) / dof, 1e-30) / counts
    return variances, np.full_like(variances, dof)

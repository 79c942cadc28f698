"""The table of the attributes of analysis results that fill the entries of `result.json`.

A row names the classes that it reads and, for each field of the entry, the attribute that fills it. Classes are given
by name, so that writing one entry does not import the analysis of all others. The function that builds an entry sets
the fields that no row names. Because of this table, an attribute may be renamed without a change of `result.json`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from pydantic import BaseModel

from rig.data import result_file as result
from rig.data.entries import accelerometer, budget, magnetometer, temperature
from rig.data.entries import by_hand as hand
from rig.data.entries import external as attitude
from rig.data.entries import result_types as shared
from rig.data.entries.earth_rate import EarthRateEntry


@dataclass(frozen=True, slots=True)
class Row:
    """A row of the table: `attributes` has, by field of an entry, the attribute of `classes` that fills the field."""

    classes: tuple[str, ...]
    attributes: Mapping[str, str]


def _row(*classes: str, same: str = "", **renamed: str) -> Row:
    """Return the row of `classes`, whose attributes fill the fields of an entry.

    `same` lists the fields that have the attribute's name; `renamed` has the attributes of other fields, by field.
    """
    return Row(classes, {**{name: name for name in same.split()}, **renamed})


# Classes with the fields of `Estimate`.
_ESTIMATES = ("VectorSolution", "TurnedSolution", "Solution", "LevenbergMarquardtSolution")
_ESTIMATE = "estimator iterations scale bias_rad_s covariance rank condition"
_ITEM = _row("RecordedSensor", "Item", same="part serial_number")
_TRIAD = _row("Triad", same="scale covariance non_orthogonality_rad non_orthogonality_std_rad correction_matrix")
_TRIAXIAL = _row("TriaxialSolution", same="matrix rank condition warnings")
_OTHER_METHOD = _row("TriaxialSolution", same="method matrix rank condition")
_MEAN = _row("Mean", same="samples")

SOURCES: Final[Mapping[type[BaseModel], tuple[Row, ...]]] = {
    result.CheckEntry: (
        _row(
            "Check",
            same="name value limit unit passed uncertainty coverage_factor",
            guard_band="guard",
            false_acceptance_probability="false_acceptance",
        ),
    ),
    result.GyroscopeEntry: (
        _row("RecordedSensor", "Item", same="part serial_number range_rad_s"),
        _row("SensorResult", same="temperature_c correction correction_matrix"),
        _row(*_ESTIMATES, same=_ESTIMATE),
    ),
    result.EstimateEntry: (_row(*_ESTIMATES, same=_ESTIMATE, observations_used="observations"),),
    result.VectorEntry: (
        _row(
            "VectorSolution",
            "TurnedSolution",
            same=f"{_ESTIMATE} matrix matrix_covariance non_orthogonality_rad mounting residuals_rad_s warnings",
            observations_used="observations",
        ),
    ),
    result.NonlinearityEntry: (
        _row("Nonlinearity", same="odd_per_rad_s odd_std_per_rad_s even_per_rad_s even_std_per_rad_s"),
    ),
    result.AverageEntry: (_row("Average", same="mean_rad_s mean_std_rad_s noise_rad_s samples duration_s"),),
    result.ObservationEntry: (
        _row(
            "Observation",
            same="sweep direction axis sign axis_flange speed_rad_s angle_rad speed_std_rad_s",
            joint="joint_name",
            lost_samples="lost",
        ),
        _row("Average", same="mean_rad_s mean_std_rad_s noise_rad_s samples duration_s"),
    ),
    result.TimeBaseEntry: (
        _row("TimeBase", same="offset_s offset_std_s drift drift_std", reference_board_s="reference_s"),
    ),
    result.BoardEntry: (
        _row("Agreement", same="not_observed host_scale host_bias_rad_s scale_difference bias_difference_rad_s"),
    ),
    result.BoardSolutionEntry: (
        _row("BoardSolved", same="sensor"),
        _row("BoardSolution", same="method status observations iterations scale bias_rad_s"),
    ),
    result.VerificationEntry: (_row("Verification", same="reference_error_rad_s"),),
    result.RotationEntry: (
        _row("RelativeRotation", same="matrix vector_rad from_nominal_rad std_rad residuals_rad_s"),
    ),
    result.ComparisonEntry: (_row("Comparison", same="noise_rad_s delay_s delay_std_s"),),
    result.DeviationEntry: (_row("Deviation", same="samples mean_rad_s rms_rad_s mse_rad2_s2 max_rad_s"),),
    result.RevolutionErrorEntry: (
        _row(
            "RevolutionError", same="sweep direction error_rad_s std_rad_s gravity_rad_s angle_rad", joint="joint_name"
        ),
    ),
    accelerometer.AccelerometerEntry: (
        _row(
            "AccelerometerResult",
            same="gravity_m_s2 bias_m_s2 lever_arm_m lever_arm_std_m sweeps temperature_c correction_matrix",
        ),
        _row("AttitudeCalibration"),
        _ITEM,
        _TRIAD,
        _row("ImuSolution", same="matrix second_order_s2_m reference_m_s2 delay_s rank condition warnings"),
        _TRIAXIAL,
    ),
    accelerometer.AccelerationSolutionEntry: (_OTHER_METHOD,),
    accelerometer.DwellEntry: (
        _row("DwellReading", same="index name attitude temperature_c"),
        _row("StaticReading", same="index name attitude"),
        _MEAN,
    ),
    accelerometer.AlignmentEntry: (_row("Alignment", rotation_rad="vector_rad"),),
    magnetometer.MagnetometerEntry: (
        _row("MagnetometerResult", same="extension_m field_t"),
        _row("AttitudeCalibration"),
        _ITEM,
        _TRIAD,
        _TRIAXIAL,
    ),
    magnetometer.FieldSolutionEntry: (_OTHER_METHOD,),
    magnetometer.FieldDwellEntry: (_row("DwellReading", "StaticReading", same="index name attitude"), _MEAN),
    magnetometer.UniformityEntry: (_row("Uniformity", same="chi_square degrees_of_freedom limit attitude_error_rad"),),
    magnetometer.FieldDriftEntry: (_row("FieldDrift", same="change_t std_t chi_square limit"),),
    magnetometer.ReversalEntry: (
        _row("Reversal", same="bias_t arm_field_in_bias arm_field_t covariance chi_square degrees_of_freedom limit"),
        _row("MagnetometerReversal", same="scale scale_std correction_matrix"),
        _ITEM,
    ),
    magnetometer.AsMountedEntry: (_row("ReversalRun", same="run"), _row("RecordedSensor", same="mounting")),
    attitude.IncrementsEntry: (
        _row(
            "IncrementSolution",
            same="matrix_scatter bias_scatter_rad_s",
            clock_offset_s="clock_s",
            clock_offset_std_s="clock_std_s",
            attitude_std_rad="fix_std_rad",
            angle_random_walk_rad_sqrt_s="random_walk_rad_sqrt_s",
            rejected="set_aside",
        ),
        _row("IncrementCalibration", same="window_s"),
    ),
    attitude.RateSolutionEntry: (_row("TriaxialSolution", same="rank condition"),),
    budget.ContributorEntry: (_row("Contributor", same="name kind distribution half_width unit source std"),),
    budget.BudgetEntry: (_row("Budget", same="std expanded coverage_factors"),),
    budget.BiasProcessEntry: (
        _row(
            "BiasProcess", same="scatter_rad_s", random_walk_rad_s_sqrt_s="walk_rad_s_sqrt_s", degrees_of_freedom="dof"
        ),
    ),
    budget.ClockEntry: (_row("ClockCheck", same="error std"),),
    budget.ClockComparisonEntry: (_row("ClockComparison", same="error std", clock="by"),),
    hand.RestByHandEntry: (_row("RestSummary", same="face normalised_residual"),),
    hand.MoveByHandEntry: (
        _row("MoveSummary", same="kind angle_rad turns normalised_residual", closure_error_rad="closure_rad"),
    ),
    shared.ConditionsEntry: (_row("Conditions", same="temperature_c temperature_range_c"),),
    shared.DetectionLimitEntry: (
        _row("DetectionLimit", same="check unit", fault="what", error_over_expanded="off_by_expanded"),
    ),
    shared.OmittedEntry: (_row("Omitted", same="what count total reason first"),),
    temperature.OverTemperatureEntry: (
        _row("OverTemperature", same="reference_c range_c orders scale lag_s lag_std_s repeats"),
    ),
    temperature.TemperatureContributorEntry: (_row("TemperatureLine", same="name kind distribution source"),),
    temperature.AtTemperatureEntry: (),
    EarthRateEntry: (
        _row(
            "EarthRate",
            same="rate_rad_s covariance_rad2_s2 norm_rad_s norm_std_rad_s latitude_rad latitude_std_rad heading_rad "
            "heading_std_rad up vertical_fixed birge_ratio",
            degrees_of_freedom="dof",
        ),
    ),
}

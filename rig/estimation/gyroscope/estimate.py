"""The common part of the results of all gyroscope estimators."""

from typing import Protocol, runtime_checkable

from rig.estimation.arrays import Array


@runtime_checkable
class Estimate(Protocol):
    """A solution of rate = scale × (reading + bias_rad_s); covariance (6, 6) of scale (3,), then bias_rad_s (3,)."""

    @property
    def estimator(self) -> str: ...
    @property
    def scale(self) -> Array: ...
    @property
    def bias_rad_s(self) -> Array: ...
    @property
    def covariance(self) -> Array: ...
    @property
    def observations(self) -> int: ...
    @property
    def rank(self) -> int: ...
    @property
    def condition(self) -> float: ...
    @property
    def iterations(self) -> int: ...

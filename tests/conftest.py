"""What every test has: simulated laboratories, and a Hypothesis without a stopwatch."""

from hypothesis import settings

from support.worlds import world

__all__ = ["world"]

settings.register_profile("rig", deadline=None)  # a shared machine stalls now and then, which is no failure
settings.load_profile("rig")

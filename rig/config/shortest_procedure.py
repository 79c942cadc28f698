"""`procedure: {name: shortest, wanted: …}`: six observations, repeated until the uncertainty is what is wanted."""

from collections.abc import Mapping
from typing import Any

SHORTEST = "shortest"
WANTED: Mapping[str, str] = {"scale": "wanted_scale_u", "bias": "wanted_bias_u_rad_s"}
REPEATS = 16  # at most, where the section says nothing


def wrong_wish(section: Mapping[str, Any]) -> str | None:
    """What is wrong with what such a section says of `wanted`, None if nothing is."""
    wanted = section.get("wanted")
    if isinstance(wanted, dict) and wanted and not wanted.keys() - WANTED.keys():
        return None
    return "must say the expanded uncertainty at which the run ends, as {scale: 1e-3, bias: 1e-4} or one of them"


def written_out(section: Mapping[str, Any]) -> dict[str, Any]:
    """The section of the procedure that is carried out: the keys that stand beside the name and the wish stay."""
    rest = {key: value for key, value in section.items() if key != "wanted"}
    ends = {WANTED[size]: value for size, value in section["wanted"].items()}
    return {"repeats": REPEATS, **ends, **rest, "name": "six_observation"}

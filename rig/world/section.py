"""The `world:` section, read by the one program that uses what it says."""

import yaml

from rig.config.load import Loaded
from rig.config.world_models import WorldSection
from rig.errors import Refused


def world_section(loaded: Loaded) -> WorldSection:
    """What a configuration says of the simulated laboratory. Raises `Refused` `no_world` when it says nothing."""
    if not loaded.simulated:
        raise Refused(
            "no_world",
            "the configuration has no world: section, so there is nothing to simulate",
            "Name a file with a world: section, for example configs/demo.yaml",
        )
    return WorldSection.model_validate(yaml.safe_load(loaded.text)["world"])

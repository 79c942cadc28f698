"""The `world:` section, read by the one program that uses what it says."""

import yaml

from rig.config.load import Loaded
from rig.config.world.laboratory import WorldSection
from rig.errors import Refused


def world_section(loaded: Loaded) -> WorldSection:
    """What a configuration says of the simulated laboratory; a sensor that has no place sits where all do.

    Raises `Refused` `no_world` when it says nothing.
    """
    if not loaded.simulated:
        raise Refused(
            "no_world",
            "the configuration has no world: section, so there is nothing to simulate",
            "Name a file with a world: section, for example configs/demo.yaml",
        )
    world = WorldSection.model_validate(yaml.safe_load(loaded.text)["world"])
    there = {"offset_mm": tuple(1000 * each for each in loaded.config.turner.extension_m)}
    sensors = {
        name: each if "offset_mm" in each.model_fields_set else each.model_copy(update=there)
        for name, each in world.sensors.items()
    }
    return world.model_copy(update={"sensors": sensors})

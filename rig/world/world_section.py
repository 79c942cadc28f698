"""The `world:` section, which only the simulated laboratory reads."""

import yaml

from rig.config.load import Loaded
from rig.config.world.laboratory import WorldSection
from rig.errors import Refused


def read_world_section(loaded: Loaded) -> WorldSection:
    """Return the section of the simulated laboratory.

    Sensors without a stated position are at the end of the turner's extension. Raise Refused `no_world` if the file has
    no such section.
    """
    if not loaded.simulated:
        raise Refused(
            "no_world",
            "the configuration has no world: section, so there is nothing to simulate",
            "Name a file with a world: section, for example configs/demo.yaml",
        )
    world = WorldSection.model_validate(yaml.load(loaded.text, yaml.CSafeLoader)["world"])
    default = {"offset_mm": tuple(1000 * length for length in loaded.config.turner.extension_m)}
    sensors = {
        name: sensor if "offset_mm" in sensor.model_fields_set else sensor.model_copy(update=default)
        for name, sensor in world.sensors.items()
    }
    return world.model_copy(update={"sensors": sensors})

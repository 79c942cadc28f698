"""The laboratory's statements in addition to the result, from the configuration in the run folder."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rig.config.judging.judging_sections import CertificateSection, SiteSection
from rig.config.load import Loaded, load, load_statement
from rig.data.run_folder import CONFIG
from rig.errors import Refused
from rig.errors.quoting import quote

# Keys of `site` that determine the result; overrides cannot change them.
FIXED_KEYS = {
    *("latitude_deg", "heading_deg", "base_up", "gravity_m_s2", "gravity_uncertainty_m_s2"),
    *("magnetic_field_ut", "magnetic_field_uncertainty_ut", "magnetic_field_upwards"),
}

NO_STATEMENTS = CertificateSection()


@dataclass(frozen=True, slots=True)
class StatedFacts:
    """The statements of the laboratory; None means "not stated". `simulated` is true for a simulated laboratory."""

    site: SiteSection | None = None
    certificate: CertificateSection = NO_STATEMENTS
    simulated: bool = False

    @property
    def where(self) -> SiteSection:
        """The site of the laboratory. Without a configuration, all its values are None."""
        return self.site or SiteSection()


def folder_statements(folder: Path, overrides: Sequence[str] = ()) -> StatedFacts:
    """Return the statements in the configuration of a run folder, with `overrides` applied.

    If the folder has no configuration, only the overrides are used. Raise Refused `unknown_setting` for an override of
    a measured quantity, and the errors of `load`.
    """
    for override in overrides:
        section, _, key = override.partition("=")[0].strip().partition(".")
        if section != "certificate" and (section != "site" or key in FIXED_KEYS or not key):
            raise Refused(
                "unknown_setting",
                f"{quote(override)} would change what was measured",
                "Set a key of certificate, or one of site that the result does not depend on",
            )
    path = folder / CONFIG
    if path.exists():
        return configuration_statements(load(path, overrides, sections=None))
    if not overrides:
        return StatedFacts()
    stated = load_statement(overrides)
    return StatedFacts(stated.site, stated.certificate)


def configuration_statements(loaded: Loaded) -> StatedFacts:
    """Return the statements of a configuration on site and certificate."""
    return StatedFacts(loaded.config.site, loaded.config.certificate, loaded.simulated)

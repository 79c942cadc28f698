"""Units as people spell them are those that the table of quantities shows."""

from rig.config.column_map import SUFFIXES
from rig.config.units import UNITS, Unit
from rig.data.quantity import RIG_QUANTITIES, SCALARS, TEMPERATURE


def test_a_quantity_s_own_unit_is_one() -> None:
    for scalar in (*RIG_QUANTITIES, *SCALARS):
        assert UNITS[scalar.unit] == Unit(scalar.name, 1.0)


def test_units_that_are_shown_may_be_written_and_are_as_large() -> None:
    for each in RIG_QUANTITIES:
        for shown in (each.reading, each.bias, each.drift, *each.residuals):
            if shown.name in UNITS:
                assert UNITS[shown.name].quantity == each.name
                assert abs(UNITS[shown.name].size / shown.size - 1) < 1e-15


def test_names_of_columns_end_in_the_unit_that_they_are_converted_to() -> None:
    known = dict(SUFFIXES)
    for each in (*RIG_QUANTITIES, TEMPERATURE):
        assert known[f"_{each.suffix}"] == each.name

"""The controller's input registers that the client takes."""

import pytest

from rig.turners.ur.controller.free_registers import register_names


@pytest.mark.parametrize("first", [0, 24])
def test_the_client_takes_eight_integers_and_eighteen_doubles_from_the_first_of_a_half(first: int) -> None:
    integers = [f"input_int_register_{number}" for number in range(first, first + 8)]
    doubles = [f"input_double_register_{number}" for number in range(first, first + 18)]
    assert register_names(first) == [*integers, *doubles]

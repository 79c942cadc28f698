"""The options for readings of other programs: none is passed over in silence for a recording of the rig."""

from argparse import ArgumentParser, Namespace

import pytest

from rig.commands.offline.solve_external import add, refuse_for_recording
from rig.errors import Refused

OPTIONS = ArgumentParser(add_help=False)
add(OPTIONS)
DEFAULTS = vars(OPTIONS.parse_args([]))


def test_no_option_is_no_error() -> None:
    refuse_for_recording(Namespace(**DEFAULTS))


@pytest.mark.parametrize("name", DEFAULTS)
def test_every_option_is_refused_for_a_recording(name: str) -> None:
    with pytest.raises(Refused, match=f"bad_option: --{name.replace('_', '-')} is for samples of another program"):
        refuse_for_recording(Namespace(**{**DEFAULTS, name: "something"}))

"""The picture of the house shows the layers that lint-imports holds."""

from support.house_picture import PAGE, drawn


def test_the_page_s_picture_is_drawn_from_the_layers_contract() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert drawn(page) == page, "again: PYTHONPATH=tests python -m support.house_picture"

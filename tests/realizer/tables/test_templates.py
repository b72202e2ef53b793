"""Tests of `realizer.tables.templates`."""

import pytest

from realizer.tables.templates import templates


def test_templates_are_the_twelve_of_wojdel() -> None:
    assert list(templates()) == [
        "ASTONISHMENT",
        "SURPRISE",
        "SADNESS",
        "DISBELIEF",
        "REGRET",
        "GRIEF",
        "ANGER",
        "DISGUST",
        "HAPPINESS",
        "UNDERSTANDING",
        "SATISFACTION",
        "IRONIC SMILE",
    ]


@pytest.mark.parametrize("template", templates().values(), ids=lambda template: template.name)
def test_templates_have_plausible_durations(template) -> None:
    assert template.features
    if template.possible:
        assert template.possible[0] <= template.evident <= template.possible[1]
        assert template.possible[0] <= template.probable[0] < template.probable[1] <= template.possible[1]

"""The page that follows one document through the eight steps."""

from __future__ import annotations

from pathlib import Path
from string import Template

import realizer
from realizer.charts.chart_data import charts_of
from realizer.charts.picture import timeline
from realizer.charts.svg import svg
from realizer.examples import examples
from realizer.result import Realization
from realizer_studio.explained import steps_of

TEMPLATE = Path(__file__).with_name("steps.template")


def page() -> dict[str, str]:
    """Return the page, and the drawing of the schedule."""
    document = examples()["greeting"]
    played = realizer.realize(document, voice="silent", idle=False)
    came = {step.name: "\n".join(step.lines) for step in steps_of(played)}
    text = Template(TEMPLATE.read_text("utf-8")).substitute(came, document=document.strip())
    return {"steps.md": text, "steps/schedule.svg": drawing(played)}


def drawing(played: Realization) -> str:
    """Return the schedules of what was played, as SVG."""
    assert played.blocks is not None
    accepted = [active.first_schedule for active in played.blocks.all()]
    return svg(timeline(charts_of(played.blocks, accepted)))

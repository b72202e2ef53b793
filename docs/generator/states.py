"""The drawing of the states of a block, from the table of transitions."""

from __future__ import annotations

from realizer.playback.block_states import TRANSITIONS, State

# Where each state stands: the middle of its box, in pixels.
PLACES = {
    State.IN_PREP: (100, 150),
    State.PENDING: (250, 60),
    State.LURKING: (400, 150),
    State.REVOKED: (250, 240),
    State.IN_EXEC: (600, 150),
    State.SUBSIDING: (750, 60),
    State.DONE: (900, 150),
    State.INTERRUPTED: (750, 240),
}
WIDE, HIGH = 106, 34  # pixels of a box
HEAD = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 970 290" font-family="sans-serif">
<title>The states of a block</title>
<defs><marker id="tip" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">
  <path d="M0 0L8 4L0 8z" fill="#555"/>
</marker></defs>
<style>
  text { font-size: 13px; text-anchor: middle } .event { fill: #234b9c }
  .state { fill: #e4eaf7; stroke: #3867d6 }
  .over { fill: #eee; stroke: #333; stroke-width: 3 } line { stroke: #555; marker-end: url(#tip) }
</style>
<rect width="970" height="290" fill="#fff"/>
"""


def drawing() -> str:
    """Return the states and transitions as SVG."""
    parts = ['<circle cx="14" cy="150" r="6" fill="#333"/>', _arrow((20, 150), (47, 150))]
    for (state, event), after in TRANSITIONS.items():
        (x, y), (u, v) = PLACES[state], PLACES[after]
        begin, end = _border((x, y), (u, v)), _border((u, v), (x, y))
        along = 0.2 if x == u else 0.4  # labels of arrows that cross stand apart
        at = begin[0] + along * (end[0] - begin[0]), begin[1] + along * (end[1] - begin[1])
        parts.append(_arrow(begin, end))
        parts.append(
            f'<rect x="{at[0] - 4 - 3.6 * len(event):.0f}" y="{at[1] - 9:.0f}" '
            f'width="{8 + 7.2 * len(event):.0f}" height="18" fill="#fff"/>'
        )
        parts.append(f'<text x="{at[0]:.0f}" y="{at[1] + 4:.0f}" class="event">{event}</text>')
    left = {state for state, _ in TRANSITIONS}
    for state, (x, y) in PLACES.items():
        kind = "state" if state in left else "state over"
        parts.append(
            f'<rect x="{x - WIDE / 2}" y="{y - HIGH / 2}" width="{WIDE}" height="{HIGH}" '
            f'rx="8" class="{kind}"/>'
        )
        parts.append(f'<text x="{x}" y="{y + 5}">{state}</text>')
    return f"{HEAD}{chr(10).join(parts)}\n</svg>\n"


def _arrow(begin: tuple[float, float], end: tuple[float, float]) -> str:
    return f'<line x1="{begin[0]:.0f}" y1="{begin[1]:.0f}" x2="{end[0]:.0f}" y2="{end[1]:.0f}"/>'


def _border(place: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    """Return where the line from the middle of a box to another place leaves the box."""
    dx, dy = other[0] - place[0], other[1] - place[1]
    part = min(WIDE / 2 / abs(dx) if dx else 1.0, HIGH / 2 / abs(dy) if dy else 1.0)
    return place[0] + part * dx, place[1] + part * dy

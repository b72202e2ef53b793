"""A parser of scene files: the positions of gaze targets."""

from __future__ import annotations

import re

from realizer.behaviours.kind import Position


def parse_scene(text: str) -> dict[str, Position]:
    """Parse a scene: JSON `{"cup": [x, y, z], ...}` or lines `cup x y z`; metres, origin between the eyes.

    Raises:
        ValueError: with the entry and the expected value.
    """
    import json

    if text.lstrip().startswith("{"):
        try:
            entries = json.loads(text)
        except RecursionError:
            raise ValueError("wanted targets, got JSON that is nested too deeply") from None
        except ValueError as error:
            raise ValueError(f"wanted JSON, got: {error}") from None
        items = [(str(k), [*v.values()] if isinstance(v, dict) else v) for k, v in entries.items()]
    else:
        lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
        items = [(parts[0], parts[1:]) for parts in (re.split(r"[\s,]+", line.strip()) for line in lines)]
    scene: dict[str, Position] = {}
    for name, numbers in items:
        try:
            x, y, z = (float(v) for v in numbers)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(f"{name}: wanted three numbers x y z in metres, got {numbers!r:.80}") from None
        if not all(abs(v) <= 1e4 for v in (x, y, z)):
            raise ValueError(f"{name}: wanted metres within 10 km, got {x:g} {y:g} {z:g}")
        scene[name] = (x, y, z)
    return scene

"""A chart as SVG."""

from __future__ import annotations

from xml.sax.saxutils import escape, quoteattr

from realizer.charts.shapes import Box, Path, Picture, Shape, Text, width_of

FAMILY = "Aileron, 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif"


def svg(picture: Picture) -> str:
    """Return one SVG document that looks the same in every font: text is fitted to its measured width."""
    width, height = _number(picture.width), _number(picture.height)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}"'
        f' viewBox="0 0 {width} {height}" role="img" font-family={quoteattr(FAMILY)}>',
        f"<title>{escape(_printable(picture.title))}</title>",
        f'<rect width="{width}" height="{height}" fill="{picture.paper}"/>',
    ]
    lines += [_shape(shape) for shape in picture.shapes if not isinstance(shape, Text)]
    lines += [_text(shape) for shape in picture.shapes if isinstance(shape, Text)]
    return "\n".join([*lines, "</svg>", ""])


def _shape(shape: Shape) -> str:
    match shape:
        case Box():
            name = "rect"
            given = f'x="{_number(shape.x)}" y="{_number(shape.y)}"'
            given += f' width="{_number(shape.width)}" height="{_number(shape.height)}"'
            given += f' fill="{shape.fill or "none"}"'
            if shape.stroke:
                given += f' stroke="{shape.stroke}"'
            if shape.radius:
                given += f' rx="{_number(shape.radius)}"'
        case Path():
            points = " ".join(f"{_number(x)},{_number(y)}" for x, y in shape.points)
            name = "polygon" if shape.fill else "polyline"
            given = f'points="{points}" fill="{shape.fill or "none"}"'
            if shape.colour:
                given += f' stroke="{shape.colour}" stroke-width="{_number(shape.width)}"'
        case Text():
            return _text(shape)
    if shape.tip:
        return f"<{name} {given}><title>{escape(_printable(shape.tip))}</title></{name}>"
    return f"<{name} {given}/>"


def _text(text: Text) -> str:
    given = f'x="{_number(text.x)}" y="{_number(text.y)}" font-size="{_number(text.size)}"'
    given += f' fill="{text.colour}"'
    if text.anchor != "start":
        given += f' text-anchor="{text.anchor}"'
    if text.halo:
        given += f' stroke="{text.halo}" stroke-width="3" stroke-linejoin="round" paint-order="stroke"'
    # Only where the width was measured and not estimated.
    if text.text.isascii() and len(text.text) > 1:
        given += f' textLength="{_number(width_of(text.text, text.size))}" lengthAdjust="spacingAndGlyphs"'
    return f"<text {given}>{escape(_printable(text.text))}</text>"


def _printable(text: str) -> str:
    """Without the characters that XML cannot hold."""
    return "".join(c if c >= " " and not "\ud800" <= c <= "\udfff" and c < "\ufffe" else " " for c in text)


def _number(value: float) -> str:
    return f"{round(value, 2):g}" if abs(value) < 1e4 else f"{value:.1f}"

"""A chart as SVG."""

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
    lines += map(_shape, sorted(picture.shapes, key=lambda shape: isinstance(shape, Text)))
    return "\n".join([*lines, "</svg>", ""])


def _shape(shape: Shape) -> str:
    match shape:
        case Box():
            name = "rect"
            attributes = f'x="{_number(shape.x)}" y="{_number(shape.y)}"'
            attributes += f' width="{_number(shape.width)}" height="{_number(shape.height)}"'
            attributes += f' fill="{shape.fill or "none"}"'
            if shape.stroke:
                attributes += f' stroke="{shape.stroke}"'
            if shape.radius:
                attributes += f' rx="{_number(shape.radius)}"'
        case Path():
            points = " ".join(f"{_number(x)},{_number(y)}" for x, y in shape.points)
            name = "polygon" if shape.fill else "polyline"
            attributes = f'points="{points}" fill="{shape.fill or "none"}"'
            if shape.colour:
                attributes += f' stroke="{shape.colour}" stroke-width="{_number(shape.width)}"'
        case Text():
            return _text(shape)
    if shape.tip:
        return f"<{name} {attributes}><title>{escape(_printable(shape.tip))}</title></{name}>"
    return f"<{name} {attributes}/>"


def _text(text: Text) -> str:
    attributes = f'x="{_number(text.x)}" y="{_number(text.y)}" font-size="{_number(text.size)}"'
    attributes += f' fill="{text.colour}"'
    if text.anchor != "start":
        attributes += f' text-anchor="{text.anchor}"'
    if text.halo:
        attributes += f' stroke="{text.halo}" stroke-width="3" stroke-linejoin="round" paint-order="stroke"'
    # Only where the width was measured and not estimated.
    if text.text.isascii() and len(text.text) > 1:
        attributes += f' textLength="{_number(width_of(text.text, text.size))}"'
        attributes += ' lengthAdjust="spacingAndGlyphs"'
    return f"<text {attributes}>{escape(_printable(text.text))}</text>"


def _printable(text: str) -> str:
    """Return text without the characters that XML cannot hold."""
    return "".join(c if c >= " " and not "\ud800" <= c <= "\udfff" and c < "\ufffe" else " " for c in text)


def _number(value: float) -> str:
    return f"{round(value, 2):g}" if abs(value) < 1e4 else f"{value:.1f}"

"""Measures the parser and the writer: `python benchmarks/parse.py` prints medians and the noise.

    parse   text -> Block, for documents of linked behaviours of five kinds
    bare    lxml.etree.fromstring of the same text, the lower bound of a parser that uses lxml
    write   Block -> text

`growth` is the exponent of the time in the number of behaviours, from 100 to 10,000: 1 is linear.
"""

from __future__ import annotations

import math

from lxml import etree
from stopwatch import handle_help, measure, noise

from bml_schema import CORE, EXTENSIONS, parse, write

COUNTS = (5, 20, 100, 1000, 10_000)


def document(count: int) -> str:
    """Return a block of speech, nod, smile, gaze and action unit in turn, each linked to those before it."""
    lines = []
    for n in range(count):
        a, b = f"b{n - 1}", f"b{max(0, n - 2)}"
        start = f' start="{a}:end"' if n else ""
        lines.append(
            (
                f'<speech id="b{n}"{start}><text>Hello <sync id="m"/>my dear friend</text></speech>',
                f'<head id="b{n}" lexeme="NOD" stroke="{a}:m + 0.1" amount="0.7"/>',
                f'<faceLexeme id="b{n}" lexeme="SMILE" start="{a}:relax" end="{b}:end+0.5"/>',
                f'<gaze id="b{n}" target="person" influence="EYES" start="{a}:attackPeak"/>',
                f'<ext:faceFacs id="b{n}" au="4" side="BOTH" start="{a}:start" end="{a}:end-0.2"/>',
            )[n % 5]
        )
    start = f'<bml xmlns="{CORE}" xmlns:ext="{EXTENSIONS}" id="b" characterId="Alice">'
    return "\n".join((start, *lines, "</bml>"))


def main() -> None:
    handle_help(__doc__)
    print(noise())
    print(
        f"{'behaviours':>10}{'parse ms':>10}{'min':>9}{'max':>9}{'bare ms':>10}{'ratio':>7}{'write ms':>10}"
    )
    costs: dict[int, float] = {}
    for count in COUNTS:
        text = document(count)
        data = text.encode()
        block = parse(text)
        if block.problems or len(block.behaviours) != count:
            raise SystemExit(f"the benchmark's own document is wrong: {block.problems[:1]}")
        costs[count], least, most = measure(lambda text=text: parse(text))  # type: ignore[misc]
        bare, *_ = measure(lambda data=data: etree.fromstring(data), 0.5)  # type: ignore[misc]
        wrote, *_ = measure(lambda block=block: write(block), 0.5)  # type: ignore[misc]
        print(
            f"{count:>10}{costs[count]:>10.3f}{least:>9.3f}{most:>9.3f}{bare:>10.3f}"
            f"{costs[count] / bare:>7.1f}{wrote:>10.3f}"
        )
    print(f"growth {math.log(costs[10_000] / costs[100]) / math.log(100):.2f}")


if __name__ == "__main__":
    main()

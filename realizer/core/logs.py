"""Log formatters: text for people, or JSON for collectors."""

from __future__ import annotations

import json
import logging
import sys
from datetime import UTC, datetime
from typing import TextIO

# Attributes that every record has; the rest comes from `extra`.
USUAL = set(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName"}


class JsonFormatter(logging.Formatter):
    """A formatter of one JSON object a line: time (UTC), level, logger, message, `extra`, and a traceback."""

    def format(self, record: logging.LogRecord) -> str:
        time = datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
        line: dict[str, object] = {
            "time": time.replace("+00:00", "Z"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        line |= {name: value for name, value in vars(record).items() if name not in USUAL}
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=False, default=str)


def write_words(level: int, who: str = "") -> None:
    """Log from `level` on as lines for people, on standard error; `who` precedes each."""
    logging.basicConfig(format=f"realizer: {who}%(message)s", stream=sys.stderr)
    logging.getLogger().setLevel(level)


def write_json(stream: TextIO | None = None) -> None:
    """Log as JSON lines, on standard error; the service's own from INFO on."""
    handler = logging.StreamHandler(stream or sys.stderr)
    handler.setFormatter(JsonFormatter())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    service = logging.getLogger("realizer")
    service.setLevel(min(root.level, logging.INFO))

"""Logging as text for people or as JSON for programs."""

import json
import logging
import sys
from datetime import UTC, datetime
from typing import TextIO

# Attributes of every record; further ones come from `extra`.
STANDARD = set(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName"}


class JsonFormatter(logging.Formatter):
    """Formats a record as one line of JSON: time (UTC), level, logger, message, `extra` and traceback."""

    def format(self, record: logging.LogRecord) -> str:
        time = datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
        line: dict[str, object] = {
            "time": time.replace("+00:00", "Z"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        line |= {name: value for name, value in vars(record).items() if name not in STANDARD}
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, ensure_ascii=False, default=str)


def write_words(level: int, prefix: str = "") -> None:
    """Log to standard error as text, from `level` on, each line with a prefix."""
    logging.basicConfig(format=f"realizer: {prefix}%(message)s", stream=sys.stderr)
    logging.getLogger().setLevel(level)


def write_json(stream: TextIO | None = None) -> None:
    """Log as lines of JSON, to standard error by default; messages of the service from INFO on."""
    handler = logging.StreamHandler(stream or sys.stderr)
    handler.setFormatter(JsonFormatter())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    service = logging.getLogger("realizer")
    service.setLevel(min(root.level, logging.INFO))

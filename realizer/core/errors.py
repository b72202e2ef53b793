"""The errors of the library, other than those of documents.

RealizerError
├── ScheduleError    constraints that cannot hold together
├── TableError       a table under realizer/tables or in a face folder: file, line, column
├── FaceError        a face folder: which file, what to change
├── VoiceError       a voice that is not installed or failed
├── PluginError      an entry point of another package that cannot be used
└── RenderError      no GL, or a lost context

Faults of documents are `bml_schema.BMLError`.
"""


class RealizerError(Exception):
    """Any fault of the realizer that a caller may want to catch."""


class ScheduleError(RealizerError):
    """Required behaviours whose constraints cannot hold together."""


class TableError(RealizerError):
    """A table with a bad row; the text says file, line and column."""


class FaceError(RealizerError):
    """A face folder that cannot be used; the text says which file and what to change."""


class VoiceError(RealizerError):
    """A voice that is not installed or failed; the text says what to install."""


class PluginError(RealizerError):
    """An entry point of another package that cannot be used; the text says which and why."""


class RenderError(RealizerError):
    """Pictures cannot be drawn; the text says what to install."""

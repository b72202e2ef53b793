"""The exceptions of the library, except those about documents.

RealizerError
├── ScheduleError    conflicting constraints of required behaviours
├── TableError       an invalid table: built in, of a face, or of the user
├── FaceError        an invalid or missing face
│   └── UnknownFaceError
├── VoiceError       a missing or failed voice
│   └── UnknownVoiceError
├── PluginError      an unusable plug-in
└── RenderError      pictures cannot be drawn
    └── UnknownLookError

Names that are not known are also ValueError, and the command line exits with 2 for them, not 3.
Faults of documents are `bml_schema.BMLError`.
"""


class RealizerError(Exception):
    """The base class of the library's exceptions."""


class ScheduleError(RealizerError):
    """Required behaviours have constraints that conflict."""


class TableError(RealizerError):
    """A table has a bad row; the message names file, line and column."""


class FaceError(RealizerError):
    """A face folder cannot be used; the message names the file and what to change."""


class VoiceError(RealizerError):
    """A voice is not installed or has failed; the message says what to install."""


class PluginError(RealizerError):
    """An entry point of another package cannot be used; the message says why."""


class UnknownNameError(RealizerError, ValueError):
    """There is nothing of that name; the message lists what there is."""


class UnknownFaceError(UnknownNameError, FaceError):
    """There is no face of that name."""


class UnknownVoiceError(UnknownNameError, VoiceError):
    """There is no voice of that name."""


class RenderError(RealizerError):
    """Pictures cannot be drawn; the message says what to install."""


class UnknownLookError(UnknownNameError, RenderError):
    """There is no such camera, light or background."""

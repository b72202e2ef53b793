"""The BML 1.0 language: parser, typed nodes, writer and feedback."""

from bml_schema.absolute import with_absolute_times
from bml_schema.behaviours import (
    Face,
    FaceFacs,
    FaceLexeme,
    FaceShift,
    Gaze,
    GazeShift,
    Gesture,
    Head,
    HeadDirectionShift,
    Locomotion,
    Pointing,
    Pose,
    Posture,
    PostureShift,
    Speech,
    SpeechText,
    Stance,
    Sync,
    Wait,
)
from bml_schema.bmla import (
    Activate,
    AudioFile,
    BlinkEmitter,
    FaceInterpolator,
    FaceKeyframe,
    Interrupt,
    ParameterValueChange,
    Trajectory,
)
from bml_schema.documents import MAX_BYTES, MAX_DOCUMENTS, made_ids, parse, parse_all, read
from bml_schema.errors import BMLError, BMLSizeError, BMLSyntaxError, Place, Problem
from bml_schema.extensions import Blink, Emotion, Expression, Fap, FapFile, Faps, Idle, Listen, Mood, Timeline
from bml_schema.feedback import (
    BlockPrediction,
    BlockProgress,
    Feedback,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
    parse_feedback,
    prediction_of,
)
from bml_schema.node_schema import attribute, child, children, mixed, node, sync_ref, text
from bml_schema.nodes import (
    BMLA,
    BMLT,
    CORE,
    EXTENSIONS,
    OWN,
    After,
    Before,
    Behaviour,
    Block,
    Constraint,
    Description,
    Part,
    Required,
    Synchronize,
)
from bml_schema.reading.dropped_references import ReducedBlock, without
from bml_schema.reading.parser import MAX_BEHAVIOURS
from bml_schema.sync_refs import SyncRef
from bml_schema.values import Value, flag, integer, number, one_of, seconds, string, word
from bml_schema.vocabulary import VOCABULARY
from bml_schema.writer import write

__all__ = [
    "BMLA", "BMLT", "CORE", "EXTENSIONS", "MAX_BEHAVIOURS", "MAX_BYTES", "MAX_DOCUMENTS", "OWN", "VOCABULARY",
    "Activate", "After", "AudioFile", "BMLError", "BMLSizeError", "BMLSyntaxError", "Before", "Behaviour",
    "Blink", "BlinkEmitter", "Block", "BlockPrediction", "BlockProgress", "Constraint", "Description",
    "Emotion", "Expression", "Face", "FaceFacs", "FaceInterpolator", "FaceKeyframe", "FaceLexeme",
    "FaceShift", "Fap", "FapFile", "Faps", "Feedback", "Gaze", "GazeShift", "Gesture", "Head",
    "HeadDirectionShift", "Idle", "Interrupt", "Listen", "Locomotion", "Mood", "ParameterValueChange", "Part",
    "Place", "Pointing", "Pose", "Posture", "PostureShift", "PredictionFeedback", "Problem", "ReducedBlock",
    "Required", "Speech", "SpeechText", "Stance", "Sync", "SyncPointProgress", "SyncRef", "Synchronize",
    "Timeline", "Trajectory", "Value", "Wait", "WarningFeedback", "attribute", "child", "children", "flag",
    "integer", "made_ids", "mixed", "node", "number", "one_of", "parse", "parse_all", "parse_feedback",
    "prediction_of", "read", "seconds", "string", "sync_ref", "text", "with_absolute_times", "without",
    "word", "write",
]  # fmt: skip

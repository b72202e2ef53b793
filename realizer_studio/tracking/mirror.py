"""Live measurement of a face in front of a camera."""

import io
import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from PIL import Image

from realizer.core.array_types import Float64
from realizer.core.units import ANGLE_UNIT
from realizer_studio.analysis.recognise import recogniser
from realizer_studio.tracking.detector import detect
from realizer_studio.tracking.files import HEAD, mask, unit_columns
from realizer_studio.tracking.landmarks import MIN_PRESENCE, NEW_PRESENCE, Landmarks, landmarks
from realizer_studio.tracking.network import TrackingError
from realizer_studio.tracking.person_recording import QUIET
from realizer_studio.tracking.regressor import Measured, components, measure

REMEMBERED = 300  # pictures from which the face at rest is estimated
ENOUGH = 10  # least number of pictures for that; with fewer, faces are measured without it
SMOOTHING = 0.05  # s; time constant of the smoothing


@dataclass(frozen=True, eq=False)
class Sight:
    """The measurement of a picture."""

    units: Mapping[str, float]  # action units by name, 0..1, with those of head and eyes
    head: tuple[float, float, float]  # degrees of pitch, yaw and roll
    emotion: str | None  # the recognised one, or None
    certainty: float


class Mirror:
    """A measurement of the face in each picture of a sequence; pictures are not stored."""

    def __init__(self) -> None:
        self._face: Landmarks | None = None
        self._past: deque[tuple[float, Float64]] = deque(maxlen=REMEMBERED)
        self._smooth: tuple[float, Measured] | None = None

    def __call__(self, jpeg: bytes, time: float) -> Sight | None:
        """Return the measurement of a picture at a time in seconds, or None if no face is found.

        Raises:
            TrackingError: the bytes are no picture.
        """
        try:
            with Image.open(io.BytesIO(jpeg), formats=("JPEG", "PNG", "WEBP")) as file:
                picture = file.convert("RGB")
        # Readers of damaged files raise more than they document, such as SyntaxError and struct.error.
        except Exception as error:
            raise TrackingError(
                f"wanted a JPEG, PNG or WebP picture, got {len(jpeg)} bytes of something else"
            ) from error
        self._face = self._find(picture)
        if self._face is None:
            self._smooth = None
            return None
        return self._sight(self._face, time)

    def _find(self, picture: Image.Image) -> Landmarks | None:
        if (
            self._face is not None
            and (face := landmarks(picture, self._face.region)).presence >= MIN_PRESENCE
        ):
            return face
        found = (landmarks(picture, region, refine=True) for region in detect(picture, small=False)[:1])
        return next((face for face in found if face.presence >= NEW_PRESENCE), None)

    def _sight(self, face: Landmarks, time: float) -> Sight:
        face_components = components([face])
        calmest = sorted(self._past, key=lambda past: past[0])[: math.ceil(QUIET * len(self._past))]
        neutral = np.mean([values for _, values in calmest], axis=0) if len(self._past) >= ENOUGH else None
        measured = measure(face_components, neutral)
        self._past.append((float(measured.units.sum()), face_components.values[0]))
        if self._smooth is not None:
            before, last = self._smooth
            share = math.exp(-max(time - before, 0.0) / SMOOTHING)
            measured = Measured(
                share * last.units + (1 - share) * measured.units,
                share * last.faps + (1 - share) * measured.faps,
            )
        self._smooth = time, measured
        emotion, certainty = recogniser("own").certainties(measured.faps, mask())[0]
        pitch, yaw, roll = np.degrees(measured.faps[0, np.array(HEAD) - 1] * ANGLE_UNIT).round(2).tolist()
        units = {name: round(float(value[0]), 4) for name, value in unit_columns(measured).items()}
        return Sight(units, (pitch, yaw, roll), emotion, round(certainty, 3))

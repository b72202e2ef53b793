"""Every setting in one typed object: flags win over REALIZER_* variables, those over a TOML file."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from realizer.errors import RealizerError

__all__ = ["Settings", "SettingsError"]


class SettingsError(RealizerError):
    """A setting with a wrong value; the text says which, where from and what was wanted."""


class Settings(BaseModel):
    """What a service can be told. `REALIZER_FPS=30` and `fps = 30` in a TOML file mean `--fps 30`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    host: str = "127.0.0.1"
    port: int = Field(8765, ge=0, le=65535, description="0 takes a free port")
    face: str = "default"
    voice: str | None = Field(None, description="None: espeak-ng where installed, otherwise silent")
    language: str = Field("en-US", description="BCP-47, of speech that names none")
    fps: float = Field(25.0, gt=0, le=240)
    scene: Path | None = Field(None, description="a file of targets every session starts with")
    seed: int = 0
    idle: bool = True
    keep: float = Field(60.0, ge=0, description="seconds a named session outlives its last connection")
    drain: float = Field(5.0, ge=0, description="seconds given to what plays when the service ends")
    max_message: int = Field(16 * 2**20, gt=0, description="bytes of one WebSocket message")
    max_document: int = Field(2**20, gt=0, description="bytes of one document")
    max_behaviours: int = Field(10_000, gt=0, description="behaviours in one block")
    max_blocks: int = Field(1_000, gt=0, description="blocks playing or waiting in one session")
    max_sessions: int = Field(5_000, gt=0, description="sessions of the service")
    max_size: int = Field(2048, gt=0, description="pixels of a picture's longer side")

    @classmethod
    def read(
        cls,
        flags: Mapping[str, Any] | None = None,
        *,
        file: Path | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> Settings:
        """Settings from all three sources.

        Args:
            flags: what the command line said; None values are left out.
            file: a TOML file; None for none.
            environment: variables; None for the process's own.

        Raises:
            SettingsError: an unknown name or a wrong value.
        """
        environment = os.environ if environment is None else environment
        values: dict[str, Any] = {}
        if file is not None:
            try:
                values |= tomllib.loads(file.read_text("utf-8"))
            except (OSError, tomllib.TOMLDecodeError) as error:
                raise SettingsError(f"{file}: {error}") from None
        prefix = "REALIZER_"
        for name, value in environment.items():
            field = name.removeprefix(prefix).lower()
            if name.startswith(prefix) and field in cls.model_fields:
                values[field] = value
        values |= {name: value for name, value in (flags or {}).items() if value is not None}
        try:
            return cls.model_validate(values)
        except ValidationError as error:
            first = error.errors()[0]
            name = ".".join(map(str, first["loc"]))
            raise SettingsError(f"setting {name}: {first['msg']}, got {first['input']!r}") from None

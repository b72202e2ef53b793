"""Settings in one typed object: flags, then REALIZER_* variables, then a TOML file."""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

from realizer.core.errors import RealizerError
from realizer.core.options import PlayOptions

T = TypeVar("T")
PREFIX = "REALIZER_"
# Read elsewhere: where faces lie and are made, what draws.
OTHERS = frozenset({"REALIZER_DRAW", "REALIZER_FACES", "REALIZER_HEAD_DATA", "REALIZER_NO_PAGE"})
SECRET = 32  # characters; HS256 is as strong as that (RFC 7518, 3.2)


class SettingsError(RealizerError):
    """A setting with a wrong value; the text says which, what was wanted and what came.

    Attributes:
        setting: its name, or "".
    """

    def __init__(self, text: str, setting: str = "") -> None:
        super().__init__(text)
        self.setting = setting


def _number(kind: type[int] | type[float], low: float, high: float) -> Callable[[Any], Any]:
    wanted = f"{'a whole number' if kind is int else 'a number'} {low:g}..{high:g}"

    def read(value: Any) -> Any:
        try:
            number = kind(value)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(wanted) from None
        cut = kind is int and isinstance(value, float) and number != value
        if isinstance(value, bool) or cut or not math.isfinite(number) or not low <= number <= high:
            raise ValueError(wanted)
        return number

    return read


def raises(name: str) -> str:
    """Return the part of a message that says where a limit is set."""
    return f"({PREFIX}{name.upper()} sets it)"


def _flag(value: Any) -> bool:
    words = dict.fromkeys(("1", "true", "yes", "on"), True) | dict.fromkeys(
        ("0", "false", "no", "off"), False
    )
    known = words.get(str(value).strip().lower())
    if known is None:
        raise ValueError("true or false")
    return known


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise ValueError("a word")
    return value


def _deformer(value: Any) -> str:
    if value not in ("mpeg4", "au"):
        raise ValueError("mpeg4 or au")
    return str(value)


def _ports(value: Any) -> tuple[int, int]:
    """Two port numbers: BML in, feedback out."""
    port = _number(int, 0, 65535)
    ports = value.replace(",", " ").split() if isinstance(value, str) else value
    if not isinstance(ports, list | tuple) or len(ports) != 2 or port(ports[1]) == 0:
        raise ValueError("two ports, of which the first may be 0")
    return port(ports[0]), port(ports[1])


def _address(value: Any) -> str:
    host, _, port = str(value).rpartition(":")
    if not host or not port.isascii() or not port.isdecimal() or not 0 < int(port) < 65536:
        raise ValueError("HOST:PORT")
    return f"{host}:{int(port)}"


def _session(value: Any) -> str:
    if not isinstance(value, str) or not re.fullmatch(r"[A-Za-z0-9._~-]{1,64}", value):
        raise ValueError("1..64 letters, digits or . _ ~ -")
    return value


def _colour(value: Any) -> str:
    if not isinstance(value, str) or not re.fullmatch(r"#[0-9a-fA-F]{6}|transparent", value):
        raise ValueError("transparent or a colour such as #d8dde2")
    return value


def _path(value: Any) -> Path:
    if not isinstance(value, str | Path):
        raise ValueError("the name of a file or folder")
    return Path(value)


def _folder(value: Any) -> Path:
    path = _path(value)
    if not path.is_dir():
        raise ValueError("a folder that is there")
    return path


def _file(value: Any) -> Path:
    path = _path(value)
    if not path.is_file():
        raise ValueError("a file that is there")
    return path


def _switch_or_file(value: Any) -> str:
    """ "on", "off", or the name of a file."""
    try:
        return "on" if _flag(value) else "off"
    except ValueError:
        if not isinstance(value, str | Path) or not Path(value).is_file():
            raise ValueError("on, off, or a file that is there") from None
        return str(value)


def _origins(value: Any) -> tuple[str, ...]:
    """Addresses of pages, with scheme and without path: in one text, or a list of them."""
    origins = value.replace(",", " ").split() if isinstance(value, str) else value
    if not isinstance(origins, list | tuple) or not all(
        origin == "*" or re.fullmatch(r"[a-z][a-z0-9+.-]*://[^/\s]+/?|null", str(origin))
        for origin in origins
    ):
        raise ValueError("addresses such as https://example.org, or *")
    return tuple(str(origin) for origin in origins)


def _token(value: Any) -> str | None:
    """An empty one is no word: a variable that was left empty by mistake must open no door."""
    return None if value is None else _text(value)


def _key(value: Any) -> str | None:
    """Return a key itself, or the content of its file: a public key in PEM, or a secret."""
    if value is None:
        return None
    wanted = f"a PEM file that is there, or a secret of at least {SECRET} characters"
    if not isinstance(value, str | Path) or not str(value).strip():
        raise ValueError(wanted)
    text = str(value)
    try:
        if "-----BEGIN" not in text and Path(text).is_file():
            text = Path(text).read_text("utf-8")
    except OSError:
        pass  # a secret may be longer than any name
    except UnicodeDecodeError:
        raise ValueError(wanted) from None
    text = text.strip()
    # A misspelt file name must not become a guessable secret.
    if "-----BEGIN" not in text and (len(text) < SECRET or text.endswith((".pem", ".key", ".pub"))):
        raise ValueError(wanted)
    return text


def _word_of(*words: str) -> Callable[[Any], str]:
    def read(value: Any) -> str:
        if value not in words:
            raise ValueError(" or ".join(words))
        return str(value)

    return read


def _meant(name: str, known: Iterable[str]) -> str | None:
    """Return the setting that was probably meant, or None."""
    from difflib import get_close_matches

    return next(iter(get_close_matches(name, known, n=1, cutoff=0.8)), None)


def _optional(read: Callable[[Any], T]) -> Callable[[Any], T | None]:
    return lambda value: None if value is None or value == "" else read(value)


def _setting(default: Any, read: Callable[[Any], Any], says: str, *, secret: bool = False) -> Any:
    """A field; a secret one is in no message and no `repr`."""
    return field(default=default, repr=not secret, metadata={"read": read, "says": says, "secret": secret})


# Not pydantic, which the messages of the service use: loading it takes longer than planning a document.
@dataclass(frozen=True, kw_only=True)
class Settings:
    """The settings of a service. `REALIZER_FPS=30` and `fps = 30` in a TOML file mean `--fps 30`.

    Raises:
        SettingsError: a value of the wrong kind or out of range.
    """

    host: str = _setting("127.0.0.1", _text, "address to listen on")
    port: int = _setting(8765, _number(int, 0, 65535), "0 takes a free port")
    workers: int = _setting(1, _number(int, 1, 64), "processes that serve the port, each its sessions")
    token: str | None = _setting(
        None, _token, "what clients of the WebSocket must bring; none: all may come", secret=True
    )
    jwt_key: str | None = _setting(
        None,
        _key,
        "a PEM file of a public key, or a secret: clients may bring a JWT that is signed with it; none: no",
        secret=True,
    )
    jwt_audience: str | None = _setting(
        None, _optional(_text), "what a JWT must be for, its claim aud; none: it must have none"
    )
    origins: tuple[str, ...] = _setting(
        (), _origins, "addresses of pages elsewhere that may open a WebSocket; * is any"
    )
    tls_cert: Path | None = _setting(
        None, _optional(_file), "certificates in PEM, the service's first; none: no TLS"
    )
    tls_key: Path | None = _setting(None, _optional(_file), "its key in PEM; none: it is in the same file")
    log: str = _setting("text", _word_of("text", "json"), "how logs are written to standard error")
    journal: str | None = _setting(
        None,
        _optional(_text),
        "a file, or redis://HOST:PORT/N: sessions with a name outlive the service; none: they do not",
        secret=True,  # a password may be in it
    )
    record: Path | None = _setting(
        None,
        _optional(_path),
        "a folder to record all sessions in, for `realizer replay`; none: not recorded",
    )
    asap_ports: tuple[int, int] | None = _setting(
        None, _optional(_ports), "of Asap's TCP: BML in, feedback to this port of the client; none: no door"
    )
    xface_port: int | None = _setting(
        None, _optional(_number(int, 0, 65535)), "of Xface's TCP: tasks for a player; none: no door"
    )
    xface_player: str | None = _setting(
        None, _optional(_address), "HOST:PORT of an Xface player that shows a session; none: no door"
    )
    xface_player_session: str = _setting("xface-player", _session, "which session it shows")
    xface_player_interval: float = _setting(
        0.25, _number(float, 0, 60), "seconds from one frame to the next; the player stops at shorter ones"
    )
    stomp: str | None = _setting(None, _optional(_address), "HOST:PORT of a message broker; none: no door")
    stomp_login: str | None = _setting(None, _optional(_text), "for the broker")
    stomp_password: str | None = _setting(None, _optional(_text), "for the broker", secret=True)
    stomp_host: str | None = _setting(None, _optional(_text), 'virtual host; RabbitMQ wants "/"')
    stomp_json_in: str | None = _setting(
        "/topic/bmlRequests", _optional(_text), "BML in JSON; none: not read"
    )
    stomp_json_out: str = _setting("/topic/bmlFeedback", _text, "feedback in JSON")
    stomp_xml_in: str | None = _setting("/topic/asap.bml.request", _optional(_text), "BML; none: not read")
    stomp_xml_out: str = _setting("/topic/asap.bml.feedback", _text, "feedback")
    stomp_vhmsg: str | None = _setting("/topic/DEFAULT_SCOPE", _optional(_text), "VHMSG; none: not read")
    face: str = _setting("default", _text, "of characters that name none")
    deformer: str | None = _setting(
        None, _optional(_deformer), "what moves faces: mpeg4 or au; none: as each face says"
    )
    voice: str | None = _setting(None, _optional(_text), "none: espeak-ng where installed, else silent")
    language: str = _setting("en-US", _text, "BCP-47, of speech that names none")
    camera: str = _setting("front", _text, "of pictures that name none")
    light: str | None = _setting(None, _optional(_text), "of pictures that name none; none: portrait")
    background: str | None = _setting(
        None, _optional(_colour), "of pictures that name none; none: the light's own"
    )
    fps: float = _setting(25.0, _number(float, 0.01, 240), "frames a second of streams that name no rate")
    scene: Path | None = _setting(None, _optional(_path), "a file of targets every session starts with")
    media: Path | None = _setting(None, _optional(_folder), "the folder of the files that documents may name")
    expressions: Path | None = _setting(
        None, _optional(_folder), "a folder of expressions of one's own; none: those that ship"
    )
    seed: int = _setting(0, _number(int, -(2**63), 2**63 - 1), "of idle motion")
    idle: bool = _setting(True, _flag, "blinks and small head motion")
    cooccurrence: str = _setting("on", _switch_or_file, "rules of AUs together: on, off, or a file of them")
    prosody: bool = _setting(True, _flag, "nods, brows, blinks and looks that go with speech: on or off")
    mapping: Path | None = _setting(
        None, _optional(_file), "a file of what AUs ask of FAPs; none: as each face"
    )
    keep: float = _setting(60.0, _number(float, 0, 1e9), "seconds a named session outlives its connections")
    drain: float = _setting(5.0, _number(float, 0, 3600), "seconds given to what plays when the service ends")
    max_message: int = _setting(16 * 2**20, _number(int, 1, 2**31), "bytes of one WebSocket message")
    max_document: int = _setting(2**20, _number(int, 1, 2**31), "bytes of BML in one message")
    max_elements: int = _setting(100_000, _number(int, 1, 10**7), "XML elements in one message")
    max_behaviours: int = _setting(10_000, _number(int, 1, 10**6), "behaviours in one block")
    max_duration: float = _setting(
        1_800.0, _number(float, 1, 1e9), "seconds that one block is planned to last, from its start"
    )
    max_blocks: int = _setting(
        1_000,
        _number(int, 1, 10**6),
        "blocks playing or waiting in one session, and messages that wait with more",
    )
    max_connections: int = _setting(
        2_000, _number(int, 1, 10**6), "connections open from one address, at each door"
    )
    max_sessions: int = _setting(5_000, _number(int, 1, 10**6), "sessions of the service, in each worker")
    max_address_sessions: int = _setting(
        2_000, _number(int, 1, 10**6), "sessions that one address has opened and that still live"
    )
    max_size: int = _setting(2048, _number(int, 16, 16384), "pixels of a picture's longer side")
    max_pixels: float = _setting(
        125e6, _number(float, 256, 1e12), "pixels a second of the pictures of one session: 1920x1080 at 60"
    )
    max_speech: int = _setting(20_000, _number(int, 1, 10**7), "characters of one speech in a document")
    max_rate: float = _setting(
        500.0, _number(float, 0.1, 1e6), "messages a second that are read from one connection"
    )
    max_memory: int | None = _setting(
        None,
        _optional(_number(int, 64, 10**7)),
        "MB of the process above which no session is opened any more; none: no limit",
    )

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            try:
                object.__setattr__(self, f.name, f.metadata["read"](value))
            except ValueError as wanted:
                got = "something else" if f.metadata["secret"] else repr(value)
                raise SettingsError(f"setting {f.name}: wanted {wanted}, got {got}", f.name) from None
        if self.tls_key is not None and self.tls_cert is None:
            raise SettingsError("setting tls_key: wanted tls_cert too, got none")
        if self.tls_cert is not None and self.workers > 1:
            raise SettingsError(
                f"setting tls_cert: wanted workers = 1, got {self.workers}: what hands connections to "
                "several workers reads their first line; let a proxy in front speak TLS"
            )
        open_doors = [name for name in ("asap_ports", "xface_port") if getattr(self, name) is not None]
        if self.jwt_audience is not None and self.jwt_key is None:
            raise SettingsError("setting jwt_audience: wanted jwt_key too, got none")
        if (self.token or self.jwt_key) and open_doors and self.host not in ("127.0.0.1", "localhost", "::1"):
            raise SettingsError(
                f"setting {open_doors[0]}: wanted none, or host 127.0.0.1: its clients cannot bring the token"
            )

    def play_options(self, scene: Mapping[str, tuple[float, float, float]] | None = None) -> PlayOptions:
        """Return how documents are played.

        Args:
            scene: what is in the file `scene`.
        """
        names = (f.name for f in fields(PlayOptions) if f.name != "scene")
        return PlayOptions(**{name: getattr(self, name) for name in names}, scene=scene)

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
            flags: values of the command line; None values are ignored.
            file: a TOML file; None for none.
            environment: variables; None for the process's own.

        Raises:
            SettingsError: an unknown name or a wrong value.
        """
        environment = os.environ if environment is None else environment
        known = {f.name for f in fields(cls)}
        values: dict[str, Any] = {}
        if file is not None:
            try:
                values |= tomllib.loads(file.read_text("utf-8-sig"))
            except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
                raise SettingsError(f"{file}: {error}") from None
        sources = dict.fromkeys(values, str(file))
        for name, value in environment.items():
            if name.startswith(PREFIX) and name not in OTHERS:
                setting = name.removeprefix(PREFIX).lower()
                if setting in known:
                    values[setting], sources[setting] = value, name
                elif meant := _meant(setting, known):
                    # A misspelt protection would leave the service open.
                    raise SettingsError(f"variable {name}: wanted {PREFIX}{meant.upper()}?")
        if unknown := sorted(values.keys() - known):
            wanted = _meant(unknown[0], known) or f"one of {', '.join(sorted(known))}"
            raise SettingsError(f"setting {unknown[0]}: wanted {wanted} ({file})")
        told = {name: value for name, value in (flags or {}).items() if value is not None}
        try:
            return cls(**values | told)
        except SettingsError as error:
            if error.setting in told or error.setting not in sources:
                raise
            raise SettingsError(f"{error} ({sources[error.setting]})", error.setting) from None

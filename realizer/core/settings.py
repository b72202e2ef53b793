"""The settings of the service, from flags, REALIZER_* variables and a TOML file, in this order."""

import ipaddress
import logging
import os
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Self

from realizer.core import setting_types as kind
from realizer.core.errors import RealizerError
from realizer.core.options import PlayOptions
from realizer.core.toml_text import parse_toml

log = logging.getLogger(__name__)

PREFIX = "REALIZER_"
# Variables that are read elsewhere.
OTHERS = {"REALIZER_DRAW", "REALIZER_FACES", "REALIZER_HEAD_DATA", "REALIZER_NO_PAGE"}


class SettingsError(RealizerError, ValueError):
    """A setting has a wrong value; the message names it, the wanted values and the actual one.

    Attributes:
        setting: its name, or "".
    """

    def __init__(self, text: str, setting: str = "") -> None:
        super().__init__(text)
        self.setting = setting


def limit_hint(name: str) -> str:
    """Return the part of a message that says which variable sets a limit."""
    return f"({PREFIX}{name.upper()} sets it)"


def is_loopback(host: str) -> bool:
    """Return whether a host name or an address can be reached from this machine only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost" or host.endswith(".localhost")


def _closest(name: str, known: Iterable[str], cutoff: float = 0.8) -> str | None:
    from realizer.core.similar import similar

    return next(iter(similar(name, known, 1, cutoff)), None)


def _row(
    default: Any, read: Callable[[Any], Any], description: str, *, secret: bool = False, empty: bool = True
) -> Any:
    """Return a row of the table of settings: a field of `Settings`.

    Args:
        default: None also makes None a valid value.
        read: converts and checks a value; raises ValueError with what was wanted.
        description: what it sets, and after "; none: " what None means.
        secret: keeps the value out of messages and `repr`.
        empty: whether "" means None for a setting that may be None.
    """
    if default is None:
        read = kind.optional(read, empty)
    metadata = {"read": read, "description": description, "secret": secret}
    return field(default=default, repr=not secret, metadata=metadata)


_SESSION = kind.matching(r"[A-Za-z0-9._~-]{1,64}", "1..64 letters, digits or . _ ~ -")


# Not a model of pydantic-settings, which knows no source of a value and no unknown variables;
# with the same messages it took 31 lines and, at the start of each command, 0.12 s more.
@dataclass(frozen=True, kw_only=True)
class Settings:
    """The settings of a service. `REALIZER_FPS=30` and `fps = 30` in a TOML file mean `--fps 30`.

    Raises:
        SettingsError: a value of the wrong kind or out of range.
    """

    host: str = _row("127.0.0.1", kind.text, "address to listen on")
    port: int = _row(8765, kind.whole(0, 65535), "port; 0: any free one")
    workers: int = _row(1, kind.whole(1, 64), "number of processes that share the port")
    # An empty token must not open the service by mistake.
    token: str | None = _row(
        None,
        kind.text,
        "password for WebSocket clients; REALIZER_TOKEN hides it from other users; none: no password",
        secret=True,
        empty=False,
    )
    jwt_key: str | None = _row(
        None,
        kind.key,
        "key of the JWTs that clients may present: PEM file of a public key, or a secret; none: no JWTs",
        secret=True,
        empty=False,
    )
    jwt_audience: str | None = _row(None, kind.text, "required claim aud of a JWT; none: it must have none")
    insecure: bool = _row(False, kind.flag, "listen beyond this machine without a token, a key or addresses")
    hosts: tuple[str, ...] = _row(
        (),
        kind.hosts,
        "names under which clients reach the service, beside its addresses, the machine's name and localhost",
    )
    forwarded_allow_ips: tuple[str, ...] = _row(
        (),
        kind.proxies,
        "addresses and networks of proxies whose X-Forwarded-For is believed, for limits and the log, or *; "
        "none: no proxy",
    )
    allow: tuple[str, ...] = _row(
        (), kind.networks, "addresses and networks of the clients of Asap and Xface; none: all"
    )
    origins: tuple[str, ...] = _row((), kind.origins, "origins of pages that may connect; *: all")
    tls_cert: Path | None = _row(None, kind.file, "certificate chain in PEM; none: no TLS")
    tls_key: Path | None = _row(None, kind.file, "private key in PEM; none: it is in the file tls_cert")
    log: str = _row("text", kind.word_of("text", "json"), "format of log messages")
    # The URL may contain a password.
    journal: str | None = _row(
        None,
        kind.text,
        "file or redis://HOST:PORT/N that saves named sessions for a restart; none: not saved",
        secret=True,
    )
    record: Path | None = _row(
        None, kind.path, "folder for recordings, for `realizer replay`; none: not recorded"
    )
    asap_ports: tuple[int, int] | None = _row(
        None,
        kind.ports,
        "ports of ASAP's TCP, such as 7500 7501: BML in, feedback to that port of the client; none: off",
    )
    xface_port: int | None = _row(
        None, kind.whole(0, 65535), "port for clients of an Xface player; none: off"
    )
    xface_player: str | None = _row(
        None, kind.address, "HOST:PORT of an Xface player that shows a session; none: off"
    )
    xface_player_session: str = _row("xface-player", _SESSION, "session that xface_player shows")
    xface_player_interval: float = _row(
        0.25, kind.real(0, 60), "seconds between frames for xface_player; it stops at shorter ones"
    )
    vmc: str | None = _row(
        None, kind.address, "HOST:PORT that a session is sent to in the VMC protocol; none: off"
    )
    livelink: str | None = _row(
        None, kind.address, "HOST:PORT that a session is sent to as Live Link Face does; none: off"
    )
    avatar_session: str | None = _row(
        None, _SESSION, "session that vmc and livelink send; none: the oldest with a client"
    )
    avatar_fps: int = _row(30, kind.whole(1, 120), "frames per second of vmc and livelink")
    stomp: str | None = _row(None, kind.address, "HOST:PORT of a STOMP broker; none: off")
    stomp_login: str | None = _row(None, kind.text, "login for the broker")
    stomp_password: str | None = _row(None, kind.text, "password for the broker", secret=True)
    stomp_host: str | None = _row(None, kind.text, 'virtual host; "/" for RabbitMQ')
    stomp_json_in: str | None = _row(
        "/topic/bmlRequests", kind.optional(kind.text), "destination of BML in JSON; none: not read"
    )
    stomp_json_out: str = _row("/topic/bmlFeedback", kind.text, "destination of feedback in JSON")
    stomp_xml_in: str | None = _row(
        "/topic/asap.bml.request", kind.optional(kind.text), "destination of BML; none: not read"
    )
    stomp_xml_out: str = _row("/topic/asap.bml.feedback", kind.text, "destination of feedback")
    stomp_vhmsg: str | None = _row(
        "/topic/DEFAULT_SCOPE", kind.optional(kind.text), "destination of VHMSG; none: not read"
    )
    face: str = _row("default", kind.text, "default face of characters")
    deformer: str | None = _row(
        None, kind.word_of("mpeg4", "au"), "what moves faces: mpeg4 or au; none: each face's own choice"
    )
    voice: str | None = _row(
        None, kind.text, "default voice; see `realizer voices`; none: espeak-ng if installed, else silent"
    )
    language: str = _row("en-US", kind.text, "BCP-47 tag of speech without xml:lang")
    camera: str = _row(
        "front",
        kind.text,
        "default camera of pictures: front, three-quarter, profile, close, or the face's own",
    )
    light: str | None = _row(None, kind.text, "default light of pictures; none: portrait")
    background: str | None = _row(
        None,
        kind.background,
        "default background of pictures: a colour, a picture's file, or transparent; none: the light's own",
    )
    fps: float = _row(25.0, kind.real(0.01, 240), "default frames per second of streams")
    scene: Path | None = _row(None, kind.path, "file of targets for all sessions: NAME X Y Z, in metres")
    media: Path | None = _row(None, kind.folder, "folder of the files that documents may refer to")
    expressions: Path | None = _row(
        None, kind.folder, "folder of a user's expressions; none: only built-in ones"
    )
    edit: Path | None = _row(
        None,
        kind.writable_folder,
        "folder in which clients may save expressions, in DIR/expressions, which are then played too; none: "
        "they save nothing",
    )
    corpus: Path | None = _row(
        None, kind.folder, "corpus whose recordings clients may label in the page; none: they label nothing"
    )
    seed: int = _row(0, kind.whole(-(2**63), 2**63 - 1), "seed of idle motion")
    idle: bool = _row(True, kind.flag, "blinks and small head motion")
    liveliness: float = _row(
        1.0,
        kind.real(0, 1),
        "how much an idle face breathes, changes its posture and varies its blinks, 0 to 1",
    )
    cooccurrence: str = _row(
        "on", kind.switch_or_file, "rules for AUs that no face shows together: on, off, or a file"
    )
    prosody: bool = _row(True, kind.flag, "nods, brows, blinks and glances that accompany speech: on or off")
    jaw: float = _row(1.0, kind.real(0, 2), "how far the jaw opens in speech: 0 mumbles, 2 over-articulates")
    lips: float = _row(1.0, kind.real(0, 2), "how far the lips move in speech: 0 mumbles, 2 over-articulates")
    mapping: Path | None = _row(None, kind.file, "file that maps AUs to FAPs; none: each face's own mapping")
    strict_bml: bool = _row(False, kind.flag, "read documents as BML 1.0 only, without dialects")
    grace: float = _row(
        0.5,
        kind.real(0, 60),
        "seconds by which a behaviour may come too late for its references into other blocks",
    )
    keep: float = _row(
        60.0, kind.real(0, 1e9), "seconds that a named session lives after its last connection"
    )
    drain: float = _row(
        5.0, kind.real(0, 3600), "seconds that blocks may go on playing when the service stops"
    )
    max_message: int = _row(16 * 2**20, kind.whole(1, 2**31), "bytes of one WebSocket message")
    max_document: int = _row(2**20, kind.whole(1, 2**31), "bytes of BML in one message")
    max_elements: int = _row(100_000, kind.whole(1, 10**7), "XML elements in one message")
    max_behaviours: int = _row(10_000, kind.whole(1, 10**6), "behaviours in one block")
    max_planning: int = _row(
        2_500_000, kind.whole(1, 10**12), "steps of planning one block; about a million take a second"
    )
    max_duration: float = _row(1_800.0, kind.real(1, 1e9), "planned duration of a block in seconds")
    max_blocks: int = _row(
        1_000,
        kind.whole(1, 10**6),
        "blocks that play or wait in one session, and messages that wait with further blocks",
    )
    max_connections: int = _row(
        2_000, kind.whole(1, 10**6), "open connections per address, at each transport"
    )
    max_sessions: int = _row(5_000, kind.whole(1, 10**6), "sessions of each worker")
    max_address_sessions: int = _row(2_000, kind.whole(1, 10**6), "live sessions that one address has opened")
    max_size: int = _row(2048, kind.whole(16, 16384), "pixels of a picture's longer side")
    max_pixels: float = _row(
        125e6, kind.real(256, 1e12), "pixels per second of all pictures of a session: 1920x1080 at 60"
    )
    max_speech: int = _row(20_000, kind.whole(1, 10**7), "characters of one speech in a document")
    max_rate: float = _row(
        500.0, kind.real(0.1, 1e6), "messages per second that are read from one connection"
    )
    max_memory: int | None = _row(
        None, kind.whole(64, 10**7), "MB of the process above which no session is opened; none: no limit"
    )

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            try:
                object.__setattr__(self, f.name, f.metadata["read"](value))
            except ValueError as wanted:
                got = "something else" if f.metadata["secret"] else repr(value)
                raise SettingsError(f"setting {f.name}: wanted {wanted}, got {got}", f.name) from None
        for name, words in self._conflicts():
            raise SettingsError(f"setting {name}: wanted {words}", name)

    def _conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield settings that do not go with others, and what was wanted."""
        own, others = self.library_folder, self.expressions
        if own is not None and others is not None and others.resolve() != own.resolve():
            yield "edit", f"no other folder of expressions than {own}, got {others} too"
        if self.tls_key is not None and self.tls_cert is None:
            yield "tls_key", "tls_cert too, got none"
        if self.workers > 1 and not hasattr(socket, "send_fds"):
            yield "workers", f"1, got {self.workers}: processes of this system cannot share a port"
        if self.tls_cert is not None and self.workers > 1:
            why = "connections are distributed to workers by their first line; use TLS in a proxy in front of"
            yield "tls_cert", f"workers = 1, got {self.workers}: {why} the service"
        if self.jwt_audience is not None and self.jwt_key is None:
            yield "jwt_audience", "jwt_key too, got none"
        if is_loopback(self.host) or self.insecure:
            return
        if self.token is None and self.jwt_key is None:
            yield "host", f"token, jwt_key or insecure too, because other machines can reach {self.host}"
        for name in ("asap_ports", "xface_port"):
            if getattr(self, name) is not None and not self.allow:
                yield name, "allow or insecure too, or host 127.0.0.1: its clients cannot send the token"

    @property
    def library_folder(self) -> Path | None:
        """The folder of the user's expressions, which may not exist yet; None: only built-in ones."""
        return self.expressions if self.edit is None else self.edit / "expressions"

    def play_options(self, scene: Mapping[str, tuple[float, float, float]] | None = None) -> PlayOptions:
        """Return the options for playing; `scene` is the content of the file `self.scene`."""
        names = (f.name for f in fields(PlayOptions) if f.name != "scene")
        values = {name: getattr(self, name) for name in names}
        return PlayOptions(**values | {"expressions": self.library_folder}, scene=scene)

    @classmethod
    def read(
        cls,
        flags: Mapping[str, Any] | None = None,
        *,
        file: Path | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> Self:
        """Return the settings from all three sources.

        Args:
            flags: options of the command line, None if not set.
            file: TOML file.
            environment: variables; None: those of the process.

        Raises:
            SettingsError: an unknown name or a wrong value.
        """
        environment = os.environ if environment is None else environment
        known = {f.name for f in fields(cls)}
        values: dict[str, Any] = {}
        if file is not None:
            try:
                values |= parse_toml(file.read_text("utf-8-sig"))
            except (OSError, ValueError) as error:
                raise SettingsError(f"{file}: wanted settings in TOML, got: {error}") from None
        sources = dict.fromkeys(values, str(file))
        variables = [name.removeprefix(PREFIX).upper() for name in (*known, *OTHERS)]
        for name in sorted(name for name in environment.keys() - OTHERS if name.startswith(PREFIX)):
            setting = name.removeprefix(PREFIX).lower()
            if setting in known:
                values[setting], sources[setting] = environment[name], name
            elif closest := _closest(setting.upper(), variables):
                # A misspelt REALIZER_TOKEN would leave the service open.
                raise SettingsError(f"variable {name}: wanted {PREFIX}{closest}?")
            else:
                log.warning("variable %s: no setting has this name, so it changes nothing", name)
        if unknown := sorted(values.keys() - known):
            wanted = _closest(unknown[0], known, 0.65) or f"one of {', '.join(sorted(known))}"
            raise SettingsError(f"setting {unknown[0]}: wanted {wanted} ({file})")
        set_flags = {name: value for name, value in (flags or {}).items() if value is not None}
        try:
            return cls(**values | set_flags)
        except SettingsError as error:
            if error.setting in set_flags or error.setting not in sources:
                raise
            raise SettingsError(f"{error} ({sources[error.setting]})", error.setting) from None

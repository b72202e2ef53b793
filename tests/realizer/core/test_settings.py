"""Tests of `realizer.core.settings`."""

from __future__ import annotations

import contextlib
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from realizer.core.options import PlayOptions
from realizer.core.settings import Settings, SettingsError
from tests.rows import each_row


def test_settings_have_defaults() -> None:
    assert Settings.read(environment={}) == Settings()


def test_settings_prefer_flags_to_variables_to_the_file(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text('port = 1\nfps = 10\nface = "x"\n')
    environment = {"REALIZER_PORT": "2", "REALIZER_FPS": "30", "HOME": "nowhere"}
    settings = Settings.read({"port": 3, "voice": None}, file=file, environment=environment)
    assert (settings.port, settings.fps, settings.face, settings.voice) == (3, 30.0, "x", None)


def test_settings_name_a_wrong_value() -> None:
    with pytest.raises(SettingsError, match=r"setting port: wanted a whole number 0..65535, got '70000'"):
        Settings.read(environment={"REALIZER_PORT": "70000"})


def test_settings_do_not_truncate_numbers(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    for value in ("1.5", "inf", "true"):
        file.write_text(f"max_blocks = {value}\n")
        with pytest.raises(SettingsError, match=r"max_blocks: wanted a whole number 1\.\.1e\+06"):
            Settings.read(file=file, environment={})
    file.write_text("max_blocks = 7.0\n")
    assert Settings.read(file=file, environment={}).max_blocks == 7


@pytest.mark.parametrize(
    ("variable", "meant"),
    [("TOKN", "TOKEN"), ("MAX_MEMROY", "MAX_MEMORY"), ("JWTKEY", "JWT_KEY"), ("ORIGIN", "ORIGINS")],
)
def test_settings_refuse_a_misspelt_variable(variable: str, meant: str) -> None:
    with pytest.raises(SettingsError, match=rf"variable REALIZER_{variable}: wanted REALIZER_{meant}\?"):
        Settings.read(environment={f"REALIZER_{variable}": "x"})


def test_settings_ignore_other_variables() -> None:
    others = (
        "REALIZER_FACES",
        "REALIZER_DRAW",
        "REALIZER_HEAD_DATA",
        "REALIZER_NO_PAGE",
        "REALIZER_BUILD_HOST",
    )
    assert Settings.read(environment=dict.fromkeys(others, "x")) == Settings()


def test_settings_refuse_an_unknown_name_in_the_file(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text("prot = 1\n")
    with pytest.raises(SettingsError, match="prot"):
        Settings.read(file=file, environment={})


def test_settings_suggest_a_name_for_a_misspelt_one(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text("max-rate = 1\n")
    with pytest.raises(SettingsError, match=r"setting max-rate: wanted max_rate \(.*realizer\.toml\)"):
        Settings.read(file=file, environment={})


@pytest.mark.parametrize("written", [b"port 1", b'host = "\xff"', b"port = 1\nport = 2"])
def test_settings_name_a_file_that_is_not_toml(written: bytes, tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_bytes(written)
    with pytest.raises(SettingsError, match=r"realizer\.toml"):
        Settings.read(file=file, environment={})


def test_settings_read_a_file_with_a_byte_order_mark(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_bytes(b"\xef\xbb\xbffps = 30\r\n")
    assert Settings.read(file=file, environment={}).fps == 30


@each_row("name", [f.name for f in fields(Settings)])
@each_row("value", ["[1]", "{ a = 1 }", "2020-01-01", "-0.5"])
def test_settings_only_raise_settings_errors(name: str, value: str, tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text(f"{name} = {value}\n")
    with contextlib.suppress(SettingsError):
        Settings.read(file=file, environment={})


def test_settings_name_the_source_of_a_wrong_value(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text("record = 5\nport = 1\n")
    with pytest.raises(SettingsError, match=r"setting record: wanted .*, got 5 \(.*realizer\.toml\)"):
        Settings.read(file=file, environment={})
    with pytest.raises(SettingsError, match=r"setting port: wanted .*, got 'x' \(REALIZER_PORT\)"):
        Settings.read(file=file, environment={"REALIZER_PORT": "x", "REALIZER_RECORD": ""})
    with pytest.raises(SettingsError, match=r"setting port: wanted .*, got -1$"):
        Settings.read({"port": -1}, file=file, environment={"REALIZER_PORT": "x", "REALIZER_RECORD": ""})


@each_row(
    "name, value",
    [
        ("asap_ports", "7500"),
        ("asap_ports", "7500 0"),
        ("xface_port", "65536"),
        ("xface_player", "here"),
        ("xface_player_session", "a b"),
        ("xface_player_interval", "-1"),
        ("stomp", "here"),
        ("stomp", "here:0"),
        ("fps", "nan"),
        ("fps", "0"),
        ("fps", "fast"),
        ("idle", "maybe"),
        ("prosody", "loud"),
        ("face", ""),
        ("media", "no/such/folder"),
        ("origins", "example.org"),
        ("origins", "https://example.org/page"),
        ("log", "xml"),
        ("tls_cert", "no/such/file.pem"),
        ("max_memory", "1"),
        ("max_rate", "0"),
        ("max_blocks", "-1"),
        ("max_blocks", "1.5"),
        ("max_elements", "many"),
        ("max_duration", "inf"),
        ("max_address_sessions", "0"),
    ],
)
def test_settings_refuse_invalid_values(name: str, value: str) -> None:
    with pytest.raises(SettingsError, match=rf"setting {name}: wanted .*, got '{value}'"):
        Settings.read(environment={f"REALIZER_{name.upper()}": value})


def test_settings_parse_variables() -> None:
    words = {"IDLE": "off", "PROSODY": "off", "SEED": "7", "SCENE": "a/b", "VOICE": ""}
    words |= {"ASAP_PORTS": "7500, 7501", "STOMP": "[::1]:61613", "STOMP_VHMSG": ""}
    settings = Settings.read(environment={f"REALIZER_{name}": word for name, word in words.items()})
    assert (settings.asap_ports, settings.stomp, settings.stomp_vhmsg) == ((7500, 7501), "[::1]:61613", None)
    assert (settings.idle, settings.seed, settings.scene, settings.voice) == (False, 7, Path("a/b"), None)
    assert not settings.prosody


def test_settings_refuse_an_empty_token_and_show_none() -> None:
    with pytest.raises(SettingsError, match="setting token: wanted a word, got something else"):
        Settings.read(environment={"REALIZER_TOKEN": " "})
    assert "opensesame" not in repr(Settings(token="opensesame", stomp_password="opensesame"))


def test_settings_read_a_key_or_its_file(tmp_path: Path) -> None:
    pem = "-----BEGIN PUBLIC KEY-----\nMCow\n-----END PUBLIC KEY-----"
    secret = "x" * 32
    for text in (pem, secret):
        file = tmp_path / "key"
        file.write_text(text + "\n")
        assert Settings.read(environment={"REALIZER_JWT_KEY": str(file)}).jwt_key == text
        assert replace(Settings(jwt_key=text)).jwt_key == text  # as a worker reads it again
    assert Settings(jwt_key="y" * 5000).jwt_key == "y" * 5000  # longer than any name
    assert Settings().jwt_key is None


@pytest.mark.parametrize(
    "key", ["", " ", "opensesame", "x" * 31, f"/run/secrets/{'x' * 40}.pem", f"{'x' * 40}.key"]
)
def test_settings_refuse_a_short_or_missing_key_and_do_not_show_it(key: str, tmp_path: Path) -> None:
    short = tmp_path / "short"
    short.write_text(key)
    for value in (key, str(short)):
        with pytest.raises(SettingsError, match=r"jwt_key: wanted an existing PEM file, or") as refused:
            Settings.read(environment={"REALIZER_JWT_KEY": value})
        assert "got something else" in str(refused.value)


@pytest.mark.parametrize(
    "settings",
    [
        {"host": "127.0.0.2", "xface_port": 0},
        {"host": "localhost", "asap_ports": (0, 1)},
        {"host": "::1"},
        {"host": "0.0.0.0", "token": "x"},
        {"host": "0.0.0.0", "jwt_key": "x" * 32},
        {"host": "0.0.0.0", "token": "x", "xface_port": 0, "allow": "192.0.2.1, 198.51.100.7/24"},
        {"host": "::", "insecure": True, "xface_port": 0},
    ],
)
def test_settings_listen_beyond_this_machine_with_protection(settings: dict[str, Any]) -> None:
    assert Settings(**settings).host == settings["host"]


def test_settings_read_several_hosts_and_networks_from_a_text() -> None:
    read = Settings.read(
        environment={"REALIZER_HOSTS": "Face.example,[::1]", "REALIZER_ALLOW": "192.0.2.9/24"}
    )
    assert (read.hosts, read.allow) == (("face.example", "::1"), ("192.0.2.0/24",))
    for wrong in ({"hosts": "face.example:80"}, {"hosts": "http://face"}, {"allow": "face"}, {"allow": 7}):
        with pytest.raises(SettingsError, match=r"wanted (names or )?addresses"):
            Settings(**wrong)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"tls_key": Path(__file__)}, "setting tls_key: wanted tls_cert too"),
        ({"tls_cert": Path(__file__), "workers": 2}, "setting tls_cert: wanted workers = 1, got 2"),
        ({"token": "x", "host": "0.0.0.0", "xface_port": 0}, "its clients cannot send the token"),
        ({"jwt_key": "x" * 32, "host": "0.0.0.0", "xface_port": 0}, "its clients cannot send the token"),
        ({"jwt_audience": "faces"}, "setting jwt_audience: wanted jwt_key too"),
        (
            {"token": "x", "host": "::", "asap_ports": (0, 1)},
            "setting asap_ports: wanted allow or insecure too",
        ),
        (
            {"host": "0.0.0.0"},
            "setting host: wanted token, jwt_key or insecure too, because other machines can reach 0",
        ),
        ({"host": "::"}, "setting host: wanted token"),
        ({"host": "face.example", "allow": ["192.0.2.1"]}, "setting host: wanted token"),
    ],
)
def test_settings_refuse_contradictions(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(SettingsError, match=says):
        Settings(**settings)


def test_settings_parse_one_or_several_origins() -> None:
    settings = Settings.read(environment={"REALIZER_ORIGINS": "https://a.example, http://b.example:8000"})
    assert settings.origins == ("https://a.example", "http://b.example:8000")
    assert Settings(origins=["*"]).origins == ("*",)  # type: ignore[arg-type]


def test_settings_play_options_have_the_values_of_the_settings() -> None:
    assert Settings().play_options() == PlayOptions()
    cup = {"cup": (0.0, 0.0, 1.0)}
    settings = Settings(fps=50, idle=False, cooccurrence="off", prosody=False, seed=3)
    expected = PlayOptions(fps=50, idle=False, cooccurrence="off", prosody=False, seed=3, scene=cup)
    assert settings.play_options(cup) == expected


@pytest.mark.parametrize(("name", "least"), [("max_memory", 64), ("max_size", 16), ("max_pixels", 256)])
def test_settings_accept_the_least_value_and_no_lower_one(name: str, least: int) -> None:
    variable = f"REALIZER_{name.upper()}"
    assert getattr(Settings.read(environment={variable: str(least)}), name) == least
    with pytest.raises(SettingsError, match=f"{name}: wanted"):
        Settings.read(environment={variable: str(least - 1)})

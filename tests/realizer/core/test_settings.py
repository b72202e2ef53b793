"""Tests of `realizer.core.settings`."""

from __future__ import annotations

import contextlib
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from realizer.core.options import PlayOptions
from realizer.core.settings import OTHERS, Settings, SettingsError
from tests.rows import each_row


def test_settings_have_defaults() -> None:
    assert Settings.read(environment={}) == Settings()


def test_settings_prefer_flags_to_variables_to_the_file(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text('port = 1\nfps = 10\nface = "x"\n')
    environment = {"REALIZER_PORT": "2", "REALIZER_FPS": "30", "HOME": "nowhere"}
    settings = Settings.read({"port": 3, "voice": None}, file=file, environment=environment)
    assert (settings.port, settings.fps, settings.face, settings.voice) == (3, 30.0, "x", None)


def test_settings_raise_value_errors() -> None:
    with pytest.raises(ValueError, match="setting port: wanted a whole number"):
        Settings(port=-1)


def test_settings_name_a_wrong_value() -> None:
    with pytest.raises(SettingsError, match=r"setting port: wanted a whole number 0..65535, got '70000'"):
        Settings.read(environment={"REALIZER_PORT": "70000"})


@pytest.mark.parametrize(
    ("variable", "meant"),
    [
        ("TOKN", "TOKEN"),
        ("MAX_MEMROY", "MAX_MEMORY"),
        ("JWTKEY", "JWT_KEY"),
        ("ORIGIN", "ORIGINS"),
        ("DRAWS", "DRAW"),
    ],
)
def test_settings_refuse_a_misspelt_variable(variable: str, meant: str) -> None:
    with pytest.raises(SettingsError, match=rf"variable REALIZER_{variable}: wanted REALIZER_{meant}\?"):
        Settings.read(environment={f"REALIZER_{variable}": "x"})


def test_settings_warn_of_variables_that_nothing_reads(caplog: pytest.LogCaptureFixture) -> None:
    assert Settings.read(environment=dict.fromkeys(OTHERS, "x")) == Settings()
    assert not caplog.messages
    assert Settings.read(environment={"REALIZER_BUILD_HOST": "x", "REALIZED": "x"}) == Settings()
    assert caplog.messages == [
        "variable REALIZER_BUILD_HOST: no setting has this name, so it changes nothing"
    ]


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
        (
            {"edit": Path(__file__).parent, "expressions": Path(__file__).parent},
            "setting edit: wanted no other folder of expressions than .*expressions, got",
        ),
        ({"edit": Path(__file__)}, "setting edit: wanted an existing folder that can be written to, got"),
    ],
)
def test_settings_refuse_contradictions(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(SettingsError, match=says):
        Settings(**settings)


def test_settings_play_options_have_the_values_of_the_settings() -> None:
    assert Settings().play_options() == PlayOptions()
    cup = {"cup": (0.0, 0.0, 1.0)}
    settings = Settings(fps=50, idle=False, cooccurrence="off", prosody=False, seed=3)
    expected = PlayOptions(fps=50, idle=False, cooccurrence="off", prosody=False, seed=3, scene=cup)
    assert settings.play_options(cup) == expected


def test_settings_play_the_expressions_that_may_be_edited(tmp_path: Path) -> None:
    settings = Settings(edit=tmp_path)
    assert settings.play_options().expressions == tmp_path / "expressions"
    assert replace(settings, fps=50).library_folder == settings.library_folder


def test_settings_refuse_workers_where_processes_cannot_share_a_port(monkeypatch) -> None:
    monkeypatch.delattr("socket.send_fds")
    with pytest.raises(SettingsError, match="setting workers: wanted 1, got 2"):
        Settings(workers=2)

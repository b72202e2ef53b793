"""Settings come from flags, variables and a file, in that order of weight."""

from __future__ import annotations

import contextlib
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from realizer.core.options import PlayOptions
from realizer.core.settings import Settings, SettingsError


def test_defaults_need_nothing() -> None:
    assert Settings.read(environment={}) == Settings()


def test_flags_win_over_variables_and_those_over_the_file(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text('port = 1\nfps = 10\nface = "x"\n')
    environment = {"REALIZER_PORT": "2", "REALIZER_FPS": "30", "HOME": "nowhere"}
    settings = Settings.read({"port": 3, "voice": None}, file=file, environment=environment)
    assert (settings.port, settings.fps, settings.face, settings.voice) == (3, 30.0, "x", None)


def test_a_wrong_value_says_which_and_what_came() -> None:
    with pytest.raises(SettingsError, match=r"setting port: wanted a whole number 0..65535, got '70000'"):
        Settings.read(environment={"REALIZER_PORT": "70000"})


def test_a_part_of_a_whole_number_is_not_cut_off(tmp_path: Path) -> None:
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
def test_a_variable_that_was_written_wrong_leaves_no_door_open(variable: str, meant: str) -> None:
    with pytest.raises(SettingsError, match=rf"variable REALIZER_{variable}: wanted REALIZER_{meant}\?"):
        Settings.read(environment={f"REALIZER_{variable}": "x"})


def test_a_variable_that_is_no_setting_is_somebody_elses() -> None:
    others = (
        "REALIZER_FACES",
        "REALIZER_DRAW",
        "REALIZER_HEAD_DATA",
        "REALIZER_NO_PAGE",
        "REALIZER_BUILD_HOST",
    )
    assert Settings.read(environment=dict.fromkeys(others, "x")) == Settings()


def test_an_unknown_name_in_the_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text("prot = 1\n")
    with pytest.raises(SettingsError, match="prot"):
        Settings.read(file=file, environment={})


def test_a_name_in_the_file_that_was_written_wrong_is_told_what_was_meant(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text("max-rate = 1\n")
    with pytest.raises(SettingsError, match=r"setting max-rate: wanted max_rate \(.*realizer\.toml\)"):
        Settings.read(file=file, environment={})


@pytest.mark.parametrize("written", [b"port 1", b'host = "\xff"', b"port = 1\nport = 2"])
def test_a_file_that_is_not_toml_is_named(written: bytes, tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_bytes(written)
    with pytest.raises(SettingsError, match=r"realizer\.toml"):
        Settings.read(file=file, environment={})


def test_a_file_may_begin_as_editors_of_windows_begin_it(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_bytes(b"\xef\xbb\xbffps = 30\r\n")
    assert Settings.read(file=file, environment={}).fps == 30


@pytest.mark.parametrize("name", [f.name for f in fields(Settings)])
@pytest.mark.parametrize("value", ["[1]", "{ a = 1 }", "2020-01-01", "-0.5"])
def test_no_value_of_a_file_is_more_than_refused(name: str, value: str, tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text(f"{name} = {value}\n")
    with contextlib.suppress(SettingsError):
        Settings.read(file=file, environment={})


def test_a_wrong_value_says_where_it_stands(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    file.write_text("record = 5\nport = 1\n")
    with pytest.raises(SettingsError, match=r"setting record: wanted .*, got 5 \(.*realizer\.toml\)"):
        Settings.read(file=file, environment={})
    with pytest.raises(SettingsError, match=r"setting port: wanted .*, got 'x' \(REALIZER_PORT\)"):
        Settings.read(file=file, environment={"REALIZER_PORT": "x", "REALIZER_RECORD": ""})
    with pytest.raises(SettingsError, match=r"setting port: wanted .*, got -1$"):
        Settings.read({"port": -1}, file=file, environment={"REALIZER_PORT": "x", "REALIZER_RECORD": ""})


@pytest.mark.parametrize(
    ("name", "value"),
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
def test_what_cannot_be_is_refused_with_what_was_wanted(name: str, value: str) -> None:
    with pytest.raises(SettingsError, match=rf"setting {name}: wanted .*, got '{value}'"):
        Settings.read(environment={f"REALIZER_{name.upper()}": value})


def test_words_of_the_environment_become_what_they_mean() -> None:
    words = {"IDLE": "off", "PROSODY": "off", "SEED": "7", "SCENE": "a/b", "VOICE": ""}
    words |= {"ASAP_PORTS": "7500, 7501", "STOMP": "[::1]:61613", "STOMP_VHMSG": ""}
    settings = Settings.read(environment={f"REALIZER_{name}": word for name, word in words.items()})
    assert (settings.asap_ports, settings.stomp, settings.stomp_vhmsg) == ((7500, 7501), "[::1]:61613", None)
    assert (settings.idle, settings.seed, settings.scene, settings.voice) == (False, 7, Path("a/b"), None)
    assert not settings.prosody


def test_a_token_that_was_left_empty_is_refused_and_no_token_is_ever_shown() -> None:
    with pytest.raises(SettingsError, match="setting token: wanted a word, got something else"):
        Settings.read(environment={"REALIZER_TOKEN": " "})
    assert "opensesame" not in repr(Settings(token="opensesame", stomp_password="opensesame"))


def test_a_key_is_a_file_or_the_key_itself(tmp_path: Path) -> None:
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
def test_a_key_that_is_short_or_not_there_is_refused_and_not_shown(key: str, tmp_path: Path) -> None:
    short = tmp_path / "short"
    short.write_text(key)
    for value in (key, str(short)):
        with pytest.raises(SettingsError, match=r"jwt_key: wanted an existing PEM file, or") as refused:
            Settings.read(environment={"REALIZER_JWT_KEY": value})
        assert "got something else" in str(refused.value)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"tls_key": Path(__file__)}, "setting tls_key: wanted tls_cert too"),
        ({"tls_cert": Path(__file__), "workers": 2}, "setting tls_cert: wanted workers = 1, got 2"),
        ({"token": "x", "host": "0.0.0.0", "xface_port": 0}, "its clients cannot send the token"),
        ({"jwt_key": "x" * 32, "host": "0.0.0.0", "xface_port": 0}, "its clients cannot send the token"),
        ({"jwt_audience": "faces"}, "setting jwt_audience: wanted jwt_key too"),
        ({"token": "x", "host": "::", "asap_ports": (0, 1)}, "setting asap_ports: wanted none, or host 127"),
    ],
)
def test_what_cannot_be_together_is_refused(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(SettingsError, match=says):
        Settings(**settings)


def test_pages_elsewhere_are_named_in_one_word_or_several() -> None:
    settings = Settings.read(environment={"REALIZER_ORIGINS": "https://a.example, http://b.example:8000"})
    assert settings.origins == ("https://a.example", "http://b.example:8000")
    assert Settings(origins=["*"]).origins == ("*",)  # type: ignore[arg-type]


def test_play_options_have_the_defaults_and_the_values_of_the_settings() -> None:
    assert Settings().play_options() == PlayOptions()
    cup = {"cup": (0.0, 0.0, 1.0)}
    settings = Settings(fps=50, idle=False, cooccurrence="off", prosody=False, seed=3)
    expected = PlayOptions(fps=50, idle=False, cooccurrence="off", prosody=False, seed=3, scene=cup)
    assert settings.play_options(cup) == expected

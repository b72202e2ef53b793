"""The image's steps without Docker: its files are linted, installed by its script, and run where nothing can
be written."""

from __future__ import annotations

import asyncio
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml
from websockets.asyncio.client import connect

from realizer.cli.serve import serve
from realizer.core.settings import Settings
from realizer.server.http.metrics import GAUGES, Metrics
from tests.waiting import LIMIT

pytestmark = pytest.mark.xdist_group("image")

ROOT = Path(__file__).parents[1]
DOCKER = ROOT / "docker"
DOCKERFILE = (DOCKER / "Dockerfile").read_text("utf-8")
COMPOSE = yaml.safe_load((DOCKER / "compose.yaml").read_text("utf-8"))
NODES = {name: service for name, service in COMPOSE["services"].items() if "build" in service}

# Nothing of the system can be written but memory that processes share; root has no rights of its own.
CONFINED = """set -e
mount --make-rprivate /
mount -o remount,bind,ro /
mount -t tmpfs -o mode=1777 shm /dev/shm
if touch "$WRITABLE" 2>/dev/null; then echo "$WRITABLE can be written"; exit 1; fi
cd /
exec setpriv --bounding-set -all --inh-caps -all --no-new-privs "$@"
"""


def tool(name: str) -> str:
    """A program beside Python or on the PATH."""
    found = shutil.which(name, path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


def checked(*command: str | Path, **environment: str) -> str:
    """What a command that must succeed prints."""
    done = subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, timeout=LIMIT, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def variables() -> dict[str, str]:
    """What the Dockerfile sets for the service, but the PATH."""
    joined = re.sub(r"\\\n\s*", "", DOCKERFILE)
    words = [word for line in re.findall(r"^ENV (.+)$", joined, re.M) for word in line.split()]
    return {name: value for name, _, value in (word.partition("=") for word in words) if name != "PATH"}


# The files -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("script", ["install.sh", "start.sh"])
def test_scripts_run_in_any_shell(script: str) -> None:
    checked(tool("sh"), "-n", DOCKER / script)
    checked(tool("shellcheck"), DOCKER / script)


@pytest.fixture
def start(tmp_path: Path) -> Callable[..., str]:
    """Run the entry point of the image; return the token that `realizer` gets, and its arguments."""
    stub, folder = tmp_path / "bin" / "realizer", tmp_path / "volume"
    stub.parent.mkdir()
    folder.mkdir()
    stub.write_text('#!/bin/sh\necho "${REALIZER_TOKEN-none} $*"\n')
    stub.chmod(0o755)
    path = f"{stub.parent}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return lambda *command, **environment: checked(
        DOCKER / "start.sh", *command, **{"PATH": path, "TOKEN_FOLDER": str(folder), **environment}
    )


def test_start_script_makes_one_token_and_keeps_it(start: Callable[..., str], tmp_path: Path) -> None:
    first = start("serve", "--log", "json")
    token = (tmp_path / "volume" / "token").read_text().strip()
    assert first == f"{token} serve --log json\n"
    assert len(token) >= 32
    assert start("serve") == f"{token} serve\n"
    assert [file.name for file in (tmp_path / "volume").iterdir()] == ["token"]


def test_start_script_makes_no_token_where_one_is_set(start: Callable[..., str], tmp_path: Path) -> None:
    assert start("voices") == "none voices\n"
    assert start("serve", REALIZER_TOKEN="mine") == "mine serve\n"
    assert start("serve", REALIZER_TOKEN="") == " serve\n"  # which the service refuses
    assert start("serve", REALIZER_JWT_KEY="k" * 32) == "none serve\n"
    assert start("serve", REALIZER_INSECURE="1") == "none serve\n"
    assert not list((tmp_path / "volume").iterdir())


def test_image_keeps_its_token_on_a_volume_of_its_user() -> None:
    assert re.search(r"^ENTRYPOINT \[\"/opt/realizer/bin/start\"\]$", DOCKERFILE, re.M)
    assert re.search(r"^VOLUME /run/realizer$", DOCKERFILE, re.M)
    assert re.search(r"^RUN install -d -o 10001 .* /run/realizer$", DOCKERFILE, re.M)
    assert all(node["volumes"] == ["token:/run/realizer"] for node in NODES.values())


def test_dockerfile_passes_its_linter() -> None:
    checked(tool("hadolint"), "--failure-threshold", "style", DOCKER / "Dockerfile")


def test_proxy_accepts_its_configuration() -> None:
    program, places = tool("haproxy"), {"NODE_1": "127.0.0.1:8766", "NODE_2": "127.0.0.1:8767"}
    assert "valid" in checked(program, "-c", "-f", DOCKER / "haproxy.cfg", **places)


def test_image_runs_as_a_numeric_user_that_is_not_root() -> None:
    users = re.findall(r"^USER (\d+):(\d+)$", DOCKERFILE, re.M)
    assert users
    assert "0" not in users[-1]


def test_image_installs_extras_that_exist() -> None:
    assert re.search(r"^RUN docker/install.sh ", DOCKERFILE, re.M)
    script = (DOCKER / "install.sh").read_text("utf-8")
    extras = re.search(r"^extras=\$\{2:-(.+)\}$", script, re.M)
    assert extras is not None
    there = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    assert set(extras[1].split(",")) <= set(there)


# The compose file ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", COMPOSE["services"])
def test_compose_gives_services_no_rights_and_no_writable_disk(name: str) -> None:
    service = COMPOSE["services"][name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    # Ours has its user in its image.
    assert name in NODES or service["user"] not in ("root", "0")


@pytest.mark.parametrize("name", COMPOSE["services"])
def test_compose_limits_logs_and_processes_and_checks_health(
    name: str,
) -> None:
    service = COMPOSE["services"][name]
    # Ours has its check in its image.
    check = service.get("healthcheck", {"test": ["CMD"]} if name in NODES else None)
    assert check["test"][0] == "CMD"
    assert service["restart"] == "unless-stopped"
    assert service["logging"] == {"driver": "local"}
    assert 0 < service["pids_limit"] <= 1000


def test_image_has_a_health_check() -> None:
    assert re.search(r"^HEALTHCHECK .*\\\n +CMD \[", DOCKERFILE, re.M)


def test_compose_keeps_the_journal_on_a_volume() -> None:
    journal = COMPOSE["services"]["journal"]
    words = iter(journal["command"][1:])
    options = {name.removeprefix("--"): value for name, value in zip(words, words, strict=True)}
    assert options["appendonly"] == "yes"
    assert options["maxmemory-policy"] == "noeviction"
    assert journal["volumes"] == ["journal:/data"]
    assert "journal" in COMPOSE["volumes"]


@pytest.mark.parametrize("name", COMPOSE["services"])
def test_compose_names_images_and_existing_settings(name: str) -> None:
    service = COMPOSE["services"][name]
    assert name in NODES or re.fullmatch(r"[a-z/]+:\d+\.\d+[a-z.-]*", service["image"])
    assert set(service["networks"]) <= set(COMPOSE["networks"])
    assert set(service.get("depends_on", {})) <= set(COMPOSE["services"])
    for waited, until in service.get("depends_on", {}).items():
        assert until == {"condition": "service_healthy"}
        assert waited in NODES or "healthcheck" in COMPOSE["services"][waited]
    for volume in service.get("volumes", []):
        where = volume.split(":")[0]
        assert where in COMPOSE["volumes"] or (DOCKER / where).is_file()


def test_compose_publishes_only_the_proxy_on_this_machine() -> None:
    assert COMPOSE["networks"]["inside"] == {"internal": True}
    open_ones = {name for name, service in COMPOSE["services"].items() if "outside" in service["networks"]}
    assert open_ones == {"proxy"}
    assert [name for name, service in COMPOSE["services"].items() if "ports" in service] == ["proxy"]
    assert all("127.0.0.1" in port for port in COMPOSE["services"]["proxy"]["ports"])


@pytest.mark.parametrize("name", NODES)
def test_compose_gives_nodes_options_that_exist(name: str) -> None:
    node = NODES[name]
    assert (DOCKER / node["build"]["context"] / node["build"]["dockerfile"]).is_file()
    assert node["command"][0] == "serve"
    flags = serve.make_context("serve", node["command"][1:]).params
    given = {**variables(), **node["environment"]}
    said = {"REALIZER_TOKEN": "made at the start"}
    said |= {name: value for name, value in given.items() if value is not None}
    assert all(name.removeprefix("REALIZER_").lower() in vars(Settings()) for name in node["environment"])
    settings = Settings.read({k: v for k, v in flags.items() if k != "config"}, environment=said)
    assert settings.host == "0.0.0.0"
    assert settings.journal is not None
    assert settings.journal.startswith("redis://journal:")
    assert settings.drain < float(node["stop_grace_period"].removesuffix("s"))


def test_proxy_knows_every_node() -> None:
    configuration = (DOCKER / "haproxy.cfg").read_text("utf-8")
    servers = dict(re.findall(r'^    server (\S+) "\$\{\w+-(\S+)\}"$', configuration, re.M))
    assert servers == {name: f"{name}:{variables()['REALIZER_PORT']}" for name in NODES}


def test_alerts_are_rules_that_prometheus_accepts() -> None:
    checked(tool("promtool"), "check", "rules", DOCKER / "alerts.yml")


def test_alerts_name_metrics_of_the_service_and_say_what_to_do() -> None:
    text = Metrics().text(dict.fromkeys(GAUGES, 0), {})
    known = set(re.findall(r"^(realizer_\w+)", text, re.M))
    (group,) = yaml.safe_load((DOCKER / "alerts.yml").read_text("utf-8"))["groups"]
    for rule in group["rules"]:
        assert set(re.findall(r"realizer_\w+", rule["expr"])) <= known
        assert rule["labels"]["severity"] in ("page", "ticket")
        assert rule["annotations"]["summary"].endswith(".")
    assert len({rule["alert"] for rule in group["rules"]}) == len(group["rules"]) >= 8


# What is installed -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the image's script has put the realizer; what it needs of others is taken from here."""
    target = tmp_path_factory.mktemp("image") / "realizer"
    settings = {
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": sysconfig.get_path("purelib"),
        "PIP_NO_DEPS": "1",
        "PIP_NO_INDEX": "1",
        "PIP_NO_BUILD_ISOLATION": "0",  # pip means by it that there is none
        "PIP_IGNORE_INSTALLED": "1",
    }
    assert checked(DOCKER / "install.sh", target, "speech", **settings).startswith("realizer, version ")
    return target


def test_install_script_prints_its_usage() -> None:
    done = subprocess.run([DOCKER / "install.sh"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "TARGET" in done.stderr


def test_install_script_takes_versions_and_hashes_from_the_lock_file(tmp_path: Path) -> None:
    stub, target = tmp_path / "bin" / "python3", tmp_path / "target"
    stub.parent.mkdir()
    (target / "bin").mkdir(parents=True)
    for program in (stub, target / "bin" / "realizer"):
        program.write_text('#!/bin/sh\necho "$*"\n')
        program.chmod(0o755)
    path = f"{stub.parent}{os.pathsep}{os.environ['PATH']}"
    done = checked(DOCKER / "install.sh", target, PATH=path, WHEEL="dist/made.whl").splitlines()
    pip = f"-m pip --python {target}/bin/python3"
    install = f"{pip} install --quiet --no-cache-dir"
    assert done == [
        f"-m venv --without-pip {target}",
        f"{install} --require-hashes --requirement {DOCKER}/requirements.txt",
        f"{install} --no-deps dist/made.whl",
        f"{pip} check",
        "--version",
    ]


@pytest.mark.long
@pytest.mark.slow
def test_install_script_installs_realizer_without_pip(installed: Path) -> None:
    assert (installed / "bin" / "realizer").is_file()
    assert list(installed.glob("lib/*/site-packages/realizer/_faces/*/face.toml"))
    assert not list(installed.glob("lib/*/site-packages/pip"))


def namespace() -> list[str]:
    """A command that runs another one in a file system of its own."""
    for options in (["-m"], ["-r", "-m"]):
        command = [tool("unshare"), *options]
        tried = subprocess.run(
            [*command, "sh", "-c", "mount --make-rprivate / && mount -o remount,bind,ro /"],
            capture_output=True,
            check=False,
        )
        if tried.returncode == 0:
            return command
    pytest.skip("this system lets nobody have a file system of their own")


@contextmanager
def confined(command: list[str], writable: Path, environment: Mapping[str, str]) -> Iterator[str]:
    """A service where nothing can be written; its address."""
    whole = [*namespace(), "sh", "-c", CONFINED, "sh", *command]
    variables = {**os.environ, **environment, "WRITABLE": str(writable)}
    with subprocess.Popen(whole, stdout=subprocess.PIPE, text=True, env=variables) as service:
        assert service.stdout is not None
        try:
            first = service.stdout.readline()
            assert first.startswith("listening on "), first
            yield first.split()[2]
        finally:
            service.terminate()


@pytest.mark.gl("onboard")
@pytest.mark.espeak
@pytest.mark.slow
def test_service_works_on_a_read_only_disk(installed: Path) -> None:
    async def test(url: str) -> list[str]:
        streams, texts = set(), []
        async with asyncio.timeout(LIMIT), connect(url, max_size=None) as client:
            for asked in ({"stream": "video", "fps": 2, "size": [64, 64]}, {"stream": "audio"}):
                await client.send(json.dumps({"type": "subscribe", **asked}))
            await client.send('<bml id="b"><speech id="s"><text>Hello</text></speech></bml>')
            while not ({3, 4} <= streams and any('id="b:end"' in text for text in texts)):
                message = await client.recv()
                if isinstance(message, bytes):
                    streams.add(message[0])
                else:
                    assert '"error"' not in message
                    texts.append(message)
        return texts

    health = re.search(r'CMD \["python3", (".*")\]', DOCKERFILE)
    assert health is not None
    options: list[Any] = json.loads(f"[{health[1]}]")
    environment = {
        **variables(),
        "HOME": "/nowhere",
        "PYTHONPATH": sysconfig.get_path("purelib"),
        "REALIZER_HOST": "127.0.0.1",
        "REALIZER_PORT": "0",
        "REALIZER_WORKERS": "2",
    }
    command = [str(installed / "bin" / "realizer"), "serve"]
    with confined(command, installed / "written", environment) as url:
        assert not any("warningFeedback" in text for text in asyncio.run(test(url)))
        port = url.rpartition(":")[2].partition("/")[0]
        checked(sys.executable, *options, REALIZER_PORT=port)
    assert subprocess.run(
        [sys.executable, *options],
        env={**os.environ, "REALIZER_PORT": port},
        capture_output=True,
        check=False,
    ).returncode

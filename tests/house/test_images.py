import json
import re
from pathlib import Path

import pytest

from tests.house.compose_file import read_compose_file
from tests.house.requirements import ROOT

IMAGES = sorted((ROOT / "deploy").glob("*.Dockerfile"))
FILE = read_compose_file({})


def instructions(path: Path) -> list[tuple[str, str]]:
    """Return (instruction, arguments) of a Dockerfile, continued lines joined."""
    joined = path.read_text().replace("\\\n", " ")
    lines = [line for line in joined.splitlines() if line.strip() and not line.startswith("#")]
    return [(word, rest.strip()) for word, _, rest in (line.partition(" ") for line in lines)]


def last_stage(path: Path) -> list[tuple[str, str]]:
    """Return the instructions of the stage that is shipped."""
    found = instructions(path)
    starts = [index for index, (word, _) in enumerate(found) if word == "FROM"]
    assert len(starts) == 2, "one stage builds, one is shipped"
    return found[starts[-1] :]


def argument(path: Path, word: str) -> str:
    """Return the one argument of an instruction in the shipped stage."""
    (value,) = [rest for found, rest in last_stage(path) if found == word]
    return value


def test_there_is_an_image_for_each_service() -> None:
    assert [path.name for path in IMAGES] == ["api.Dockerfile", "worker.Dockerfile"]
    named = {
        service.raw["build"]["dockerfile"]
        for service in FILE.services.values()
        if "build" in service.raw
    }
    assert named == {f"deploy/{path.name}" for path in IMAGES}


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.stem)
def test_an_image_stands_on_debian_13_with_the_python_of_the_project(path: Path) -> None:
    version = (ROOT / ".python-version").read_text().strip()
    bases = {rest.split()[0] for word, rest in instructions(path) if word == "FROM"}
    assert bases == {f"python:{version}-slim-trixie"}


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.stem)
def test_an_image_ends_as_a_user_without_rights(path: Path) -> None:
    stage = last_stage(path)
    user = argument(path, "USER")
    assert user.isdigit()
    assert int(user) >= 1000
    after = stage[[word for word, _ in stage].index("USER") :]
    assert "RUN" not in {word for word, _ in after}


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.stem)
def test_every_install_is_pinned_by_hash(path: Path) -> None:
    runs = " && ".join(rest for word, rest in instructions(path) if word == "RUN")
    installs = [part for part in re.split(r"&&", runs) if re.search(r"pip\b.*\binstall\b", part)]
    assert installs
    for install in installs:
        assert "--no-deps" in install
        assert "--require-hashes" in install or "--no-index" in install


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.stem)
def test_an_image_installs_its_own_lock_only(path: Path) -> None:
    used = set(re.findall(r"locks/(\w+)\.txt", path.read_text()))
    assert used == {"build", path.stem}


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.stem)
def test_what_is_copied_exists_and_passes_the_ignore_file(path: Path) -> None:
    allowed = {
        line[1:]
        for line in (ROOT / ".dockerignore").read_text().splitlines()
        if line.startswith("!")
    }
    for word, rest in instructions(path):
        if word == "COPY" and not rest.startswith("--from"):
            for source in rest.split()[:-1]:
                assert (ROOT / source).exists(), source
                assert source in allowed


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.stem)
def test_an_image_alone_starts_as_the_compose_file_starts_it(path: Path) -> None:
    service = FILE.services[path.stem]
    assert tuple(json.loads(argument(path, "CMD"))) == service.command
    health = argument(path, "HEALTHCHECK").partition(" CMD ")[2]
    assert tuple(json.loads(health)) == service.healthcheck


@pytest.mark.parametrize("path", IMAGES, ids=lambda path: path.stem)
def test_no_secret_is_baked_in(path: Path) -> None:
    text = path.read_text().lower()
    assert not re.search(r"password|secret|token|access_key", text)

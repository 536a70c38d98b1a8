"""The README says what the code says."""

from __future__ import annotations

import re
from pathlib import Path

from backend.shell.link.topics_table import topics_markdown
from cockpit.schemas import SCHEMAS


def test_the_topic_table_is_the_codes_own(repository: Path) -> None:
    assert topics_markdown().strip() in (repository / "README.md").read_text()


def test_the_two_commands_come_first(repository: Path) -> None:
    blocks = re.findall(r"```\n(.*?)```", (repository / "README.md").read_text(), re.S)
    assert [line.split("#")[0].strip() for line in blocks[0].splitlines()] == [
        "make demo",
        "make test",
    ]


def test_every_file_it_names_exists(repository: Path) -> None:
    text = re.sub(r"```.*?```", "", (repository / "README.md").read_text(), flags=re.S)
    for target in re.findall(r"\]\(([^)#:]+)\)", text):
        assert (repository / target).exists(), target


def test_every_room_is_explained(repository: Path) -> None:
    text = (repository / "README.md").read_text()
    for folder in sorted((repository / "backend").iterdir()):
        if folder.is_dir() and not folder.name.startswith("__"):
            assert f"`backend/{folder.name}`" in text, folder.name


def test_every_document_has_a_schema() -> None:
    for name, (model, what) in SCHEMAS.items():
        assert model.model_json_schema()["type"] == "object", name
        assert what

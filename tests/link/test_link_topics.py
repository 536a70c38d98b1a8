"""The topic table is the only place that knows keys, types and priorities."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backend.shell.link.codec import _READERS
from backend.shell.link.session import open_session, publisher, zenoh_congestion, zenoh_priority
from backend.shell.link.topics import (
    TOPICS,
    Congestion,
    Direction,
    Priority,
    key,
    match,
    topic,
)
from backend.shell.link.topics_table import topics_markdown
from backend.shell.link.typestore import TYPESTORE

FIELDS = {"machine": "left", "link": "boom", "kind": "sun", "camera": "cab"}


def test_names_and_templates_are_unique():
    assert len({t.name for t in TOPICS}) == len({t.template for t in TOPICS}) == len(TOPICS)


def test_one_congestion_control_per_priority():
    by_priority = {}
    for row in TOPICS:
        by_priority.setdefault(row.priority, set()).add(row.congestion)
    assert all(len(policies) == 1 for policies in by_priority.values())


def test_zenoh_rules():
    assert topic("cmd").priority is Priority.REAL_TIME
    for row in TOPICS:
        if row.priority in (Priority.REAL_TIME, Priority.INTERACTIVE_HIGH):
            assert row.express
            assert row.congestion is Congestion.DROP
        if row.direction is Direction.TO_MACHINE:
            assert row.priority is Priority.REAL_TIME
    assert topic("joint_states").priority is Priority.INTERACTIVE_HIGH
    assert topic("alarm").priority is Priority.DATA_HIGH
    assert topic("alarm").congestion is Congestion.BLOCK


def test_types_exist_and_every_message_of_a_machine_has_a_reader():
    for row in TOPICS:
        if row.of_machine:
            assert row.type in TYPESTORE.types or (row.queryable and row.type == "JSON")
    machine_rows = {t.name for t in TOPICS if t.of_machine and not t.queryable}
    assert set(_READERS) == machine_rows - {"points", "limits"}  # limits: `decode_limits`


@pytest.mark.parametrize("row", [t for t in TOPICS if t.of_machine], ids=lambda t: t.name)
def test_match_inverts_key(row):
    fields = {k: FIELDS[k] for k in re.findall(r"\{(\w+)\}", row.template) if k != "machine"}
    suffix = key(row.name, "left", **fields).removeprefix("left/")
    assert match(suffix) == (row, fields)


@given(st.text(max_size=30))
def test_match_accepts_nothing_else(text):
    found = match(text)
    if found is not None:
        row, fields = found
        assert row.template == "{machine}/" + text or row.name in ("imu", "camera")
        assert key(row.name, "left", **fields) == "left/" + text


def test_publishers_are_made_from_the_table():
    session = open_session()
    for row in TOPICS:
        fields = {k: FIELDS[k] for k in re.findall(r"\{(\w+)\}", row.template) if k != "machine"}
        if row.queryable:
            with pytest.raises(ValueError, match="asked for"):
                publisher(session, row.name, "left", **fields)
            continue
        out = publisher(session, row.name, "left", **fields)
        assert str(out.key_expr) == row.template.format(**FIELDS)
        assert out.priority == zenoh_priority(row)
        assert out.congestion_control == zenoh_congestion(row)
    session.close()


def test_markdown_lists_every_row():
    lines = topics_markdown().splitlines()
    assert len(lines) == len(TOPICS) + 2
    for row, line in zip(TOPICS, lines[2:], strict=True):
        assert line.count("|") == 10
        for text in (row.template, row.type, row.priority.value, row.congestion.value):
            assert text in line


def test_nothing_outside_the_table_names_a_key(repository):
    """Keys are written down in topics.py only; other files ask for them by the row's name."""
    keys = [row.template.split("/", 1)[1] for row in TOPICS]
    slashed = [k for k in keys if "/" in k]
    for folder in ("link", "sim", "agent"):
        for file in (repository / "backend" / "shell" / folder).rglob("*.py"):
            if file.name == "topics.py":
                continue
            code = re.sub(r'""".*?"""', "", file.read_text(), flags=re.S)
            for text in slashed:
                assert f'"{text}"' not in code, f"{file.name} writes {text}"
                assert f"/{text}" not in code, f"{file.name} writes {text}"

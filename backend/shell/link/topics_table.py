"""The topic table as text, for the README."""

from __future__ import annotations

from backend.shell.link.topics import TOPICS


def topics_markdown() -> str:
    """The table as Markdown, for the README."""
    head = "| key | type | Hz | priority | congestion | express | recorded | direction | what |"
    lines = [head, "|" + "---|" * 9]
    for row in TOPICS:
        cells = (
            f"`{row.template}`" + (" (queryable)" if row.queryable else ""),
            row.type,
            row.rate,
            row.priority.value,
            row.congestion.value,
            "yes" if row.express else "no",
            "yes" if row.recorded else "no",
            row.direction.value,
            row.description,
        )
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"

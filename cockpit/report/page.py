"""The report of a session: what happened, plots, incursions with figures, a 3D replay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from html import escape
from typing import Any

import numpy as np

from backend.documents.snapshot import snapshot_document
from backend.pipeline.config import Config
from backend.pipeline.records import Snapshot
from cockpit.report.incursions import Incursion, incursions
from cockpit.report.svg import Band, Plot, draw, plan
from cockpit.views.inputs import SceneSite
from cockpit.views.replay import replay_html

Moments = Sequence[tuple[float, Snapshot]]

MOST_FIGURES = 12
REPLAY_SECONDS = 300.0
REPLAY_PERIOD = 0.2
AROUND = 5.0  # [s] before and after an incursion that a long session's replay shows
LEVEL_COLOURS = {"SLOW": "#ffa51f", "STOP": "#c4262e", "UNKNOWN": "#8a949e"}

STYLE = """
body{font:15px/1.45 system-ui,sans-serif;color:#1b2228;max-width:1000px;
 margin:24px auto;padding:0 16px}
h1{font-size:24px;margin:0}h2{font-size:18px;margin:28px 0 8px}
table{border-collapse:collapse;width:100%;font-size:14px}
td,th{border-bottom:1px solid #d5dbe0;padding:3px 8px;text-align:left;vertical-align:top}
td.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
svg{width:100%;height:auto;font:12px system-ui,sans-serif;fill:#1b2228}svg.plan{max-width:420px}
.grid{stroke:#e3e8ec;fill:none}.axis{stroke:#5b6770;fill:none}.curve{fill:none;stroke-width:1.6}
.limit{stroke:#5b6770;stroke-dasharray:4 4;fill:none}.title{font-weight:600}
.band{text-anchor:middle;font-size:11px}.closest{stroke:#c4262e;stroke-width:2;fill:none}
.note{background:#fff3d6;border-left:4px solid #ffa51f;padding:6px 12px}.dim{color:#5b6770}
figure{margin:0 0 18px;display:flex;gap:20px;flex-wrap:wrap;break-inside:avoid}
figcaption{flex:1;min-width:260px}iframe{width:100%;height:560px;border:1px solid #d5dbe0}
"""


def report_html(
    session: Mapping[str, Any],
    series: Mapping[str, Any],
    moments: Moments,
    config: Config,
    scene: SceneSite,
    difference: Mapping[str, Any] | None = None,
) -> str:
    """One self-contained HTML document.

    session, series, difference: the documents of /api/session, /api/session/series (of the whole
    session) and the result of /api/session/diff; moments: (time since begin [s], snapshot).
    """
    begin = datetime.fromtimestamp(session["begin"]).astimezone()
    found = incursions(series["time"], series["clearance"], config.limits.slow_below)
    parts = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        f"<title>{escape(session['title'])}</title><style>{STYLE}</style></head><body>",
        f"<h1>{escape(session['title'])}</h1>",
        f'<p class="dim">{begin:%Y-%m-%d %H:%M:%S %Z}, {session["duration"]:.1f} s, machines '
        f"{escape(', '.join(session['machines']))}; recorded from: "
        f"{escape(str(session['origin']) or 'unknown')}.</p>",
    ]
    if session["note"]:
        parts.append(f'<p class="note">{escape(session["note"])}</p>')
    if session["problems"]:
        rows = "".join(f"<li>{escape(text)}</li>" for text in session["problems"])
        parts.append(f"<h2>What could not be read</h2><ul>{rows}</ul>")
    parts += [*_happened(session, series, found), *_plots(session, series, config)]
    parts += _figures(found, moments, config)
    if difference is not None:
        parts += _difference(difference)
    parts += _replay(found, moments, scene)
    parts.append(
        '<p class="dim">Made by the excavator cockpit, an operator aid, not a certified safety '
        "function. Distances are between oriented boxes that contain the machines.</p>"
        "</body></html>"
    )
    return "\n".join(parts)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    top = "".join(f"<th>{escape(text)}</th>" for text in head)
    body = "".join(
        "<tr>"
        + "".join(
            f'<td class="n">{escape(c)}</td>' if c[:1].isdigit() else f"<td>{escape(c)}</td>"
            for c in row
        )
        + "</tr>"
        for row in rows
    )
    return f"<table><tr>{top}</tr>{body}</table>"


def _happened(
    session: Mapping[str, Any], series: Mapping[str, Any], found: Sequence[Incursion]
) -> list[str]:
    known = [v for values in series["clearance"].values() for v in values if v is not None]
    least = f"{min(known):.2f} m" if known else "unknown all the time"
    touched = sum(one.least <= 0.0 for one in found)
    words = (
        f"<p>Least distance between machines: <b>{least}</b>. Incursions below the slow distance: "
        f"<b>{len(found)}</b>, contacts among them: <b>{touched}</b>.</p>"
    )
    rows = []
    for event in session["events"]:
        length = "" if event["end"] is None else f"{event['end'] - event['start']:.1f} s"
        kind = event["level"] or event["kind"]
        rows.append(
            [f"{event['start']:.1f} s", length, kind, event["machine"] or "", event["text"]]
        )
    table = _table(("at", "for", "what", "machine", "in words"), rows) if rows else ""
    return ["<h2>What happened</h2>", words, table or "<p>No alarm, no marker.</p>"]


def _bands(session: Mapping[str, Any]) -> tuple[Band, ...]:
    return tuple(
        Band(
            event["start"],
            session["duration"] if event["end"] is None else event["end"],
            LEVEL_COLOURS[event["level"]],
            event["level"],
        )
        for event in session["events"]
        if event["kind"] == "alarm" and event["level"] in LEVEL_COLOURS
    )


def _plots(session: Mapping[str, Any], series: Mapping[str, Any], config: Config) -> list[str]:
    time, limits = series["time"], config.limits
    clearance = Plot(
        "Clearance",
        "m",
        time,
        {pair.replace("|", " – "): values for pair, values in series["clearance"].items()},
        {"slow": limits.slow_below, "stop": limits.stop_below},
        _bands(session),
        bottom=0.0,
        top=5.0,
    )
    plots = [draw(clearance)]
    for name, joints in series["joints"].items():
        degrees = {
            role: [None if v is None else float(np.rad2deg(v)) for v in values]
            for role, values in joints.items()
        }
        plots.append(draw(Plot(f"{config.labels.get(name, name)} joints", "°", time, degrees)))
    for name, ages in series["ages"].items():
        title = f"{config.labels.get(name, name)} data age"
        plots.append(draw(Plot(title, "s", time, dict(ages), bottom=0.0, top=0.5), 150))
    return ["<h2>Over time</h2>", *plots]


def _figures(found: Sequence[Incursion], moments: Moments, config: Config) -> list[str]:
    if not found or not moments:
        return []
    parts = ["<h2>Incursions</h2>"]
    times = np.array([t for t, _ in moments])
    worst = sorted(found, key=lambda one: one.least)[:MOST_FIGURES]
    for one in sorted(worst, key=lambda one: one.start):
        snapshot = moments[int(np.abs(times - one.at).argmin())][1]
        document = snapshot_document(snapshot, config)
        pair = next((p for p in document["pairs"] if f"{p['a']}|{p['b']}" == one.pair), None)
        outlines = {
            m["label"]: m["outlines"] for m in document["machines"].values() if "outlines" in m
        }
        words = [f"<b>{one.least:.2f} m at {one.at:.1f} s</b>, from {one.start:.1f} s"]
        words.append(f"to {one.end:.1f} s{' (cut off, or unknown after it)' if one.open else ''}.")
        if pair is not None and pair["body_a"]:
            words.append(f"{pair['a']}: {pair['body_a']} and {pair['b']}: {pair['body_b']}.")
        for machine in document["machines"].values():
            joints = ", ".join(f"{r} {np.rad2deg(q):.1f}°" for r, q in machine["joints"].items())
            words.append(f"<br>{escape(machine['label'])}: {escape(joints)}.")
        figure = plan(outlines, None if pair is None else pair["points"])
        parts.append(f"<figure>{figure}<figcaption>{' '.join(words)}</figcaption></figure>")
    if len(found) > len(worst):
        parts.append(f"<p>{len(found) - len(worst)} less close ones are not drawn.</p>")
    return parts


def _difference(difference: Mapping[str, Any]) -> list[str]:
    rows = [
        [pair.replace("|", " – "), f"{one['max_abs']:.3f} m", f"{one['at']:.1f} s"]
        for pair, one in difference["distance"]["pairs"].items()
        if one["max_abs"] is not None
    ]
    warnings = [
        [w["machine"], w["name"], w["level"], _moment(w["recorded"]), _moment(w["evaluated"])]
        for w in difference["first_warnings"]
    ]
    agree = difference["levels"]["agree"]
    return [
        "<h2>As it was, and as it would be judged now</h2>",
        _table(("pair", "largest difference of distance", "at"), rows),
        f"<p>Levels agree for {100.0 * agree:.1f} % of the time.</p>",
        _table(("machine", "concern", "level", "first recorded", "first judged now"), warnings),
    ]


def _moment(time: float | None) -> str:
    return "never" if time is None else f"{time:.2f} s"


def _replay(found: Sequence[Incursion], moments: Moments, scene: SceneSite) -> list[str]:
    placed = [m for m in moments if all(s.body is not None for s in m[1].machines.values())]
    if not placed:
        return ["<h2>3D replay</h2><p>No machine's pose was ever complete.</p>"]
    long = placed[-1][0] - placed[0][0] > REPLAY_SECONDS
    shown: list[tuple[float, Snapshot]] = []
    for t, snapshot in placed:
        near = any(one.start - AROUND <= t <= one.end + AROUND for one in found)
        if (long and found and not near) or (shown and t - shown[-1][0] < REPLAY_PERIOD * 0.99):
            continue
        shown.append((t, snapshot))
        if len(shown) * REPLAY_PERIOD > REPLAY_SECONDS:
            break
    what = "Around the incursions." if long and found else ""
    document = escape(replay_html(scene, shown), quote=True)
    return [
        f"<h2>3D replay</h2><p>{shown[0][0]:.1f} s to {shown[-1][0]:.1f} s. {what} "
        "Drag to turn.</p>",
        f'<iframe srcdoc="{document}" title="3D replay"></iframe>',
    ]

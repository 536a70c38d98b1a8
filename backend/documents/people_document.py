"""People and objects around the machines as JSON, part of a snapshot's document."""

from __future__ import annotations

from typing import Any

from backend.documents.people import index_number, ttc_number
from backend.pipeline.people_records import Judged, PartnerRisk, People, Tracked
from backend.safety.swing_risk import Risk
from backend.tracking.records import Status


def people_document(people: People, now: float) -> dict[str, Any]:
    """Site frame, metres, radians and seconds; NaN and infinity where a value does not exist."""
    tracked = people.tracked
    return {
        "reason": people.reason,
        "age": people.age,
        "sensors": [
            {
                "machine": sensor.machine,
                "name": sensor.name,
                "age": now - sensor.time,
                "position": list(sensor.position),
                "points": sensor.points,
            }
            for sensor in people.sensors
        ],
        "tracks": [_track(tracked, k) for k in range(len(tracked))],
        "lost": [
            {
                "id": one.id,
                "position": list(one.position),
                "seen": now - one.seen,
                "lost": now - one.lost,
            }
            for one in people.lost
        ],
        "risks": [
            _risk(machine, judged, tracked, k)
            for machine, judged in people.judged.items()
            for k in range(len(judged.distance))
        ],
        "machines": [
            _partner(risk) for judged in people.judged.values() for risk in judged.partners
        ],
        "boundaries": {
            "ttc": list(people.boundaries.ttc),
            "index": list(people.boundaries.index),
        },
        "inside": [
            {
                "id": one.id,
                "machine": one.machine,
                "area": one.now.name.lower(),
                "area_ahead": one.ahead.name.lower(),
            }
            for one in people.inside
        ],
    }


def _track(tracked: Tracked, k: int) -> dict[str, Any]:
    return {
        "id": int(tracked.id[k]),
        "kind": tracked.kind[k],
        "status": Status(int(tracked.status[k])).name.lower(),
        "position": tracked.position[k].tolist(),
        "velocity": tracked.velocity[k].tolist(),
        "yaw": float(tracked.yaw[k]),
        "size": tracked.size[k].tolist(),
        "sigma": float(tracked.sigma[k]),
        "unseen": float(tracked.unseen[k]),
        "ahead": {"position": tracked.ahead[k].tolist(), "cov": tracked.ahead_cov[k].tolist()},
    }


def _partner(risk: PartnerRisk) -> dict[str, Any]:
    return {
        "machine": risk.machine,
        "other": risk.other,
        "body": risk.body,
        "other_body": risk.other_body,
        "ttc": ttc_number(risk.ttc),
        "index": index_number(risk.index),
        "ttc_ahead": ttc_number(risk.ttc_ahead),
        "index_ahead": index_number(risk.index_ahead),
        "level": Risk(risk.level).name,
    }


def _risk(machine: str, judged: Judged, tracked: Tracked, k: int) -> dict[str, Any]:
    risks = judged.risks
    return {
        "id": int(tracked.id[k]),
        "machine": machine,
        "body": judged.nearest[k],
        "distance": float(judged.distance[k]),
        "ttc": ttc_number(float(risks.ttc[k])),
        "index": index_number(float(risks.index[k])),
        "ttc_ahead": ttc_number(float(risks.ttc_ahead[k])),
        "index_ahead": index_number(float(risks.index_ahead[k])),
        "level": Risk(int(risks.level[k])).name,
    }

"""`cockpit schema NAME`: the JSON Schema of every document the program reads or prints."""

from __future__ import annotations

import json

from pydantic import BaseModel

from backend.documents.access import (
    AuditEntry,
    EntranceDocument,
    MeDocument,
    UsersDocument,
    UsersFileDocument,
)
from backend.documents.alarms import AlarmsDocument
from backend.documents.along import AlongDocument
from backend.documents.assessment import AssessmentDocument
from backend.documents.bench import BenchDocument
from backend.documents.conversion import ConversionDocument, ExportDocument
from backend.documents.cspace import CspaceDocument
from backend.documents.detection import DetectionDocument
from backend.documents.gauge import GaugeDocument
from backend.documents.gauge_choice import GaugeChoiceFile, GaugeStateDocument
from backend.documents.people import PeopleModel
from backend.documents.plan_document import PlanDocument, PlanTaskDocument
from backend.documents.plan_series import FollowedSeries
from backend.documents.plan_state import PlanRequest, PlanStateDocument
from backend.documents.recordings import RecordingsDocument, RecoverDocument
from backend.documents.session import DiffDocument, SeriesDocument, SessionDocument
from backend.documents.stability import StabilityModel
from backend.documents.stages import StagesDocument
from backend.documents.state import StateDocument
from backend.documents.surmount_document import SurmountDocument
from backend.documents.surmount_state import (
    FollowedSurmount,
    SideView,
    SurmountRequest,
    SurmountStateDocument,
)
from backend.documents.surmount_task import SurmountTaskDocument
from backend.documents.use_case import UseCaseDocument
from backend.documents.use_case_state import UseCaseStateDocument
from backend.documents.zone import ZoneFrameHeader
from backend.errors import InputError
from backend.shell.app.models import HealthModel, SiteModel, SnapshotModel
from backend.shell.app.recording import RecordingModel
from backend.site.tables import SiteTable

SCHEMAS: dict[str, tuple[type[BaseModel], str]] = {
    "state": (StateDocument, "machine states, read by assess"),
    "assess": (AssessmentDocument, "what assess prints"),
    "cspace": (CspaceDocument, "what cspace --json prints"),
    "gauge": (GaugeDocument, "what gauge --json prints"),
    "detection": (DetectionDocument, "what detect --json prints"),
    "stages": (StagesDocument, "/api/stages: what detection makes of the newest scan"),
    "plan-task": (PlanTaskDocument, "the task that plan reads"),
    "plan": (PlanDocument, "what plan --json prints"),
    "plan-followed": (FollowedSeries, "/api/plan/MACHINE/PLAN/followed"),
    "plan-request": (PlanRequest, "what is posted to /api/plan"),
    "plan-state": (PlanStateDocument, "/api/plan, and the key plans of a snapshot"),
    "surmount-task": (SurmountTaskDocument, "the task that surmount reads"),
    "surmount": (SurmountDocument, "what surmount --json prints"),
    "surmount-request": (SurmountRequest, "what is posted to /api/surmount"),
    "surmount-state": (SurmountStateDocument, "/api/surmount, and the key surmounts of a snapshot"),
    "surmount-side": (SideView, "/api/surmount/MACHINE/PLAN/side"),
    "surmount-followed": (FollowedSurmount, "/api/surmount/MACHINE/PLAN/followed"),
    "along": (AlongDocument, "what along --json prints"),
    "use-case": (UseCaseDocument, "what use-case --json prints"),
    "use-case-state": (UseCaseStateDocument, "/api/use-case"),
    "gauge-choice": (GaugeChoiceFile, "what operators draw and switch, as it is kept"),
    "gauge-state": (GaugeStateDocument, "/api/gauge"),
    "convert": (ConversionDocument, "what convert --json prints"),
    "export": (ExportDocument, "what export --json prints"),
    "bench": (BenchDocument, "what bench --json prints"),
    "recordings": (RecordingsDocument, "what recordings --json prints"),
    "recover": (RecoverDocument, "what recover --json prints"),
    "recording": (RecordingModel, "/api/recording"),
    "snapshot": (SnapshotModel, "/api/snapshot and the Zenoh key cockpit/snapshot"),
    "people": (PeopleModel, "the key people of a snapshot"),
    "stability": (StabilityModel, "each machine under the key stability of a snapshot"),
    "zone": (ZoneFrameHeader, "the header of a driving zone's frame on the websocket"),
    "site": (SiteModel, "/api/site"),
    "health": (HealthModel, "/api/health"),
    "session": (SessionDocument, "/api/session"),
    "series": (SeriesDocument, "/api/session/series"),
    "diff": (DiffDocument, "what diff --json prints, and /api/session/diff"),
    "alarms": (AlarmsDocument, "/api/alarms; its entries are the lines of alarms.jsonl"),
    "users": (UsersDocument, "what users list --json prints"),
    "users-file": (UsersFileDocument, "the users file"),
    "me": (MeDocument, "/api/me"),
    "entrance": (EntranceDocument, "GET /api/login"),
    "audit": (AuditEntry, "one line of the audit log"),
    "site-file": (SiteTable, "a site file, as TOML"),
}


def print_schema(name: str) -> None:
    """Prints one schema, or the names when `name` is empty."""
    if not name:
        for known, (_, what) in SCHEMAS.items():
            print(f"{known:13} {what}")
        return
    if name not in SCHEMAS:
        raise InputError(f'schema: there is no "{name}"; allowed are {", ".join(SCHEMAS)}.')
    model, what = SCHEMAS[name]
    schema = model.model_json_schema()
    document = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": name,
        **schema,
        "description": schema.get("description", what),
    }
    print(json.dumps(document, indent=2))

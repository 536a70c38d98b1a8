"""`cockpit use-case`: a use case of the working gauge by one method, or all beside each other."""

from __future__ import annotations

from backend.documents.use_case import RunModel, UseCaseDocument, use_case_document
from backend.machine.load import load_machine
from backend.planning.use_cases import METHODS, MODEL, run_use_case, settings_of, use_case
from backend.shell.app.wire import dumps


def run_use_case_command(name: str, method: str, as_json: bool) -> None:
    """Prints the numbers of the runs, or all of their series. method: empty for all methods."""
    use_case(name)
    chosen = (method,) if method else METHODS
    for one in chosen:
        settings_of(one)
    machine = load_machine(MODEL)
    runs = [run_use_case(name, one, machine) for one in chosen]
    document = use_case_document(machine, MODEL, runs)
    print(dumps(document.model_dump()) if as_json else _words(document))


def _words(document: UseCaseDocument) -> str:
    lines = [
        f"{document.title} (Mäkinen 2021, {document.figures}): {document.model}, "
        f"{document.seconds:g} s, p_u = {document.upper:g} m, p_l = {document.lower:g} m",
        f"  {'method':17} {'arrives':>8}  {'nearest':32} {'path error':>15}  vibration",
    ]
    return "\n".join(lines + [_row(run) for run in document.runs])


def _row(run: RunModel) -> str:
    arrives = "never" if run.arrived is None else f"{run.arrived:.1f} s"
    nearest = f"{run.nearest.distance:.2f} m {run.nearest.pair}"
    error = f"{run.mean_error:.2f} / {run.max_error:.2f} m"
    shaking = run.vibration
    return (
        f"  {run.words:17} {arrives:>8}  {nearest:32} {error:>15}  {shaking.sign_changes} sign "
        f"changes, {shaking.energy:.1e} rad^2/s above 2 Hz"
    )

"""descry: plan, validate, recognise, read records, and run the agent.

The engine for unified-planning is in :mod:`descry.unified_planning`, what a body is in :mod:`descry.robot`.
"""

from ._descry import (
    Attachment,
    Call,
    Document,
    Finding,
    Outcome,
    Percept,
    Plan,
    Recognition,
    Record,
    Report,
    Step,
    Surface,
    Task,
    Verdict,
    check,
    goals,
    new_domain,
    plan,
    read_cloud,
    recognise,
    validate,
)
from .errors import BrokenError, Error, InputError, InternalError
from .running import check_robot, pursue

__all__ = [
    "Attachment",
    "BrokenError",
    "Call",
    "Document",
    "Error",
    "Finding",
    "InputError",
    "InternalError",
    "Outcome",
    "Percept",
    "Plan",
    "Recognition",
    "Record",
    "Report",
    "Step",
    "Surface",
    "Task",
    "Verdict",
    "check",
    "check_robot",
    "goals",
    "new_domain",
    "plan",
    "pursue",
    "read_cloud",
    "recognise",
    "validate",
]

"""descry: plan, validate, recognise, read records, and run the agent.

The engine for unified-planning is in :mod:`descry.unified_planning`.
"""

from ._descry import (
    Attachment,
    Call,
    Finding,
    Outcome,
    Plan,
    Step,
    Task,
    Verdict,
    check,
    plan,
    validate,
)
from .errors import BrokenError, Error, InputError, InternalError

__all__ = [
    "Attachment",
    "BrokenError",
    "Call",
    "Error",
    "Finding",
    "InputError",
    "InternalError",
    "Outcome",
    "Plan",
    "Step",
    "Task",
    "Verdict",
    "check",
    "plan",
    "validate",
]

"""What can go wrong. Every exception of this package is an :class:`Error`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional, Sequence

if TYPE_CHECKING:
    from ._descry import Finding


class Error(Exception):
    """Something could not be done.

    ``file``, ``line`` and ``column`` (both from 1) say where, ``expected`` what should be there, ``mend`` what to do;
    each is ``None`` where it is not known. ``findings`` has every fault of a text, not only the first.
    """

    def __init__(
        self,
        message: str,
        *,
        file: Optional[str] = None,
        line: Optional[int] = None,
        column: Optional[int] = None,
        expected: Optional[str] = None,
        mend: Optional[str] = None,
        findings: "Sequence[Finding]" = (),
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        self.column = column
        self.expected = expected
        self.mend = mend
        self.findings = list(findings)


class InputError(Error, ValueError):
    """What was given cannot be used."""


class BrokenError(Error, RuntimeError):
    """The body or a store failed for good."""


class InternalError(Error, RuntimeError):
    """A fault of descry itself: please report it with its input."""

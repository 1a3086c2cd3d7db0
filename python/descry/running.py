"""Running the agent."""

from __future__ import annotations

import os
import socket
import tempfile
import threading
from contextlib import contextmanager
from typing import Any, Callable, Dict, Iterator, Mapping, Optional, Sequence, Union

from . import _descry
from . import robot as bodies
from .errors import Error

Body = Union[str, bodies.Robot]
"""``"sim"``, ``"recorded:DIR"``, ``"program:COMMAND"``, ``"socket:PLACE"``, or an object of a class of one's own."""


def pursue(
    goal: str,
    *,
    domain: Union[str, "os.PathLike[str]"] = "tabletop",
    robot: Body = "sim",
    scene: Optional[str] = None,
    seed: int = 1,
    policy: str = "plan",
    run: Optional[Union[str, "os.PathLike[str]"]] = None,
    remember: Optional[str] = None,
    attachments: Optional[Mapping[str, Callable[..., Any]]] = None,
    facts: Optional[Mapping[str, Callable[[Sequence[str]], Sequence[str]]]] = None,
    actions: Optional[Mapping[str, Callable[..., Optional[str]]]] = None,
    on_event: Optional[Callable[[Dict[str, Any]], object]] = None,
) -> "_descry.Report":
    """Pursues a goal in the words of a domain, as ``descry do`` does; Ctrl-C stops the body first.

    ``attachments``, ``facts`` and ``actions`` are functions in the places of the programs that ``domain.toml`` names:
    a call's function gets its arguments and returns its value; a fact's function gets the names of all objects and
    returns what holds, a line of PDDL each; an action's function gets its arguments, returns what it has done in
    words (or ``None``), and raises if it could not.
    """
    with _served(robot) as place:
        return _descry.pursue(
            goal,
            domain=os.fspath(domain),
            robot=place,
            scene=scene,
            seed=seed,
            policy=policy,
            run=None if run is None else os.fspath(run),
            remember=remember,
            attachments=None if attachments is None else dict(attachments),
            facts=None if facts is None else dict(facts),
            actions=None if actions is None else dict(actions),
            on_event=on_event,
        )


def resume(
    run: Union[str, "os.PathLike[str]"],
    *,
    robot: Optional[Body] = None,
    allow_programs: bool = False,
    attachments: Optional[Mapping[str, Callable[..., Any]]] = None,
    facts: Optional[Mapping[str, Callable[[Sequence[str]], Sequence[str]]]] = None,
    actions: Optional[Mapping[str, Callable[..., Optional[str]]]] = None,
    on_event: Optional[Callable[[Dict[str, Any]], object]] = None,
) -> "_descry.Report":
    """Goes on with a run that was killed or stopped, as ``descry do --resume`` does: what its record holds is lived
    through once more without asking body or functions, and then the run goes on. Goal and settings are those of the run.

    ``robot`` is its body where that is an object of Python, or has moved to another place. ``allow_programs`` lets the
    programs run that the record names; the functions are those of :func:`pursue`, and need no such leave.
    """
    given = {
        "allow_programs": allow_programs,
        "attachments": None if attachments is None else dict(attachments),
        "facts": None if facts is None else dict(facts),
        "actions": None if actions is None else dict(actions),
        "on_event": on_event,
    }
    if robot is None:
        return _descry.resume(os.fspath(run), robot=None, **given)  # type: ignore[arg-type]
    with _served(robot) as place:
        return _descry.resume(os.fspath(run), robot=place, **given)  # type: ignore[arg-type]


def replay(
    run: Union[str, "os.PathLike[str]"],
    *,
    speed: Optional[float] = None,
    out: Optional[Union[str, "os.PathLike[str]"]] = None,
    on_event: Optional[Callable[[Dict[str, Any]], object]] = None,
) -> "_descry.Replay":
    """Lives through a run again from its record, as ``descry replay`` does: no body, function or program is asked.

    ``speed``: seconds of the body's clock that pass in one second (default: as fast as it goes). ``out``: a folder that
    keeps what comes about as a run.
    """
    kept = None if out is None else os.fspath(out)
    return _descry.replay(os.fspath(run), speed=speed, out=kept, on_event=on_event)


def check_robot(robot: Body) -> None:
    """Holds a body to the promises of every body.

    Raises :class:`~descry.BrokenError` at the first that it does not keep.
    """
    with _served(robot) as place:
        _descry.check_robot(place)


@contextmanager
def _served(robot: Body) -> Iterator[str]:
    """Where a body can be spoken with: an object of Python answers over a socket that only this user can reach."""
    if isinstance(robot, str):
        yield robot
        return
    with tempfile.TemporaryDirectory(prefix="descry-") as folder:
        place = os.path.join(folder, "body")
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(place)
            server.listen()
            serving = _Serving(robot, server)
            serving.start()
            try:
                yield f"socket:{place}"
            except Error as error:
                raise error from serving.raised
            finally:
                serving.end(place)


class _Serving(threading.Thread):
    """Answers for a body to the one that connects."""

    def __init__(self, robot: bodies.Robot, server: socket.socket) -> None:
        super().__init__(name="descry-body", daemon=True)
        self._robot, self._server = robot, server
        self.raised: Optional[BaseException] = None

    def run(self) -> None:
        connection, _ = self._server.accept()
        try:
            bodies.answer(self._robot, connection)
        except BaseException as error:  # handed on as the cause of what the run says
            self.raised = error
        finally:
            connection.close()

    def end(self, place: str) -> None:
        """Ends it, whether or not anybody has connected."""
        with socket.socket(socket.AF_UNIX) as last:
            last.connect(place)
        self.join()

import os
from typing import Any, Callable, Dict, List, Literal, Mapping, Optional, Sequence, Tuple, Union, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Attachment",
    "Call",
    "Document",
    "Finding",
    "Outcome",
    "Percept",
    "Plan",
    "Recognition",
    "Record",
    "Replay",
    "Report",
    "Step",
    "Surface",
    "Task",
    "Verdict",
    "WhyNot",
    "check",
    "check_robot",
    "goals",
    "new_domain",
    "plan",
    "pursue",
    "read_cloud",
    "recognise",
    "replay",
    "resume",
    "validate",
    "why_not",
]

_Path = Union[str, "os.PathLike[str]"]
_Point = Sequence[float]
_Attachment = Union["Attachment", Callable[["Call"], Any]]

@final
class Finding:
    """One thing that is wrong with a text, where (line and column from 1), and how to mend it."""

    @property
    def severity(self) -> Literal["error", "warning"]: ...
    @property
    def code(self) -> str: ...
    @property
    def message(self) -> str: ...
    @property
    def file(self) -> str: ...
    @property
    def line(self) -> int: ...
    @property
    def column(self) -> int: ...
    @property
    def expected(self) -> Optional[str]: ...
    @property
    def mend(self) -> Optional[str]: ...

@final
class Task:
    """A PDDL domain and problem, read and checked; semantic attachments, times, numbers, preferences and all.

    Raises :class:`~descry.InputError` with every fault that was found.
    """

    def __new__(cls, domain: str, problem: str) -> "Task": ...
    @staticmethod
    def read(domain: _Path, problem: _Path) -> "Task":
        """The same from files."""

    @property
    def domain(self) -> str: ...
    @property
    def problem(self) -> str: ...
    @property
    def is_temporal(self) -> bool: ...
    @property
    def actions(self) -> List[str]: ...
    @property
    def objects(self) -> List[str]: ...
    @property
    def modules(self) -> List[str]:
        """The modules that need an attachment each."""

@final
class Step:
    """One step of a plan: seconds; ``start_s`` is ``None`` in a plan without times."""

    def __new__(
        cls,
        action: str,
        arguments: Sequence[str] = ...,
        start_s: Optional[float] = None,
        duration_s: float = 0.0,
    ) -> "Step": ...
    @property
    def action(self) -> str: ...
    @property
    def arguments(self) -> List[str]: ...
    @property
    def start_s(self) -> Optional[float]: ...
    @property
    def duration_s(self) -> float: ...

@final
class Plan:
    """What to do, and when. ``str(plan)`` is its text in the form of the planning competitions."""

    def __new__(cls, steps: Sequence[Step], cost: Optional[float] = None) -> "Plan": ...
    @staticmethod
    def parse(text: str) -> "Plan":
        """``0.000: (move a b) [3.200]`` or ``(move a b)``, one or more to a line."""

    @staticmethod
    def read(path: _Path) -> "Plan":
        """The same from a file."""

    @property
    def steps(self) -> List[Step]: ...
    @property
    def cost(self) -> Optional[float]: ...
    @property
    def makespan_s(self) -> Optional[float]: ...
    def gantt(self) -> str:
        """The plan as a Gantt chart, SVG."""

    def __len__(self) -> int: ...

@final
class Call:
    """A question to an attachment: plain data, the same question has the same answer."""

    @property
    def module(self) -> str: ...
    @property
    def kind(self) -> Literal["cost", "conditionchecker", "effect", "grounding"]: ...
    @property
    def arguments(self) -> List[str]: ...
    @property
    def readings(self) -> Dict[Tuple[str, ...], Union[bool, float, str, None]]:
        """The values of the facts that the attachment reads, by symbol and arguments."""

    def value(self, symbol: str, *arguments: str) -> Union[bool, float, str, None]:
        """One of them. Raises ``KeyError`` for a fact that the attachment does not read."""

@final
class Attachment:
    """A function that answers the calls of a module.

    It gets a :class:`Call` and returns a number (cost; ``math.inf``: not applicable), a truth value (condition), a list
    of values (effect) or a list of names (grounding). ``reads`` names the predicates and functions on which the answer
    depends besides the arguments: answers are kept by them. ``relaxed`` is a cheap, optimistic answer for heuristics.
    """

    def __new__(
        cls,
        function: Callable[[Call], Any],
        *,
        reads: Sequence[str] = ...,
        relaxed: Optional[Callable[[Call], Any]] = None,
    ) -> "Attachment": ...
    def __call__(self, *arguments: Any, **named: Any) -> Any: ...

@final
class Outcome:
    """How planning ended.

    ``status``: ``solved`` (there is a plan), ``unsolvable`` (proven; ``why`` and ``findings`` say why),
    ``out_of_time``, ``out_of_memory``, or ``undecided`` (no plan was found, and none is ruled out).
    """

    @property
    def status(self) -> Literal["solved", "unsolvable", "out_of_time", "out_of_memory", "undecided"]: ...
    @property
    def plan(self) -> Optional[Plan]: ...
    @property
    def is_optimal(self) -> bool:
        """Whether the plan is proven to be best."""

    why: Optional[str]
    findings: List[Finding]
    time_s: float
    statistics: Dict[str, Any]

@final
class Verdict:
    """What the validator says of a plan; true if it is valid. ``step`` is the one at fault, from 0."""

    valid: bool
    reason: Optional[str]
    step: Optional[int]
    cost: Optional[float]
    makespan_s: Optional[float]
    metric: Optional[float]
    findings: List[Finding]
    def __bool__(self) -> bool: ...

def plan(
    task: Task,
    *,
    time_limit_s: Optional[float] = None,
    memory_limit_mb: Optional[int] = None,
    anytime: bool = False,
    seed: int = 0,
    bound: Optional[float] = None,
    threads: Optional[int] = None,
    attachments: Optional[Mapping[str, _Attachment]] = None,
    on_plan: Optional[Callable[[Plan], object]] = None,
    stop: Optional[Callable[[], bool]] = None,
) -> Outcome:
    """Plans. Every plan has been validated; the same task and seed give the same plan.

    With ``anytime`` it goes on improving until the time limit, until ``stop()`` is true, or until the best plan is
    proven best; ``on_plan`` hears of each better one. Without, it ends after a short improvement. ``bound``: accept
    only plans whose metric is below. ``threads``: how many searches may go on side by side, where actions take no time;
    the plan is the same. Ctrl-C ends it with ``KeyboardInterrupt``; an exception that an attachment raises
    comes out as it is.
    """

@final
class WhyNot:
    """What is said of an action that is asked about. ``str(answer)`` says it in sentences."""

    @property
    def action(self) -> str:
        """The action, as it is written in plans."""

    @property
    def in_plan(self) -> bool:
        """Whether the plan has it."""

    @property
    def unmet(self) -> List[str]:
        """What of its condition does not hold at first."""

    @property
    def data(self) -> Dict[str, Any]:
        """All of it, as ``descry plan --why-not --json`` prints it: plans that lead to it and that have it, too."""

def why_not(
    task: Task,
    action: str,
    *,
    plan: Optional[Plan] = None,
    time_limit_s: Optional[float] = None,
    memory_limit_mb: Optional[int] = None,
    seed: int = 0,
    attachments: Optional[Mapping[str, _Attachment]] = None,
) -> WhyNot:
    """Says why an action, ``"(move a b)"``, is not in a plan: what it lacks at first, whether anything leads to it, and
    what a plan with it takes beside ``plan`` (default: the one that is found).

    Raises :class:`~descry.InputError` if the task has no such action.
    """

def validate(task: Task, plan: Plan, *, attachments: Optional[Mapping[str, _Attachment]] = None) -> Verdict:
    """Says whether a plan reaches the goal of its task, and if not, which step fails and why."""

def check(domain: str, problem: Optional[str] = None) -> List[Finding]:
    """Every finding in the text of a domain, and of a problem: faults and warnings."""

@final
class Surface:
    """The surface that things stand on; metres, in the frame of the cloud."""

    @property
    def up(self) -> NDArray[np.float64]: ...
    @property
    def offset_m(self) -> float:
        """``up · p`` of its points."""

    @property
    def hull_m(self) -> NDArray[np.float64]:
        """Its outline, N x 3, anticlockwise seen from above."""

    @property
    def area_m2(self) -> float: ...
    @property
    def residual_m(self) -> float: ...
    @property
    def surface_from_world(self) -> NDArray[np.float64]:
        """4 x 4: z up with 0 on the surface, origin at the middle of its outline."""

@final
class Percept:
    """An object on a surface; ``label`` is ``None`` where it is unknown."""

    @property
    def label(self) -> Optional[str]: ...
    @property
    def kind(self) -> Optional[str]: ...
    def probability_of(self, name: str) -> float:
        """Probability that it is the object or kind of that name."""

    @property
    def unknown(self) -> float:
        """Probability that it is none of the known objects."""

    @property
    def position_m(self) -> NDArray[np.float64]:
        """Centre of its footprint."""

    @property
    def position_sigma_m(self) -> float: ...
    @property
    def size_m(self) -> NDArray[np.float64]:
        """Longer and shorter side of its footprint, height."""

    @property
    def seen_fraction(self) -> float: ...
    @property
    def indices(self) -> NDArray[np.uint32]:
        """Its points: indices into the cloud, row by row where that is an image."""

    @property
    def data(self) -> Dict[str, Any]:
        """All of it, as ``descry recognise --json`` prints it."""

@final
class Recognition:
    """What stands in a cloud; without a surface ``why`` says why there is none."""

    @property
    def surface(self) -> Optional[Surface]: ...
    @property
    def objects(self) -> List[Percept]: ...
    @property
    def why(self) -> Optional[str]: ...

def recognise(
    points: ArrayLike,
    *,
    viewpoint_m: _Point = ...,
    up: Optional[_Point] = None,
    objects: Optional[_Path] = None,
    recogniser: Literal["descry", "published"] = "descry",
    seed: int = 1,
) -> Recognition:
    """Finds the surface in a cloud and recognises what stands on it.

    ``points``: metres, N x 3, or height x width x 3 for the pixels of a depth camera at the origin (x right, y down,
    z forward; NaN where nothing returned), which tell by themselves what was looked through. ``viewpoint_m``: where the
    sensor of a cloud of N x 3 stood. ``up``: up in the frame of the cloud, if known. ``objects``: a folder of object
    files (default: those of the domain tabletop).
    """

def read_cloud(path: _Path) -> Tuple[NDArray[np.float32], NDArray[np.float64]]:
    """The points of a PCD, PLY, NPY, LAS, XYZ, CSV or PTS file, N x 3 or height x width x 3, and where its sensor stood, metres."""

@final
class Document:
    """One entry of a record. ``stamp_ns`` is in the clock of the recording."""

    @property
    def id(self) -> int: ...
    @property
    def kind(self) -> str: ...
    @property
    def stamp_ns(self) -> int: ...
    @property
    def frame(self) -> str: ...
    @property
    def body(self) -> Any: ...
    @property
    def data(self) -> Dict[str, Any]:
        """All of it, as ``descry memory query --json`` prints it."""

@final
class Record:
    """A record: what was sensed, done and believed in a run. Reading locks nothing and changes nothing.

    ``place`` is a run's folder. What of it is damaged stands in ``lost``; what is read is whole, or
    :class:`~descry.BrokenError` is raised.
    """

    def __new__(cls, place: _Path) -> "Record": ...
    @property
    def lost(self) -> List[str]: ...
    @property
    def stats(self) -> Dict[str, Any]: ...
    def query(
        self,
        kind: Optional[str] = None,
        *,
        frame: Optional[str] = None,
        robot: Optional[str] = None,
        from_s: Optional[float] = None,
        to_s: Optional[float] = None,
        seen_from_m: Optional[_Point] = None,
        covers_m: Optional[_Point] = None,
        radius_m: float = 0.5,
        object: Optional[str] = None,
        min_confidence: Optional[float] = None,
        newest: bool = False,
        limit: Optional[int] = None,
    ) -> List[Document]:
        """The entries for which all conditions hold that are given, oldest first."""

    def events(self) -> List[Dict[str, Any]]:
        """What happened, in its order."""

    def cloud(self, document: Document) -> NDArray[np.float32]:
        """The points of a recorded cloud in the frame of its camera, N x 3 or height x width x 3, metres."""

    def colours(self, document: Document) -> Optional[NDArray[np.uint8]]:
        """Red, green, blue of each point, N x 3."""

    def world_from_camera(self, document: Document, world: str = "map") -> NDArray[np.float64]:
        """Where the camera of a recorded cloud stood, 4 x 4."""

    def report(self) -> Optional[Dict[str, Any]]:
        """The result of the run, if it came to one."""

    def explain(self, *, figures: bool = False) -> str:
        """Why the run went as it did, as ``descry explain`` says it; with all figures if asked."""

    def verify(self) -> List[str]:
        """Reads every byte; returns what is damaged."""

@final
class Report:
    """What came of a run. ``str(report)`` is what ``descry do`` prints at its end."""

    @property
    def verdict(self) -> Literal["achieved", "not_found", "cannot_tell", "impossible", "failed"]: ...
    @property
    def goal(self) -> str: ...
    @property
    def why(self) -> str: ...
    @property
    def confidence(self) -> float: ...
    @property
    def position_m(self) -> Optional[List[float]]: ...
    @property
    def run(self) -> "os.PathLike[str]":
        """The run's folder: ``Record(report.run)``."""

    @property
    def data(self) -> Dict[str, Any]:
        """All of it, as ``descry do --json`` prints it."""

def goals(domain: str = "tabletop") -> List[str]:
    """The phrases that a domain understands."""

def new_domain(folder: _Path) -> List[str]:
    """Writes a small domain that runs into a folder, there to be changed; returns its files."""

def pursue(
    goal: str,
    *,
    domain: str,
    robot: str,
    scene: Optional[str],
    seed: int,
    policy: str,
    run: Optional[str],
    remember: Optional[str],
    attachments: Optional[Dict[str, Callable[..., Any]]],
    facts: Optional[Dict[str, Callable[..., Any]]],
    actions: Optional[Dict[str, Callable[..., Any]]],
    on_event: Optional[Callable[[Dict[str, Any]], object]],
) -> Report: ...
def resume(
    run: _Path,
    *,
    robot: Optional[str],
    allow_programs: bool,
    attachments: Optional[Dict[str, Callable[..., Any]]],
    facts: Optional[Dict[str, Callable[..., Any]]],
    actions: Optional[Dict[str, Callable[..., Any]]],
    on_event: Optional[Callable[[Dict[str, Any]], object]],
) -> Report: ...
@final
class Replay:
    """What came of living through a run again; true if all that was recorded came about again."""

    @property
    def same(self) -> bool: ...
    @property
    def verdict(self) -> Optional[str]:
        """The verdict that it came to; ``None`` where the run was cut off."""

    @property
    def cut_off(self) -> Optional[str]:
        """Where the run was cut off, if it was."""

    @property
    def differences(self) -> List[str]:
        """What is not the same, a line each."""

    @property
    def damage(self) -> List[str]:
        """What of the record is damaged: of such a record nothing is played."""

    @property
    def data(self) -> Dict[str, Any]:
        """All of it, as ``descry replay --json`` prints it."""

    def __bool__(self) -> bool: ...

def replay(
    run: _Path,
    *,
    speed: Optional[float],
    out: Optional[_Path],
    on_event: Optional[Callable[[Dict[str, Any]], object]],
) -> Replay: ...
def check_robot(robot: str) -> None: ...

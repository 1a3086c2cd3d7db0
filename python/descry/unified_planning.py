"""The engine ``descry`` for unified-planning: importing this module registers it.

>>> import descry.unified_planning
>>> from unified_planning.shortcuts import OneshotPlanner
>>> with OneshotPlanner(name="descry") as planner:
...     result = planner.solve(problem)

``AnytimePlanner(name="descry")`` yields ever better plans, ``PlanValidator(name="descry")`` checks them.
"""

from __future__ import annotations

import queue
import threading
from fractions import Fraction
from typing import IO, Any, Callable, Iterator, Optional, Union
from warnings import warn

import unified_planning as up
from unified_planning.engines import CompilationKind, Credits, Engine
from unified_planning.engines.compilers import BoundedTypesRemover
from unified_planning.engines.mixins import (
    AnytimePlannerMixin,
    OneshotPlannerMixin,
    PlanValidatorMixin,
)
from unified_planning.engines.mixins.anytime_planner import AnytimeGuarantee
from unified_planning.engines.mixins.oneshot_planner import OptimalityGuarantee
from unified_planning.engines.plan_validator import TimeTriggeredPlanValidator
from unified_planning.engines.results import (
    FailedValidationReason,
    LogLevel,
    LogMessage,
    PlanGenerationResult,
    PlanGenerationResultStatus as Status,
    ValidationResult,
    ValidationResultStatus,
)
from unified_planning.environment import Environment, get_environment
from unified_planning.exceptions import UPException
from unified_planning.io import PDDLWriter
from unified_planning.model import Problem, ProblemKind
from unified_planning.model.metrics import MinimizeActionCosts
from unified_planning.model.problem_kind_versioning import LATEST_PROBLEM_KIND_VERSION
from unified_planning.plans import ActionInstance, PlanKind, SequentialPlan, TimeTriggeredPlan

from . import InputError, Outcome, Plan, Step, Task
from . import plan as descry_plan
from . import validate as descry_validate

EPSILON_S = Fraction(1, 1000)
"""Happenings of which one disturbs the other are at least so far apart in plans of this engine."""

FEATURES = frozenset(
    {
        "ACTION_BASED",
        "FLAT_TYPING",
        "HIERARCHICAL_TYPING",
        "NEGATIVE_CONDITIONS",
        "DISJUNCTIVE_CONDITIONS",
        "EQUALITIES",
        "EXISTENTIAL_CONDITIONS",
        "UNIVERSAL_CONDITIONS",
        "CONDITIONAL_EFFECTS",
        "FORALL_EFFECTS",
        "INCREASE_EFFECTS",
        "DECREASE_EFFECTS",
        "STATIC_FLUENTS_IN_BOOLEAN_ASSIGNMENTS",
        "STATIC_FLUENTS_IN_NUMERIC_ASSIGNMENTS",
        "FLUENTS_IN_BOOLEAN_ASSIGNMENTS",
        "FLUENTS_IN_NUMERIC_ASSIGNMENTS",
        "SIMPLE_NUMERIC_PLANNING",
        "GENERAL_NUMERIC_PLANNING",
        "INT_FLUENTS",
        "REAL_FLUENTS",
        "BOUNDED_TYPES",
        "CONTINUOUS_TIME",
        "DURATION_INEQUALITIES",
        "STATIC_FLUENTS_IN_DURATIONS",
        "FLUENTS_IN_DURATIONS",
        "REAL_TYPE_DURATIONS",
        "INT_TYPE_DURATIONS",
        "ACTIONS_COST",
        "PLAN_LENGTH",
        "MAKESPAN",
        "FINAL_VALUE",
        "STATIC_FLUENTS_IN_ACTIONS_COST",
        "FLUENTS_IN_ACTIONS_COST",
        "INT_NUMBERS_IN_ACTIONS_COST",
        "REAL_NUMBERS_IN_ACTIONS_COST",
    }
)
"""The kinds of problems that are planned for and validated as unified-planning means them.

Timed effects are not among them: in unified-planning they go on after the last action, and the goal has to outlast them;
in PDDL a plan ends with its last action.
"""

_MOST_DENOMINATOR = 10**6
_UNWRITABLE = (InputError, UPException, NotImplementedError)
"""What a problem raises that has no PDDL which descry reads."""


class DescryEngine(Engine, OneshotPlannerMixin, AnytimePlannerMixin, PlanValidatorMixin):
    """descry's planner and validator. ``seed`` decides what is left to chance, ``memory_limit_mb`` bounds the search."""

    def __init__(self, seed: int = 0, memory_limit_mb: Optional[int] = None, **_options: Any) -> None:
        Engine.__init__(self)
        OneshotPlannerMixin.__init__(self)
        AnytimePlannerMixin.__init__(self)
        self._seed = seed
        self._memory_limit_mb = memory_limit_mb

    @property
    def name(self) -> str:
        return "descry"

    @staticmethod
    def get_credits(**_kwargs: Any) -> Optional[Credits]:
        return Credits(
            "descry",
            "the authors of descry",
            "",
            "https://github.com/descry/descry",
            "MIT or Apache-2.0",
            "Classical, numeric and temporal planning.",
            "Classical, numeric and temporal planning; every plan is validated before it is returned.",
        )

    @staticmethod
    def supported_kind() -> ProblemKind:
        return ProblemKind(FEATURES, version=LATEST_PROBLEM_KIND_VERSION)

    @staticmethod
    def supports(problem_kind: ProblemKind) -> bool:
        # Bounds are made conditions of actions, which hold at moments, not throughout.
        is_bounded_in_time = problem_kind.has_bounded_types() and problem_kind.has_continuous_time()
        return problem_kind <= DescryEngine.supported_kind() and not is_bounded_in_time

    @staticmethod
    def supports_plan(plan_kind: PlanKind) -> bool:
        return plan_kind in (PlanKind.SEQUENTIAL_PLAN, PlanKind.TIME_TRIGGERED_PLAN)

    @staticmethod
    def satisfies(optimality_guarantee: OptimalityGuarantee) -> bool:
        return optimality_guarantee == OptimalityGuarantee.SATISFICING

    @staticmethod
    def ensures(anytime_guarantee: AnytimeGuarantee) -> bool:
        return anytime_guarantee == AnytimeGuarantee.INCREASING_QUALITY

    def _solve(
        self,
        problem: "up.model.AbstractProblem",
        heuristic: Optional[Callable[["up.model.State"], Optional[float]]] = None,
        timeout: Optional[float] = None,
        output_stream: Optional[IO[str]] = None,
    ) -> PlanGenerationResult:
        if heuristic is not None:
            warn("descry has its own heuristics: the given one is not used.")
        try:
            translation = _Translation(problem)
        except _UNWRITABLE as error:
            return _unsupported(error)
        outcome = self._plan(translation, timeout)
        if output_stream is not None:
            output_stream.write(_told(outcome))
        return translation.result(outcome)

    def _plan(self, translation: "_Translation", timeout: Optional[float], **watched: Any) -> Outcome:
        return descry_plan(
            translation.task,
            time_limit_s=timeout,
            memory_limit_mb=self._memory_limit_mb,
            seed=self._seed,
            **watched,
        )

    def _get_solutions(
        self,
        problem: "up.model.AbstractProblem",
        timeout: Optional[float] = None,
        output_stream: Optional[IO[str]] = None,
    ) -> Iterator[PlanGenerationResult]:
        try:
            translation = _Translation(problem)
        except _UNWRITABLE as error:
            yield _unsupported(error)
            return
        found: "queue.Queue[Union[Plan, Outcome, BaseException]]" = queue.Queue()
        stop = threading.Event()

        def search() -> None:
            try:
                watched = {"anytime": True, "on_plan": found.put, "stop": stop.is_set}
                found.put(self._plan(translation, timeout, **watched))
            except BaseException as error:
                found.put(error)

        searching = threading.Thread(target=search, name="descry", daemon=True)
        searching.start()
        try:
            while not isinstance(item := found.get(), Outcome):
                if isinstance(item, BaseException):
                    raise item
                # A later plan is better than this one: where it is here already, this one still comes first.
                result = translation.intermediate(item)
                if result is not None:
                    yield result
            if output_stream is not None:
                output_stream.write(_told(item))
            yield translation.result(item)
        finally:
            stop.set()
            searching.join()

    def _validate(self, problem: "up.model.AbstractProblem", plan: "up.plans.Plan") -> ValidationResult:
        return _Translation(problem).validated(plan)


class _Translation:
    """A problem in PDDL, and the way back for its plans."""

    def __init__(self, problem: "up.model.AbstractProblem") -> None:
        assert isinstance(problem, Problem)
        self.problem = problem
        self.is_temporal = problem.kind.has_continuous_time()
        written = _with_all_costs(problem)
        self.compiled = None
        if problem.kind.has_bounded_types():
            self.compiled = BoundedTypesRemover().compile(written, CompilationKind.BOUNDED_TYPES_REMOVING)
            written = self.compiled.problem
        self.writer = PDDLWriter(written, rewrite_bool_assignments=True)
        self.task = Task(self.writer.get_domain(), self.writer.get_problem())

    def back(self, plan: Plan) -> "up.plans.Plan":
        """A plan of descry in the words of the problem."""
        environment = self.problem.environment
        instances = [self._instance(step) for step in plan.steps]
        if not self.is_temporal:
            return SequentialPlan(instances, environment)
        timed = [
            (_fraction(step.start_s or 0.0), instance, self._duration(step, instance))
            for step, instance in zip(plan.steps, instances)
        ]
        return TimeTriggeredPlan(timed, environment)

    def _instance(self, step: Step) -> ActionInstance:
        action = self.writer.get_item_named(step.action)
        assert isinstance(action, up.model.Action)
        objects = (self.writer.get_item_named(name) for name in step.arguments)
        expressions = self.problem.environment.expression_manager
        # What is written may be a changed copy of the problem, whose actions have the same names.
        return ActionInstance(self.problem.action(action.name), tuple(expressions.ObjectExp(o) for o in objects))

    @staticmethod
    def _duration(step: Step, instance: ActionInstance) -> Optional[Fraction]:
        is_durative = isinstance(instance.action, up.model.DurativeAction)
        return _fraction(step.duration_s) if is_durative else None

    def there(self, plan: "up.plans.Plan") -> Plan:
        """A plan of unified-planning in the words of descry."""
        name = self.writer.get_pddl_name
        actions = {} if self.compiled is None else {a.name: a for a in self.compiled.problem.actions}

        def step(instance: ActionInstance, start: Any = None, duration: Any = None) -> Step:
            arguments = [name(parameter.object()) for parameter in instance.actual_parameters]
            started = None if start is None else float(start)
            action = actions.get(instance.action.name, instance.action)
            return Step(name(action), arguments, started, float(duration or 0))

        if isinstance(plan, SequentialPlan):
            return Plan([step(instance) for instance in plan.actions])
        if isinstance(plan, TimeTriggeredPlan):
            timed = sorted(plan.timed_actions, key=lambda timed: timed[0])
            return Plan([step(instance, start, duration) for start, instance, duration in timed])
        raise UPException(f"descry cannot read a {plan.kind.name}; expected a sequential or a time-triggered plan")

    def intermediate(self, plan: Plan) -> Optional[PlanGenerationResult]:
        back = self.back(plan)
        if not self._is_apart(back):
            return None
        return PlanGenerationResult(Status.INTERMEDIATE, back, "descry")

    def result(self, outcome: Outcome) -> PlanGenerationResult:
        logs = [LogMessage(LogLevel.INFO, _told(outcome))]
        metrics = {"engine_internal_time": str(outcome.time_s)}
        status, plan = self._status(outcome)
        return PlanGenerationResult(status, plan, "descry", metrics, logs)

    def _status(self, outcome: Outcome) -> "tuple[Status, Optional[up.plans.Plan]]":
        if outcome.plan is not None:
            plan = self.back(outcome.plan)
            if not self._is_apart(plan):
                return Status.UNSOLVABLE_INCOMPLETELY, None
            proven = outcome.is_optimal and self.problem.quality_metrics and self._is_same_time()
            return (Status.SOLVED_OPTIMALLY if proven else Status.SOLVED_SATISFICING), plan
        if outcome.status == "unsolvable":
            proven = self._is_same_time()
            return (Status.UNSOLVABLE_PROVEN if proven else Status.UNSOLVABLE_INCOMPLETELY), None
        return {
            "out_of_time": Status.TIMEOUT,
            "out_of_memory": Status.MEMOUT,
            "undecided": Status.UNSOLVABLE_INCOMPLETELY,
        }[outcome.status], None

    def _is_same_time(self) -> bool:
        """Whether a proof for descry's separation of happenings is one for the problem's."""
        epsilon = self.problem.epsilon
        return not self.is_temporal or (epsilon is not None and epsilon >= EPSILON_S)

    def _is_apart(self, plan: "up.plans.Plan") -> bool:
        """Whether happenings of a plan are as far apart as the problem wants them."""
        epsilon = self.problem.epsilon
        if not isinstance(plan, TimeTriggeredPlan) or epsilon is None or epsilon <= EPSILON_S:
            return True
        least = plan.extract_epsilon(self.problem)
        return least is None or least >= epsilon

    def validated(self, plan: "up.plans.Plan") -> ValidationResult:
        if isinstance(plan, TimeTriggeredPlan) and _meets(plan):
            # PDDL forbids that happenings meet of which one disturbs the other; unified-planning has its own rules for it.
            return TimeTriggeredPlanValidator(environment=plan.environment).validate(self.problem, plan)
        there = self.there(plan)
        verdict = descry_validate(self.task, there)
        if verdict.valid:
            return ValidationResult(ValidationResultStatus.VALID, "descry", metric_evaluations=self._metrics(verdict))
        reason, at = FailedValidationReason.UNSATISFIED_GOALS, None
        if verdict.step is not None:
            reason = FailedValidationReason.INAPPLICABLE_ACTION
            at = self._instance(there.steps[verdict.step])
        logs = [LogMessage(LogLevel.INFO, verdict.reason or "not valid")]
        return ValidationResult(
            ValidationResultStatus.INVALID, "descry", logs, reason=reason, inapplicable_action=at
        )

    def _metrics(self, verdict: Any) -> "Optional[dict[Any, Any]]":
        metrics = self.problem.quality_metrics
        if len(metrics) != 1 or verdict.metric is None:
            return None
        return {metrics[0]: _fraction(verdict.metric)}


def _with_all_costs(problem: Problem) -> Problem:
    """A problem whose costs of actions are all stated, as the writer wants them: where there is none, it is 0."""
    metrics = problem.quality_metrics
    if len(metrics) != 1 or not isinstance(metrics[0], MinimizeActionCosts):
        return problem
    costs = {action.name: metrics[0].get_action_cost(action) for action in problem.actions}
    if all(cost is not None for cost in costs.values()):
        return problem
    copy = problem.clone()
    copy.clear_quality_metrics()
    stated = {action: 0 if (cost := costs[action.name]) is None else cost for action in copy.actions}
    copy.add_quality_metric(MinimizeActionCosts(stated, environment=problem.environment))
    return copy


def _meets(plan: TimeTriggeredPlan) -> bool:
    """Whether steps of a plan start or end at one and the same time."""
    times = [time for start, _, duration in plan.timed_actions for time in {start, start + (duration or 0)}]
    return len(set(times)) < len(times)


def _unsupported(error: Exception) -> PlanGenerationResult:
    logs = [LogMessage(LogLevel.ERROR, str(error))]
    return PlanGenerationResult(Status.UNSUPPORTED_PROBLEM, None, "descry", log_messages=logs)


def _fraction(value: float) -> Fraction:
    """The simplest fraction that a number of a plan stands for: a third has no last digit."""
    return Fraction(value).limit_denominator(_MOST_DENOMINATOR)


def _told(outcome: Outcome) -> str:
    why = f": {outcome.why}" if outcome.why else ""
    plan = f"\n{outcome.plan}" if outcome.plan is not None else ""
    return f"{outcome.status} in {outcome.time_s:.3f} s{why}{plan}\n"


def register(environment: Optional[Environment] = None) -> None:
    """Adds the engine to an environment, the global one if none is given."""
    factory = get_environment(environment).factory
    if "descry" not in factory.engines:
        factory.add_engine("descry", __name__, "DescryEngine")


register()

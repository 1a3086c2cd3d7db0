"""The engine for unified-planning on the example problems and test cases that come with it."""

import importlib
import pathlib
import pkgutil
import sys
import threading
import warnings
from fractions import Fraction

import pytest

up = pytest.importorskip("unified_planning")

from unified_planning.engines import PlanGenerationResultStatus as Status  # noqa: E402
from unified_planning.engines.plan_validator import SequentialPlanValidator, TimeTriggeredPlanValidator  # noqa: E402
from unified_planning.engines.results import ValidationResultStatus  # noqa: E402
from unified_planning.shortcuts import *  # noqa: E402,F403
from unified_planning.test.examples import get_example_problems  # noqa: E402

import descry.unified_planning as engine  # noqa: E402

get_environment().credits_stream = None
EXAMPLES = get_example_problems()
SUPPORTED = [name for name, example in EXAMPLES.items() if engine.DescryEngine.supports(example.problem.kind)]


def test_what_is_supported():
    kinds = [EXAMPLES[name].problem.kind for name in SUPPORTED]
    assert len(SUPPORTED) >= 35
    assert sum(kind.has_continuous_time() for kind in kinds) >= 4
    assert sum(kind.has_int_fluents() or kind.has_real_fluents() for kind in kinds) >= 10
    for name in ("basic_tils", "robot_fluent_of_user_type", "1d_movement", "htn-go", "temporal_counter"):
        assert name not in SUPPORTED


@pytest.mark.parametrize("name", SUPPORTED)
def test_examples_are_solved_and_others_agree_that_the_plans_are_valid(name):
    example = EXAMPLES[name]
    with OneshotPlanner(name="descry") as planner:
        result = planner.solve(example.problem, timeout=30)
    assert (result.plan is not None) == example.solvable, result
    if not example.solvable:
        assert result.status in (Status.UNSOLVABLE_PROVEN, Status.UNSOLVABLE_INCOMPLETELY)
        return
    assert result.status in (Status.SOLVED_SATISFICING, Status.SOLVED_OPTIMALLY)
    for validator in (others(example.problem), engine.DescryEngine()):
        assert validator.validate(example.problem, result.plan), (validator.name, result.plan)


@pytest.mark.parametrize("name", SUPPORTED)
def test_given_plans_are_valid_or_not_as_they_are_said_to_be(name):
    example = EXAMPLES[name]
    with PlanValidator(name="descry") as validator:
        for plan in example.valid_plans:
            assert validator.validate(example.problem, plan), plan
        for plan in example.invalid_plans:
            result = validator.validate(example.problem, plan)
            assert result.status == ValidationResultStatus.INVALID and result.reason is not None, plan


@pytest.mark.parametrize("name", SUPPORTED)
def test_anytime_plans_get_better(name):
    example = EXAMPLES[name]
    with AnytimePlanner(name="descry") as planner:
        results = list(planner.get_solutions(example.problem, timeout=1))
    assert all(result.status == Status.INTERMEDIATE for result in results[:-1])
    assert (results[-1].plan is not None) == example.solvable
    if example.problem.quality_metrics:
        values = [value(example.problem, result.plan) for result in results if result.plan is not None]
        with_sign = [-v if "Maximize" in type(example.problem.quality_metrics[0]).__name__ else v for v in values]
        assert with_sign == sorted(with_sign, reverse=True)


def others(problem):
    """The validator that comes with unified-planning."""
    return TimeTriggeredPlanValidator() if problem.kind.has_continuous_time() else SequentialPlanValidator()


def value(problem, plan):
    """The metric as unified-planning reckons it."""
    return next(iter(others(problem).validate(problem, plan).metric_evaluations.values()))


def built_in_cases():
    """The test cases of `up_test_cases`, those aside that do not load: the package on PyPI lacks their PDDL files."""
    cases = {}
    for found in pkgutil.walk_packages(importlib.import_module("builtin").__path__, "builtin."):
        module = importlib.import_module(found.name)
        try:
            own = module.get_test_cases() if hasattr(module, "get_test_cases") else {}
        except (AssertionError, AttributeError) as error:
            print(f"SKIPPED: {found.name}: {error}")
            continue
        cases.update({f"{found.name}:{name}": case for name, case in own.items()})
    assert len(cases) > 50
    return cases


def test_the_test_cases_of_unified_planning_for_engines():
    """`report.py` of `up_test_cases`, which comes with unified-planning: planning, planning anytime and validating."""
    folder = pathlib.Path(up.__file__).parents[1] / "up_test_cases"
    if not folder.is_dir():
        pytest.skip("this unified-planning comes without up_test_cases")
    sys.path.insert(0, str(folder))
    try:
        report = importlib.import_module("report")
        cases = {**built_in_cases(), **report.get_test_cases_from_packages(["unified_planning.test"])}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            errors = {
                "oneshot": report.report_oneshot(["descry"], cases, 3.0, False),
                "anytime": report.report_anytime(["descry"], cases, 0.3, False),
                "validation": report.report_validation(["descry"], cases, False),
            }
    finally:
        sys.path.remove(str(folder))
    assert errors == {"oneshot": [], "anytime": [], "validation": []}


def test_names_that_pddl_does_not_have_are_mapped_back():
    thing = UserType("Some Thing")
    seen = Fluent("is seen?", BoolType(), what=thing)
    look = InstantaneousAction("look at", what=thing)
    look.add_effect(seen(look.what), True)
    problem = Problem("names & numbers")
    problem.add_fluent(seen, default_initial_value=False)
    problem.add_action(look)
    first, second = (problem.add_object(name, thing) for name in ("1st", "Define"))
    problem.add_goal(And(seen(first), seen(second)))
    with OneshotPlanner(name="descry") as planner:
        plan = planner.solve(problem).plan
    assert {(a.action, a.actual_parameters[0].object()) for a in plan.actions} == {(look, first), (look, second)}


def test_an_action_without_a_cost_costs_nothing():
    x, y = Fluent("x"), Fluent("y")
    paid, free = InstantaneousAction("paid"), InstantaneousAction("free")
    paid.add_effect(x, True)
    free.add_precondition(x)
    free.add_effect(y, True)
    problem = Problem("costs")
    for fluent in (x, y):
        problem.add_fluent(fluent, default_initial_value=False)
    problem.add_actions([paid, free])
    problem.add_goal(y)
    problem.add_quality_metric(MinimizeActionCosts({paid: Int(3)}))
    with OneshotPlanner(name="descry") as planner:
        result = planner.solve(problem)
    assert [step.action for step in result.plan.actions] == [paid, free]
    with PlanValidator(name="descry") as validator:
        assert list(validator.validate(problem, result.plan).metric_evaluations.values()) == [3]


def thirds():
    """An action that takes a third of a second, twice, one after the other."""
    count = Fluent("count", IntType())
    step = DurativeAction("step")
    step.set_fixed_duration(Fraction(1, 3))
    step.add_increase_effect(EndTiming(), count, 1)
    problem = Problem("thirds")
    problem.add_fluent(count, default_initial_value=0)
    problem.add_action(step)
    problem.add_goal(GE(count, 2))
    return problem


def test_durations_are_exact():
    problem = thirds()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the writer says that a third has no decimals
        with OneshotPlanner(name="descry") as planner:
            plan = planner.solve(problem).plan
    assert {duration for _, _, duration in plan.timed_actions} == {Fraction(1, 3)}
    assert others(problem).validate(problem, plan)


@pytest.mark.parametrize(
    "epsilon, status",
    [(None, Status.UNSOLVABLE_INCOMPLETELY), (Fraction(1, 10**4), Status.UNSOLVABLE_INCOMPLETELY), (Fraction(1, 100), Status.UNSOLVABLE_PROVEN)],
)
def test_a_proof_holds_for_the_separation_that_was_asked_for(epsilon, status):
    problem = thirds()
    problem.epsilon = epsilon
    never = problem.add_fluent("never", default_initial_value=False)
    problem.add_goal(problem.fluent("never"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with OneshotPlanner(name="descry") as planner:
            assert planner.solve(problem).status == status


def test_proofs_and_limits_without_times():
    with OneshotPlanner(name="descry") as planner:
        problem = EXAMPLES["basic"].problem.clone()
        problem.add_fluent("never", default_initial_value=False)
        problem.add_goal(problem.fluent("never"))
        result = planner.solve(problem)
        assert result.status == Status.UNSOLVABLE_PROVEN and "never" in result.log_messages[0].message
    with OneshotPlanner(name="descry") as planner:
        assert planner.solve(hard(), timeout=0.1).status == Status.TIMEOUT
    with OneshotPlanner(name="descry", params={"memory_limit_mb": 1}) as planner:
        assert planner.solve(hard()).status == Status.MEMOUT


def hard():
    """Counters of which each step moves two: far too many states to see them all, and no plan."""
    problem = Problem("hard")
    item = UserType("item")
    at = Fluent("at", IntType(), what=item)
    problem.add_fluent(at, default_initial_value=0)
    items = [problem.add_object(f"i{n}", item) for n in range(12)]
    swap = InstantaneousAction("swap", a=item, b=item)
    swap.add_precondition(Not(Equals(swap.a, swap.b)))
    swap.add_increase_effect(at(swap.a), 2)
    swap.add_decrease_effect(at(swap.b), 2)
    problem.add_action(swap)
    for n, thing in enumerate(items):
        problem.add_goal(Equals(at(thing), 2 * n + 1))
    return problem


def test_a_problem_without_pddl_is_said_to_be_unsupported():
    problem = EXAMPLES["robot_fluent_of_user_type"].problem
    with OneshotPlanner(name="descry") as planner, pytest.warns(UserWarning, match="cannot establish"):
        result = planner.solve(problem)
    assert result.status == Status.UNSUPPORTED_PROBLEM and "boolean and numerical" in result.log_messages[0].message


def test_a_reader_of_plans_who_goes_away_ends_the_search():
    with AnytimePlanner(name="descry") as planner:
        solutions = planner.get_solutions(EXAMPLES["counter_to_50"].problem)
        assert next(solutions).plan is not None
        solutions.close()
    assert not [thread for thread in threading.enumerate() if thread.name == "descry"]

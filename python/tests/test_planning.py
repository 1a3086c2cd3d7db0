"""Planning, validating and checking; errors; Ctrl-C; functions behind calls."""

import math
import os
import signal
import threading
import time
from pathlib import Path

import pytest

import descry

DATA = Path(__file__).parents[2] / "cli" / "tests" / "data"
ROADS = descry.Task.read(DATA / "roads.pddl", DATA / "roads-problem.pddl")

SWITCHES = """
(define (domain switches)
  (:requirements :strips :typing :negative-preconditions)
  (:types switch)
  (:predicates (on ?s - switch) (last ?s - switch))
  (:action flip :parameters (?s - switch) :precondition (not (on ?s)) :effect (and (on ?s) (last ?s)))
  (:action unflip :parameters (?s - switch) :precondition (on ?s) :effect (not (on ?s))))
"""
PROBLEM = "(define (problem p) (:domain switches) (:objects a b - switch) (:init) (:goal (and (on a) (on b))))"


def dear_edge(call):
    """The direct way is dear."""
    return 90 if call.arguments == ["home", "market"] else 1


@pytest.fixture(scope="session")
def slow():
    """A task whose search takes long: there is a row more than there are columns."""
    return queens(14, columns=13)


def queens(n, columns):
    """Queens, one in each of n rows, put in any order into so many columns."""
    names = " ".join(f"q{i}" for i in range(n))
    apart = " ".join(f"(apart q{r} q{c} q{s} q{d})" for r in range(n) for c in range(n) for s in range(n) for d in range(n) if r != s and c != d and abs(r - s) != abs(c - d))
    domain = """(define (domain queens) (:requirements :adl)
      (:predicates (put ?r) (stands ?r ?c) (apart ?r ?c ?s ?d) (row ?r) (column ?c))
      (:action place :parameters (?r ?c) :precondition (and (row ?r) (column ?c) (not (put ?r))
        (forall (?s ?d) (imply (stands ?s ?d) (apart ?r ?c ?s ?d)))) :effect (and (put ?r) (stands ?r ?c))))"""
    squares = " ".join([*(f"(row q{i})" for i in range(n)), *(f"(column q{i})" for i in range(columns))])
    goal = " ".join(f"(put q{i})" for i in range(n))
    return descry.Task(domain, f"(define (problem q) (:domain queens) (:objects {names}) (:init {squares} {apart}) (:goal (and {goal})))")


def test_a_task_is_planned_and_its_plan_validated():
    task = descry.Task(SWITCHES, PROBLEM)
    assert (task.domain, task.problem, task.is_temporal) == ("switches", "p", False)
    assert (task.actions, task.objects) == (["flip", "unflip"], ["a", "b"])
    outcome = descry.plan(task)
    assert outcome.status == "solved" and len(outcome.plan) == 2 and outcome.plan.makespan_s is None
    assert {(s.action, *s.arguments) for s in outcome.plan.steps} == {("flip", "a"), ("flip", "b")}
    verdict = descry.validate(task, outcome.plan)
    assert verdict and verdict.cost == 2
    assert descry.Plan.parse(str(outcome.plan)) == outcome.plan
    assert str(descry.plan(task, seed=3).plan) == str(descry.plan(task, seed=3).plan)


@pytest.mark.parametrize(
    "plan, step, reason",
    [
        ("(flip a)", None, "the goal (on b) is not reached"),
        ("(flip a) (flip a)", 1, "(not (on a))"),
        ("(flip a) (fly b)", 1, "fly"),
    ],
)
def test_a_plan_that_does_not_hold_says_where(plan, step, reason):
    verdict = descry.validate(descry.Task(SWITCHES, PROBLEM), descry.Plan.parse(plan))
    assert not verdict and verdict.step == step and reason in verdict.reason


def test_what_has_no_plan_says_why():
    task = descry.Task(SWITCHES, PROBLEM.replace("(on b)", "(on b) (not (on a))"))
    outcome = descry.plan(task)
    assert outcome.status == "unsolvable" and outcome.plan is None
    assert "exclude each other" in outcome.why and outcome.findings[0].file == "problem"


@pytest.mark.parametrize(
    "domain, problem, told",
    [
        (SWITCHES.replace("(not (on ?s))", "(not (onn ?s))"), PROBLEM, ("domain", 6, 63, "did you mean `on`?")),
        (SWITCHES, PROBLEM.replace("(on b)", "(on c)"), ("problem", 1, 95, "did you mean `a`?")),
    ],
)
def test_an_error_points_at_its_place_and_offers_a_mend(domain, problem, told):
    with pytest.raises(descry.InputError) as raised:
        descry.Task(domain, problem)
    error = raised.value
    file, line, column, mend = told
    assert (error.file, error.line, error.column) == (file, line, column), error
    assert error.mend == mend
    assert error.findings[0].severity == "error" and isinstance(error, (descry.Error, ValueError))


def test_further_input_that_cannot_be_used():
    with pytest.raises(descry.InputError) as raised:
        descry.Task("(define domain)", PROBLEM)
    assert raised.value.expected == "`(domain name)` next", vars(raised.value)
    with pytest.raises(descry.InputError, match="no-such-file.pddl"):
        descry.Task.read("no-such-file.pddl", DATA / "roads-problem.pddl")
    for limit in (-1.0, math.nan, math.inf):
        with pytest.raises(descry.InputError, match="time_limit_s"):
            descry.plan(ROADS, time_limit_s=limit)


def test_every_finding_of_a_text():
    assert descry.check(SWITCHES, PROBLEM) == []
    findings = descry.check(SWITCHES.replace(":typing", ":typeing"))
    assert [(f.severity, f.code, f.line) for f in findings][0] == ("warning", "unknown-requirement", 3)


def test_a_function_answers_the_calls_of_a_domain():
    calls = {"path-cost": dear_edge}
    outcome = descry.plan(ROADS, attachments=calls)
    assert [s.arguments[1:] for s in outcome.plan.steps] == [["home", "crossing"], ["crossing", "market"]]
    assert outcome.plan.makespan_s == pytest.approx(2.0, abs=0.01)
    assert outcome.statistics["attachments"]["path-cost"]["calls"] > 0
    assert descry.validate(ROADS, outcome.plan, attachments=calls)
    assert not descry.validate(ROADS, outcome.plan, attachments={"path-cost": lambda call: 3})
    assert "<svg" in outcome.plan.gantt()


def test_a_function_hears_the_facts_that_it_reads():
    heard = set()

    def cost(call):
        heard.add(call.value("at", "van", "home"))
        with pytest.raises(KeyError):
            call.value("washed", "van")
        assert call.kind == "cost" and ("at", "van", "market") in call.readings
        return 1.0 if call.value("at", "van", "home") else 2.0

    asked = descry.Attachment(cost, reads=["at"], relaxed=lambda call: 1.0)
    outcome = descry.plan(ROADS, attachments={"path-cost": asked})
    assert outcome.plan.makespan_s == 1.0 and heard >= {True}


@pytest.mark.parametrize(
    "function, error, words",
    [
        (lambda call: 1 / 0, ZeroDivisionError, "division"),
        (lambda call: "far", descry.InputError, "expected a number"),
        (lambda call: -1.0, descry.InputError, "-1"),
        (lambda call: math.nan, descry.InputError, "NaN"),
    ],
)
def test_a_function_that_fails_ends_planning(function, error, words):
    with pytest.raises(error, match=words):
        descry.plan(ROADS, attachments={"path-cost": function})


def test_a_module_without_a_function_is_named():
    with pytest.raises(descry.InputError, match="path-cost") as raised:
        descry.plan(ROADS)
    assert raised.value.file.endswith("roads.pddl") and raised.value.line == 5


def test_ever_better_plans_are_heard_of():
    heard = []
    calls = {"path-cost": dear_edge}
    outcome = descry.plan(ROADS, anytime=True, attachments=calls, on_plan=heard.append, time_limit_s=0.3)
    assert heard[-1] == outcome.plan
    spans = [plan.makespan_s for plan in heard]
    assert spans == sorted(spans, reverse=True)
    with pytest.raises(RuntimeError, match="enough"):
        descry.plan(ROADS, attachments={"path-cost": dear_edge}, on_plan=enough)


def enough(plan):
    raise RuntimeError("enough")


def test_planning_ends_when_it_is_told_to(slow):
    task = slow
    assert descry.plan(task, time_limit_s=0.05).status == "out_of_time"
    asked = []
    outcome = descry.plan(task, stop=lambda: asked.append(1) or len(asked) > 2)
    assert outcome.status == "out_of_time" and len(asked) == 3
    assert descry.plan(task, memory_limit_mb=1).status == "out_of_memory"


def test_ctrl_c_ends_planning_and_other_threads_go_on(slow):
    counted = [0]

    def interrupt():
        for _ in range(20):
            time.sleep(0.01)
            counted[0] += 1
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        descry.plan(slow, time_limit_s=60)
    thread.join()
    assert counted[0] == 20


def test_why_an_action_is_not_in_a_plan():
    calls = {"path-cost": dear_edge}
    found = descry.plan(ROADS, attachments=calls).plan
    answer = descry.why_not(ROADS, "(drive van home market)", plan=found, attachments=calls)
    assert (answer.action, answer.in_plan, answer.unmet) == ("(drive van home market)", False, [])
    assert "It is not needed" in str(answer) and "makespan 90.000" in str(answer)
    later = descry.why_not(ROADS, "(drive van crossing market)", attachments=calls)
    assert later.in_plan and later.unmet == ["(at van crossing)"] and "cannot be taken at once" in str(later)
    assert later.data["leads_to_it"]["found"]["steps"][0]["action"] == "drive"
    for wrong in ("(fly van)", "(drive van home)", "drive"):
        with pytest.raises(descry.InputError):
            descry.why_not(ROADS, wrong, attachments=calls)
    with pytest.raises(ZeroDivisionError):
        descry.why_not(ROADS, "(drive van home market)", attachments={"path-cost": lambda call: 1 / 0})


def test_threads_change_no_plan():
    task = descry.Task(SWITCHES, PROBLEM)
    alone = descry.plan(task).plan
    assert alone and str(alone) == str(descry.plan(task, threads=2).plan)
    with pytest.raises(ValueError):
        descry.plan(task, threads=0)

"""The agent from Python: a run in the simulator, functions behind facts, calls and actions, a body, and its record."""

import importlib.util
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import descry
import descry.robot

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def found(tmp_path_factory):
    """A run that finds a cup, and what was heard of it."""
    heard = []
    folder = tmp_path_factory.mktemp("run") / "found"
    report = descry.pursue("find cup A", seed=1, run=folder, on_event=heard.append)
    return report, heard, folder


def test_a_cup_is_found(found):
    report, heard, folder = found
    assert report.verdict == "achieved" and report.confidence >= 0.8 and len(report.position_m) == 3
    assert (heard[0]["event"], heard[0]["said"]) == ("goal", "find cup A")
    assert any(event.get("event") == "planned" for event in heard) and heard[0]["text"].startswith("goal")
    assert Path(report.run) == folder and report.data["goal"] == report.goal == "find cup A"
    assert "achieved" in str(report)


def test_its_record_is_read(found):
    report, heard, folder = found
    record = descry.Record(folder)
    assert record.lost == [] == record.verify()
    assert record.report()["verdict"] == "achieved"
    events = record.events()
    assert [event["event"] for event in events if "event" in event][0] == "goal"
    assert "plan 1" in record.explain().lower()
    assert record.stats["records"] == len(record.query())
    clouds = record.query("cloud")
    assert len(clouds) == report.data["views"] and clouds[0].kind == "cloud"
    assert record.query("cloud", newest=True, limit=1)[0].id == clouds[-1].id
    points = record.cloud(clouds[0])
    assert points.dtype == np.float32 and points.shape[-1] == 3 and np.isfinite(points).any()
    pose = record.world_from_camera(clouds[0])
    assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3)) and pose[3].tolist() == [0, 0, 0, 1]
    with pytest.raises(descry.BrokenError):
        record.cloud(record.query("event")[0])


def test_what_was_seen_is_recognised_again(found):
    report, _, folder = found
    record = descry.Record(folder)
    kinds = set()
    for document in record.query("cloud"):
        points = record.cloud(document)
        seen = descry.recognise(points)
        assert seen.surface is not None and seen.surface.area_m2 > 0.1
        assert np.isclose(np.linalg.norm(seen.surface.up), 1.0)
        for thing in seen.objects:
            # Its points are near where it is said to stand.
            own = points.reshape(-1, 3)[thing.indices]
            assert np.linalg.norm(np.median(own, axis=0) - thing.position_m) < 0.3
            kinds.add(thing.label)
        # The same points in the room, as a bare cloud with the place of the camera.
        pose = record.world_from_camera(document)
        bare = points.reshape(-1, 3)[np.isfinite(points).all(axis=-1).ravel()] @ pose[:3, :3].T + pose[:3, 3]
        again = descry.recognise(bare, viewpoint_m=pose[:3, 3], up=[0, 0, 1])
        assert again.surface is not None and abs(again.surface.up[2]) > 0.99
    assert "cup A" in kinds


@pytest.mark.parametrize(
    "points, words",
    [
        (np.zeros((5, 2)), "N x 3"),
        (np.full((5, 3), np.nan), "finite"),
        ("a cloud", "array of floats"),
    ],
)
def test_what_is_no_cloud_is_said(points, words):
    with pytest.raises(descry.InputError, match=words):
        descry.recognise(points)


def test_a_cloud_without_a_surface_says_why():
    points = np.random.default_rng(1).normal(size=(500, 3)).astype(np.float32)
    seen = descry.recognise(points)
    assert seen.surface is None and seen.objects == [] and seen.why


@pytest.mark.parametrize(
    "asked, words",
    [
        (dict(goal="find the moon"), "moon"),
        (dict(goal="find cup A", domain="moon"), "there is no domain"),
        (dict(goal="find cup A", robot="moon"), "expected: sim"),
        (dict(goal="find cup A", policy="moon"), "moon"),
        (dict(goal="find cup A", facts={"raining": list}), "names no program for raining"),
    ],
)
def test_what_cannot_be_pursued_is_said(asked, words, tmp_path):
    with pytest.raises(descry.InputError, match=words):
        descry.pursue(**asked, run=tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.fixture
def bell(tmp_path):
    """A domain whose robot rings a bell when it rains, at a cost: functions answer for all three."""
    folder = tmp_path / "bell"
    descry.new_domain(folder)
    pddl = (folder / "domain.pddl").read_text()
    pddl = pddl.replace("(:predicates", "(:predicates\n    (rung)\n    (tired)\n    (raining)", 1)
    pddl = pddl.replace("(:modules", "(:modules\n    (effort ?to - surface cost effort@descry)", 1)
    head, tail = pddl.rsplit(")", 1)
    ring = """(:durative-action ring :parameters (?at - surface) :duration (= ?duration [effort ?at])
      :condition (and (at start (raining)) (at start (not (tired)))) :effect (at end (rung)))"""
    (folder / "domain.pddl").write_text(f"{head}\n{ring}\n){tail}")
    with open(folder / "domain.toml", "a") as file:
        file.write("""
[[goal]]
say = "ring"
means = "(rung)"
answer.achieved = "it rang"

[action.ring]
program = ["function"]
retries = 0
gives_up = ["(tired)"]

[word.tired]
is = "remembered"

[word.raining]
program = ["function"]

[attachments.effort]
program = ["function"]
""")
    return folder


def test_functions_state_facts_answer_calls_and_carry_out_actions(bell, tmp_path):
    rung = []

    def raining(objects):
        assert "table" in objects
        return ["(raining)"]

    def ring(at):
        rung.append(at)
        return "ding"

    heard = []
    report = descry.pursue(
        "ring",
        domain=bell,
        run=tmp_path / "run",
        facts={"raining": raining},
        attachments={"effort": lambda at: 2.5},
        actions={"ring": ring},
        on_event=heard.append,
    )
    assert report.verdict == "achieved" and rung == ["table"], str(report)
    assert any("ding" in event["text"] for event in heard)
    assert any("(ring table), 2.5 s" in event["text"] for event in heard)
    # What functions answered is on record, as that of programs is.
    assert len(descry.Record(tmp_path / "run").query("program")) >= 3


def bell_with(bell, tmp_path, raining=lambda objects: ["(raining)"], effort=lambda at: 1.0, ring=lambda at: None):
    return descry.pursue("ring", domain=bell, run=tmp_path / "run", facts={"raining": raining}, attachments={"effort": effort}, actions={"ring": ring})


def broken(*_):
    raise RuntimeError("no bell here")


def test_functions_that_fail(bell, tmp_path):
    assert bell_with(bell, tmp_path / "dry", raining=lambda objects: []).verdict == "impossible"
    for name in ("raining", "effort"):
        with pytest.raises(descry.InputError, match="no bell here") as raised:
            bell_with(bell, tmp_path / name, **{name: broken})
        assert isinstance(raised.value.__cause__, RuntimeError)
    with pytest.raises(descry.InputError, match="holds of raining"):
        bell_with(bell, tmp_path / "odd", raining=lambda objects: 7)
    # An action that could not be done is news, no error.
    given_up = bell_with(bell, tmp_path / "action", ring=broken)
    assert given_up.verdict == "impossible", str(given_up)
    events = descry.Record(tmp_path / "action" / "run").events()
    assert "no bell here" in [event for event in events if event.get("event") == "failed"][0]["because"]


def template():
    """The body of `robots/python/template.py`, as a class."""
    import sys

    sys.modules.setdefault("descry_robot", descry.robot)
    spec = importlib.util.spec_from_file_location("template", ROOT / "robots" / "python" / "template.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Template


def test_a_body_of_python_keeps_the_promises_and_looks(tmp_path):
    body = template()()
    descry.check_robot(body)
    report = descry.pursue("find cup A", robot=template()(), run=tmp_path / "run")
    assert report.verdict == "not_found" and report.data["views"] > 0, str(report)


def test_a_body_that_breaks_hands_its_exception_on(tmp_path):
    class Broken(template()):
        def sense(self, request):
            raise ZeroDivisionError("the lens is zero")

    with pytest.raises(descry.BrokenError) as raised:
        descry.pursue("find cup A", robot=Broken(), run=tmp_path / "run")
    assert isinstance(raised.value.__cause__, ZeroDivisionError)
    with pytest.raises(descry.BrokenError):
        descry.check_robot(Broken())
    assert not [thread for thread in threading.enumerate() if thread.name == "descry-body"]


def test_ctrl_c_stops_a_run_and_leaves_its_record_whole(tmp_path):
    class Slow(template()):
        def drive_to(self, request, to, route_m):
            threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
            while True:
                time.sleep(0.01)
                request.feedback(0.0)

    with pytest.raises(KeyboardInterrupt):
        descry.pursue("find cup A", robot=Slow(), run=tmp_path / "run")
    assert descry.Record(tmp_path / "run").lost == []


def test_an_exception_of_a_listener_ends_the_run(tmp_path):
    def listen(event):
        raise LookupError("that is enough")

    with pytest.raises(LookupError, match="enough"):
        descry.pursue("find cup A", run=tmp_path / "run", on_event=listen)


def stop_at(kind):
    """A listener that ends a run at the first event of a kind."""

    def listen(event):
        if event.get("event") == kind:
            raise LookupError("that is enough")

    return listen


def test_a_run_is_played_again(found, tmp_path):
    report, _, folder = found
    heard = []
    again = descry.replay(folder, out=tmp_path / "again", on_event=heard.append)
    assert again and again.same and again.verdict == report.verdict == "achieved"
    assert (again.differences, again.damage, again.cut_off) == ([], [], None)
    assert heard[0]["event"] == "goal" and dict(again.data["compared"])["percepts"] == report.data["views"]
    assert descry.Record(tmp_path / "again").report()["verdict"] == "achieved"
    with pytest.raises(descry.InputError):
        descry.replay(tmp_path)
    with pytest.raises(LookupError, match="enough"):
        descry.replay(folder, on_event=stop_at("planned"))


def test_a_run_that_was_stopped_goes_on(found, tmp_path):
    report, _, _ = found
    with pytest.raises(LookupError):
        descry.pursue("find cup A", seed=1, run=tmp_path / "run", on_event=stop_at("acted"))
    assert descry.replay(tmp_path / "run").cut_off is not None
    went_on = descry.resume(tmp_path / "run")
    assert (went_on.verdict, went_on.position_m) == (report.verdict, report.position_m)
    assert "It was cut off once" in descry.Record(tmp_path / "run").explain()
    assert descry.replay(tmp_path / "run").same
    with pytest.raises(descry.InputError):
        descry.resume(tmp_path / "none")


def test_functions_and_bodies_of_python_go_on_too(bell, tmp_path):
    def given(raining):
        return dict(facts={"raining": raining}, attachments={"effort": lambda at: 1.0}, actions={"ring": lambda at: "ding"})

    with pytest.raises(LookupError):
        descry.pursue("ring", domain=bell, run=tmp_path / "run", **given(lambda objects: ["(raining)"]), on_event=stop_at("planned"))
    with pytest.raises(descry.InputError, match="allow"):
        descry.resume(tmp_path / "run")
    # What was answered before is not asked again.
    asked = []
    report = descry.resume(tmp_path / "run", **given(lambda objects: asked.append(1) or ["(raining)"]))
    assert report.verdict == "achieved" and len(asked) <= 2, (str(report), asked)

    with pytest.raises(LookupError):
        descry.pursue("find cup A", robot=template()(), run=tmp_path / "body", on_event=stop_at("planned"))
    assert descry.resume(tmp_path / "body", robot=template()()).verdict == "not_found"


def test_what_may_be_said():
    assert "find <thing>" in descry.goals(), descry.goals()

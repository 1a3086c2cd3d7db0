"""The official Python client (`pip install mcp`) drives every tool of `descry mcp`, and mends a domain by its findings.

    DESCRY=target/release/descry python cli/tests/mcp_client.py
"""

import asyncio
import os
import tempfile

from mcp import ClientSession, StdioServerParameters, stdio_client

DOMAIN = """(define (domain errands) (:requirements :strips :typing) (:types place)
  (:predicates (at ?p - place) (way ?a ?b - place))
  (:action go :parameters (?a ?b - place) :precondition (and (at ?a) (way ?a ?b))
    :effect (and (at ?b) (not (at ?a)))))"""
PROBLEM = """(define (problem home) (:domain errands) (:objects shop park home - place)
  (:init (at shop) (way shop park) (way park home)) (:goal (at home)))"""
CLOUD = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 900\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 900\nDATA ascii\n"


def said(result):
    """What a tool answered; both generations of the client are read."""
    answer = getattr(result, "structured_content", None) or result.structuredContent
    is_error = result.is_error if hasattr(result, "is_error") else result.isError
    assert not is_error, answer
    return answer


async def drive(session, folder):
    greeted = await session.initialize()
    listed = await session.list_tools()
    left = {tool.name for tool in listed.tools}
    print(f"{greeted.protocol_version if hasattr(greeted, 'protocol_version') else greeted.protocolVersion}: {', '.join(sorted(left))}")

    async def call(tool, progress=None, **arguments):
        left.discard(tool)
        result = await session.call_tool(tool, arguments, progress_callback=progress)
        return said(result)

    both = {"domain": DOMAIN, "problem": PROBLEM}
    assert (await call("check", **both))["findings"] == []
    assert (await call("plan", **both))["status"] == "solved"
    assert (await call("validate", plan="(go shop park)\n(go park home)\n", **both))["valid"]
    assert not (await call("why_not", action="(go home park)", **both))["why_not"]["in_plan"]
    assert "(define" in (await call("format", text=DOMAIN))["text"]
    assert (await call("goals", domain="home"))["phrases"]
    steps = []

    async def told(progress, total, message):
        steps.append(message)

    run = await call("run", progress=told, goal="please find cup A", seed=1)
    assert run["verdict"] == "achieved" and steps, run
    assert (await call("explain", run=run["run"]))["summary"]
    points = "\n".join(f"{0.02 * (k % 30) - 0.3} {0.02 * (k // 30) - 0.3} 1.0" for k in range(900))
    with open(os.path.join(folder, "cloud.pcd"), "w") as file:
        file.write(CLOUD + points + "\n")
    assert "exit" in await call("recognise", clouds=["cloud.pcd"])
    assert not left, f"not called: {left}"
    print(f"every tool answered; {len(steps)} steps were told")


FAULTS = {"(not (at ?a))": "(not (att ?a))", "(?a ?b - place) :pre": "(?a ?b - plase) :pre", "(way ?a ?b))\n": "(wya ?a ?b))\n"}


async def mend(session):
    """A domain with three faults, each mended at the place of its finding with the text that the finding suggests."""
    domain = DOMAIN
    for right, wrong in FAULTS.items():
        assert right in domain, right
        domain = domain.replace(right, wrong)
    mended = 0
    while True:
        findings = said(await session.call_tool("check", {"domain": domain, "problem": PROBLEM}))["findings"]
        errors = [finding for finding in findings if finding["severity"] == "error"]
        if not errors:
            break
        place, mend = errors[0]["labels"][0], errors[0]["help"].split("`")[1]
        text = domain.encode()
        domain = (text[: place["start"]] + mend.encode() + text[place["end"] :]).decode()
        mended += 1
        assert mended <= len(FAULTS), domain
    assert said(await session.call_tool("plan", {"domain": domain, "problem": PROBLEM}))["status"] == "solved", domain
    print(f"{mended} faults were mended by their findings")


async def main():
    with tempfile.TemporaryDirectory() as folder:
        server = StdioServerParameters(command=os.path.realpath(os.environ["DESCRY"]), args=["mcp", "--folder", folder])
        async with stdio_client(server) as (read, write), ClientSession(read, write) as session:
            await drive(session, folder)
            await mend(session)


asyncio.run(main())

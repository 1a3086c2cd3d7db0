"""The action `pursue`: a behaviour tree or any other node gives a goal in words, and is told steps, verdict, place and evidence.

Goals are carried out by `descry do`, one after the other, in a process each: what a goal does cannot hurt the server, and its record is
on disk whatever happens.
"""

import json
import queue
import signal
import subprocess
import threading

import rclpy
from descry_msgs.action import Pursue
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor

POLL_S = 0.2
# Seconds that a run that was stopped has to bring the body to a halt and keep its record.
HALT_S = 20.0


class Server:
    def __init__(self, descry, options):
        self.descry, self.options, self.one = descry, options, threading.Lock()
        self.node = rclpy.create_node("descry")
        ActionServer(
            self.node, Pursue, "pursue", self.pursue, callback_group=ReentrantCallbackGroup(), cancel_callback=lambda _: CancelResponse.ACCEPT
        )

    def pursue(self, handle):
        while not self.one.acquire(timeout=POLL_S):
            if handle.is_cancel_requested:
                handle.canceled()
                return Pursue.Result(verdict="cancelled", why="it had not begun")
        try:
            return self.carried_out(handle)
        finally:
            self.one.release()

    def carried_out(self, handle):
        asked = handle.request
        domain = ["--domain", asked.domain] if asked.domain else []
        command = [self.descry, "do", "--json", *domain, *self.options, "--", asked.goal]
        run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        said, told = [], queue.Queue()
        listener = threading.Thread(target=lambda: said.append(run.stdout.read()), daemon=True)
        listener.start()
        threading.Thread(target=lambda: [told.put(line) for line in run.stderr] + [told.put(None)], daemon=True).start()
        is_stopped = False
        while True:
            try:
                line = told.get(timeout=POLL_S)
            except queue.Empty:
                line = ""
            if line is None:
                break
            if line.strip():
                handle.publish_feedback(Pursue.Feedback(step=line.rstrip()))
            if handle.is_cancel_requested and not is_stopped:
                is_stopped = True
                run.send_signal(signal.SIGINT)
                threading.Timer(HALT_S, run.kill).start()
        run.wait()
        listener.join()
        if is_stopped:
            handle.canceled()
            return Pursue.Result(verdict="cancelled", why="it was stopped")
        result = self.result(said[0] if said else "", run.returncode)
        # A goal that was not achieved is answered: the verdict says how. Only one that could not be pursued is aborted.
        handle.abort() if result.verdict == "failed" else handle.succeed()
        return result

    def result(self, text, code):
        try:
            report = json.loads(text)
        except json.JSONDecodeError:
            return Pursue.Result(verdict="failed", why=f"descry ended with {code} and no report")
        result = Pursue.Result(verdict=report["verdict"], why=report.get("why", ""), confidence=float(report.get("confidence") or 0.0))
        result.evidence = str(report.get("run") or "")
        place = report.get("position_m")
        if place:
            result.found = True
            result.place.header.frame_id, result.place.header.stamp = "map", self.node.get_clock().now().to_msg()
            point, result.place.pose.orientation.w = result.place.pose.position, 1.0
            point.x, point.y, point.z = place
        return result


def serve(descry, options):
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(Server(descry, options).node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()

"""A ROS 2 node on Cyclone DDS beside the gateway: what it sees of the station, and its joint states as the robot's.

Runs in a network namespace of its own (made by run_isolated).
"""

import json
import math
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import trials
from processes import Programs, exemplar, wait_for

HERE = pathlib.Path(__file__).resolve().parent / "ros2"
ROOT = HERE.parents[2]
ROBOT = ROOT / "deploy" / "models" / "arm7"
PRESS = ROOT / "deploy" / "config" / "rail_press.yaml"
BUTTON = [0.55, -0.15, 0.05]
SCENE = "obstacles: []\nbuttons:\n  - {name: target, position: [0.55, -0.15, 0.05], height: 0.02, radius: 0.02}\n"
DOMAIN = "95"


class Ros2Test(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-ros2-"))
        self.addCleanup(shutil.rmtree, self.folder)
        if not shutil.which("idlc") or not pathlib.Path("/usr/include/dds/dds.h").exists():
            self.skipTest("cyclonedds-dev and cyclonedds-tools are not installed")
        subprocess.run(["idlc", "-f", "case-sensitive", "-l", "c", HERE / "ros2.idl"], cwd=self.folder, check=True, capture_output=True)
        self.node = self.folder / "node"
        subprocess.run(["gcc", "-I", self.folder, HERE / "node.c", self.folder / "ros2.c", "-lddsc", "-o", self.node], check=True)
        self.programs = Programs(self.folder, DOMAIN)
        self.addCleanup(self.programs.end)

    def server(self, program, *words, bus=True):
        port_file = self.folder / f"port-{len(self.programs.running)}"
        self.programs.start(program, "--listen", "127.0.0.1:0", "--port-file", port_file, *words, bus=bus)
        wait_for(lambda: port_file.exists() and port_file.read_text().strip(), f"the port of {program}")
        return "127.0.0.1:" + port_file.read_text().strip().rsplit(":", 1)[-1]

    def heard(self, **counts):
        """Messages by topic, once so many have come; "__" stands for "/"."""
        wanted = [f"{topic.replace('__', '/')}={count}" for topic, count in counts.items()]
        done = subprocess.run([self.node, DOMAIN, "listen", *wanted], capture_output=True, text=True, timeout=90)
        self.assertEqual(done.returncode, 0, done.stderr)
        messages = {}
        for line in done.stdout.splitlines():
            message = json.loads(line)
            messages.setdefault(message["topic"], []).append(message)
        return messages

    def test_a_node_sees_robot_transforms_objects_and_plan(self):
        scene = self.folder / "scene.yaml"
        scene.write_text(SCENE, encoding="utf-8")
        # Its tracking system sees the objects. The simulated time waits for the executor: how busy the machine is does not matter.
        self.programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", scene, "--track-hz", "20", "--cameras", "off", "--in-step-with", "executor")
        learning = self.server("exemplar-learning", "--data-dir", self.folder / "skills", "--robot", ROBOT, bus=False)
        executor = self.server("exemplar-executor", "--robot", ROBOT, "--scene", scene, "--learning", learning, "--clock", "network")
        self.server("exemplar-gateway", "--ros2", "--robot", ROBOT, "--executor", executor)
        files = trials.write_set(self.folder / "trials", [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06)])
        exemplar("--server", learning, "trial", "submit", "--skill", "press", *files)
        exemplar("--server", learning, "skill", "learn", "press")
        wait_for(lambda: exemplar("--server", executor, "robot", "status").get("joint_names"), "the robot's joint state")
        exemplar("--server", executor, "skill", "execute", "press", "--object", "target=0.55,-0.15,0.05,0,0,0,1", "--wait")

        latched = {"rt__robot_description": 1, "rt__tf_static": 1, "rt__planned_trajectory": 1, "ros_discovery_info": 2}  # one of them its own
        heard = self.heard(**latched, rt__joint_states=150, rt__joint_command=0, rt__tf=10, rt__objects__target__pose=1)
        status = exemplar("--server", executor, "robot", "status")
        state = heard["rt/joint_states"][-1]
        self.assertEqual(state["name"], status["joint_names"])
        for measured, told in zip(status["joints"], state["position"]):
            self.assertAlmostEqual(measured, told, delta=0.01)
        stamps = [message["sec"] + 1e-9 * message["nanosec"] for message in heard["rt/joint_states"]]
        self.assertEqual(stamps, sorted(stamps))
        self.assertGreaterEqual(len(stamps), 150)
        self.assertGreater(min(b - a for a, b in zip(stamps, stamps[1:])), 0.99 / 100)  # the limit of the rate

        # Latched: published before this node came.
        self.assertTrue(heard["rt/robot_description"][-1]["urdf"])
        plan = heard["rt/planned_trajectory"][-1]
        self.assertEqual(plan["joint_names"], status["joint_names"])
        self.assertGreater(plan["points"], 50)
        self.assertGreater(plan["duration"], 1)

        poses = heard["rt/objects/target/pose"]
        self.assertLess(math.dist(poses[-1]["pose"][:3], BUTTON), 0.03)

        self.is_a_node_with(heard, {"rt/joint_states", "rt/joint_command", "rt/tf", "rt/tf_static", "rt/robot_description", "rt/planned_trajectory", "rt/objects/target/pose"})

        # Chained from the tool to the root, as tf2 does it.
        parents = {}
        for message in heard["rt/tf_static"] + heard["rt/tf"]:
            for transform in message["transforms"]:
                parents[transform["child"]] = transform
        self.assertIn("target", parents)
        position, link = [0.0, 0.0, 0.0], "tool"
        while link in parents:
            position = applied(parents[link]["pose"], position)
            link = parents[link]["parent"]
        tool = status["tool"]
        self.assertLess(math.dist(position, tool["position"] if isinstance(tool, dict) else tool[:3]), 0.01)

    def is_a_node_with(self, heard, topics):
        """ros_discovery_info tells the participant and the writers that the middleware sees."""
        told = [message for message in heard["ros_discovery_info"] if message["nodes"][0]["name"] == "exemplar_gateway"][-1]
        self.assertEqual(told["nodes"][0]["namespace"], "/")
        matched = [message for message in heard["matched"] if message["of"] in topics]
        self.assertEqual({message["of"] for message in matched}, topics)
        for message in matched:
            self.assertEqual(message["participant"], told["participant"])
            self.assertIn(message["writer"][0], told["nodes"][0]["writers"])
        self.assertEqual(len(told["nodes"][0]["writers"]), len(topics))
        self.assertIn(("enclave=/;", told["participant"]), [(seen["user_data"], seen["gid"]) for seen in heard["participant"]])

    def test_nodes_get_the_simulated_time(self):
        self.programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", PRESS, "--cameras", "off", "--pace", "4", "--epoch-s", "1000000000")
        self.server("exemplar-gateway", "--ros2", "--clock", "network")
        times = [message["sec"] - 1_000_000_000 + 1e-9 * message["nanosec"] for message in self.heard(rt__clock=60)["rt/clock"]]
        self.assertGreaterEqual(len(times), 60)
        self.assertEqual(times, sorted(times))
        self.assertGreater(times[0], 0)
        self.assertLess(times[-1], 3600)

    def test_joint_states_of_ros_2_are_the_robots(self):
        self.server("exemplar-gateway", "--ros2", "--ros2-robot-from", "/robot/joint_states")
        recorder = self.server("exemplar-recorder", "--data-dir", self.folder / "data")
        node = subprocess.Popen([self.node, DOMAIN, "robot", "100"])
        self.addCleanup(node.wait)
        self.addCleanup(node.kill)
        exemplar("record", "start", "--name", "robot", "--topic", "ircp/joint_state", "--wait", "60", "--server", recorder)
        nodes = [message["nodes"][0] for message in self.heard(ros_discovery_info=2)["ros_discovery_info"]]
        self.assertEqual([len(told["readers"]) for told in nodes if told["name"] == "exemplar_gateway"][-1], 1)  # of the robot's
        wait_for(lambda: exemplar("record", "status", "--server", recorder)["messages"] > 200, f"states: {self.programs.logs()}")
        exemplar("record", "stop", "--server", recorder)
        info = exemplar("record", "info", self.folder / "data" / "robot.mcap")
        states = next(entry for entry in info["topics"] if entry["topic"] == "ircp/joint_state")
        self.assertGreater(states["messages"], 100, self.programs.logs())
        self.assertIn("refused", self.programs.logs())  # the messages with fewer positions than names
        self.assertIn("1 values for 2 names", self.programs.logs())


def applied(pose, point):
    """The point of the child's frame, in the parent's."""
    x, y, z, w = pose[3:]
    px, py, pz = point
    tx, ty, tz = 2 * (y * pz - z * py), 2 * (z * px - x * pz), 2 * (x * py - y * px)
    return [
        pose[0] + px + w * tx + y * tz - z * ty,
        pose[1] + py + w * ty + z * tx - x * tz,
        pose[2] + pz + w * tz + x * ty - y * tx,
    ]


if __name__ == "__main__":
    unittest.main()

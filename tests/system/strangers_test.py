"""Topics of a stranger, written with Cyclone DDS: recorded whole, keyed and not, with each source of schema."""

import pathlib
import shutil
import subprocess
import tempfile
import unittest

import processes
import recorded
from processes import exemplar

HERE = pathlib.Path(__file__).resolve().parent / "strangers"
COUNT = 3000


class StrangersTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-strangers-"))
        self.addCleanup(shutil.rmtree, self.folder)
        if not shutil.which("idlc") or not pathlib.Path("/usr/include/dds/dds.h").exists():
            self.skipTest("cyclonedds-dev and cyclonedds-tools are not installed")
        subprocess.run(["idlc", "-l", "c", HERE / "reading.idl"], cwd=self.folder, check=True)
        self.writer = self.folder / "writer"
        subprocess.run(["gcc", "-I", self.folder, HERE / "writer.c", self.folder / "reading.c", "-lddsc", "-o", self.writer], check=True)
        self.programs = processes.Programs(self.folder, 95)
        self.addCleanup(self.programs.end)

    def record(self, kind, schema=(), recorder_words=(), partition="test"):
        """The topic as `record info` and the recorder's status show it."""
        _, server = self.programs.recorder("--all-topics", *recorder_words)
        self.server = server
        topic = f"lab/{kind}"
        command = [self.writer, "95", partition, topic, kind, COUNT, *schema]
        with subprocess.Popen([str(word) for word in command], stdin=subprocess.PIPE) as writer:
            self.addCleanup(writer.kill)
            exemplar("record", "start", "--name", kind, "--topic", topic, "--wait", "60", "--server", server)
            writer.stdin.write(b"\n")
        self.assertEqual(writer.returncode, 0, self.programs.logs())
        status = exemplar("record", "stop", "--server", server)
        figures = next(entry for entry in status["topics"] if entry["topic"] == topic)
        self.assertEqual(figures["lost"], 0)
        info = exemplar("record", "info", self.folder / "data" / f"{kind}.mcap")
        found = next(entry for entry in info["topics"] if entry["topic"] == topic)
        self.assertEqual(found["messages"], COUNT, self.programs.logs())
        self.assertEqual(found["encoding"], "cdr")
        return found, figures

    def test_a_topic_without_schema_is_recorded_as_it_is_and_said_so(self):
        found, figures = self.record("plain")
        self.assertEqual(found["type"], "")
        self.assertFalse(figures["has_schema"])
        self.assertIn("topic without schema", self.programs.logs())

    def test_a_keyed_topic_has_its_schema_from_the_user_data(self):
        found, figures = self.record("keyed", schema=[HERE / "reading.idl"])
        self.assertEqual(found["type"], "lab::v1::KeyedReading")
        self.assertTrue(figures["has_schema"])

    def test_a_topic_without_partition_is_recorded_as_other_middlewares_have_it_by_default(self):
        found, _ = self.record("keyed", recorder_words=["--schema-dir", HERE], partition="-")
        self.assertEqual(found["type"], "lab::v1::KeyedReading")

    def test_a_keyed_topic_has_its_schema_from_the_folder(self):
        found, _ = self.record("keyed", recorder_words=["--schema-dir", HERE])
        self.assertEqual(found["type"], "lab::v1::KeyedReading")

    def test_a_keyed_and_a_plain_topic_are_replayed_byte_for_byte(self):
        for kind, schema in (("keyed", [HERE / "reading.idl"]), ("plain", ())):
            self.record(kind, schema=schema)
            original, again = (self.folder / "data" / f"{name}.mcap" for name in (kind, f"{kind}-again"))
            exemplar("record", "start", "--name", f"{kind}-again", "--server", self.server)
            played = exemplar("record", "replay", original, "--rate", "10", "--wait", "60", "--domain", "95", "--station", "test")
            exemplar("record", "stop", "--server", self.server)
            self.assertEqual(played["refused"], 0)
            topic = f"lab/{kind}"
            sent, came = (recorded.messages(file)[topic] for file in (original, again))
            self.assertEqual([said[1:] for said in came], [said[1:] for said in sent])
            self.programs.end()


if __name__ == "__main__":
    unittest.main()

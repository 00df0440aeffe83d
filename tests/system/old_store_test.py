"""A store that a former program wrote (tests/data/store_schema_1), opened by today's: nothing is lost, and it answers as it did."""

import gzip
import json
import pathlib
import shutil
import signal
import sqlite3
import subprocess
import tempfile
import unittest

import processes
from processes import exemplar, wait_for

FORMER = processes.ROOT / "tests" / "data" / "store_schema_1"


class OldStoreTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-old-store-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.file = self.folder / "learning.db"
        self.file.write_bytes(gzip.decompress((FORMER / "learning.db.gz").read_bytes()))
        self.said = json.loads((FORMER / "said.json").read_text(encoding="utf-8"))

    def schema(self):
        connection = sqlite3.connect(self.file)
        try:
            return connection.execute("PRAGMA user_version").fetchone()[0]
        finally:
            connection.close()

    def start(self):
        port = self.folder / "port"
        port.unlink(missing_ok=True)
        words = ["exemplar-learning", "--data-dir", self.folder, "--listen", "127.0.0.1:0", "--port-file", port]
        process = subprocess.Popen([str(processes.BINARIES / words[0]), *map(str, words[1:])], stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        wait_for(lambda: port.exists() and port.read_text().strip(), "the service's port")
        return process, "127.0.0.1:" + port.read_text().strip().rsplit(":", 1)[-1]

    def check_all_is_there(self, server):
        self.assertEqual([trial["id"] for trial in exemplar("trial", "list", "--server", server)], self.said["trials"])
        keys = ("version", "current", "method", "trial_ids")
        versions = [{key: version[key] for key in keys} for version in exemplar("skill", "versions", "press", "--server", server)]
        self.assertEqual(versions, self.said["versions"])
        answer = exemplar("skill", "query", "press", "--object", self.said["query"], "--server", server)
        self.assertEqual(answer["version"], self.said["answer"]["version"])
        self.assertAlmostEqual(answer["time_s"][-1], self.said["answer"]["duration_s"], places=6)
        path = [pose["position"] for pose in answer["base_T_tool"][::20]]
        self.assertEqual(len(path), len(self.said["answer"]["tool_path_m"]))
        for now, then in zip(path, self.said["answer"]["tool_path_m"]):
            for a, b in zip(now, then):
                self.assertAlmostEqual(a, b, delta=1e-6)

    def test_a_store_of_the_previous_schema_is_migrated_whole_and_once(self):
        self.assertEqual(self.schema(), 1)
        process, server = self.start()
        self.check_all_is_there(server)
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(20), 0)
        self.assertGreater(self.schema(), 1)
        _, server = self.start()
        self.check_all_is_there(server)
        # Whose trials they are nobody knew then; from now on it can be said.
        trial = self.said["trials"][0]
        self.assertEqual({t["person"] for t in exemplar("trial", "list", "--server", server)}, {""})
        command = [processes.BINARIES / "exemplar", "trial", "set-person", trial, "user03", "--server", server]
        self.assertEqual(subprocess.run([str(word) for word in command], check=False, timeout=60).returncode, 0)
        self.assertEqual([t["id"] for t in exemplar("trial", "list", "--person", "user03", "--server", server)], [trial])
        # The next version goes on counting where the former program was.
        last = max(version["version"] for version in self.said["versions"])
        exemplar("skill", "learn", "press", "--option", "method=paper", "--server", server)
        self.assertEqual(exemplar("skill", "versions", "press", "--server", server)[-1]["version"], last + 1)

    def test_a_kill_right_after_the_migration_loses_nothing(self):
        process, _ = self.start()
        process.kill()
        process.wait()
        self.assertGreater(self.schema(), 1)
        _, server = self.start()
        self.check_all_is_there(server)


if __name__ == "__main__":
    unittest.main()

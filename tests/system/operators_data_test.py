"""Backup, restore, retention and erasure of one person's data, with real services behind a gateway, as an operator does it."""

import hashlib
import io
import json
import os
import pathlib
import re
import shutil
import signal
import sqlite3
import subprocess
import tarfile
import tempfile
import threading
import unittest

import processes
import trials
from processes import exemplar, wait_for

BUTTONS = [(0.50, -0.20, 0.05), (0.60, 0.00, 0.05), (0.45, 0.10, 0.05), (0.62, -0.22, 0.05), (0.52, -0.05, 0.05)]
QUERY = "target=0.55,-0.1,0.05"
# What nobody else's samples hold: a tool height of the erased person's trial files, as text.
OWN_SAMPLE = "0.320271828"


def run(*words, stdin=None):
    """Exit code, standard output, standard error."""
    command = [processes.BINARIES / "exemplar", *words]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=120, stdin=stdin)
    return done.returncode, done.stdout, done.stderr


def bytes_below(folder):
    return b"".join(path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file())


class Station:
    """Learning and recorder behind a gateway, with data in `folder`."""

    def __init__(self, test, folder, *learning_options):
        self.test, self.folder = test, folder
        folder.mkdir(parents=True, exist_ok=True)
        self.programs = processes.Programs(folder, 64)
        test.addCleanup(self.programs.end)
        self.learning_process, self.learning = self.start("learning", *learning_options)
        self.recorder_process, self.recorder = self.start("recorder", "--all-topics")
        _, self.gateway = self.start("gateway", "--learning", self.learning, "--recorder", self.recorder)

    def start(self, name, *words):
        port = self.folder / f"port-{len(self.programs.running)}"
        if name != "gateway":
            words += ("--data-dir", self.folder / name)
        process = self.programs.start(f"exemplar-{name}", "--listen", "127.0.0.1:0", "--port-file", port, *words, bus=name != "learning")
        wait_for(lambda: port.exists() and port.read_text().strip(), f"the port of {name}")
        return process, "127.0.0.1:" + port.read_text().strip()

    def ask(self, *words):
        return exemplar(*words, "--server", self.gateway)

    def run(self, *words, stdin=None):
        return run(*words, "--server", self.gateway, stdin=stdin)

    def record(self, name, *words):
        """A recording of whatever is there, its own statuses at the least."""
        self.ask("record", "start", "--name", name, *words)
        wait_for(lambda: self.ask("record", "status")["messages"] > 0, "a message")
        self.ask("record", "stop")

    def log(self):
        return self.programs.logs()


class OperatorsDataTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-operators-data-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.files = trials.write_set(self.folder / "files", BUTTONS)
        # The last two are user03's, and the fifth holds a sample that no other file has.
        text = self.files[4].read_text()
        first = text.splitlines()[1].split(",")
        first[3] = OWN_SAMPLE
        self.files[4].write_text("\n".join([text.splitlines()[0], ",".join(first), *text.splitlines()[2:]]) + "\n")

    def teach(self, station):
        """Five trials of three persons, a skill of two versions, another of user03 alone."""
        ids = []
        for number, file in enumerate(self.files):
            words = ["--person", "user03" if number > 2 else f"user0{number}"]
            ids.append(station.ask("trial", "submit", "--skill", "press", *words, file)[0]["id"])
        station.ask("skill", "learn", "press", "--option", "method=paper")
        station.ask("skill", "learn", "press")
        station.ask("trial", "submit", "--skill", "alone", "--person", "user03", self.files[4])
        station.ask("skill", "learn", "alone")
        return ids

    def test_a_persons_data_is_erased_everywhere(self):
        station = Station(self, self.folder / "a")
        ids = self.teach(station)
        station.record("theirs", "--person", "user03")
        station.record("others", "--person", "user01")
        self.assertEqual([t["id"] for t in station.ask("trial", "list", "--skill", "press", "--person", "user03")], ids[3:])
        persons = {p["person"]: p for p in station.ask("person", "list")}
        self.assertEqual((persons["user03"]["trials"], persons["user03"]["recordings"]), (3, 1))
        backup = self.folder / "before.tar"
        station.ask("backup", backup, "--recordings")

        # A trial that is gone already, but stands in the skill's first version.
        self.assertEqual(station.run("trial", "delete", ids[3])[0], 0)
        dry = station.ask("person", "erase", "user03", "--dry-run")
        foreseen = [(item["kind"], item["name"]) for service in dry["services"] for item in service["items"]]
        for expected in [("recording", "theirs.mcap"), ("trial", ids[4]), ("skill version", "press 1"), ("skill version", "alone 1")]:
            self.assertIn(expected, foreseen)
        self.assertEqual(len(station.ask("trial", "list", "--person", "user03")), 2)
        code, _, said = station.run("person", "erase", "user03", stdin=subprocess.DEVNULL)
        self.assertEqual(code, 2, said)
        self.assertIn("--yes", said)

        # While they are being recorded nothing is done.
        station.ask("record", "start", "--name", "now", "--person", "user03")
        code, _, said = station.run("person", "erase", "user03", "--yes")
        self.assertEqual(code, 4, said)
        self.assertIn("stop it first", said)
        self.assertEqual(len(station.ask("trial", "list", "--person", "user03")), 2)
        station.ask("record", "stop")

        report = station.ask("person", "erase", "user03", "--yes")
        done = {(item["kind"], item["name"]): item for service in report["services"] for item in service["items"]}
        self.assertIn(("recording", "theirs.mcap"), done)
        self.assertIn(("recording", "now.mcap"), done)
        self.assertEqual(done[("skill version", "press 3")]["action"], "relearned")
        self.assertIn("3 trials", done[("skill version", "press 3")]["detail"])
        self.assertEqual(done[("skill", "alone")]["action"], "deleted")
        self.assertEqual([v["version"] for v in station.ask("skill", "versions", "press")], [3])
        self.assertEqual(sorted(station.ask("skill", "versions", "press")[0]["trial_ids"]), sorted(ids[:3]))
        station.ask("skill", "query", "press", "--object", QUERY)
        self.assertEqual(station.run("skill", "query", "alone", "--object", QUERY)[0], 3)
        self.assertEqual([p["person"] for p in station.ask("person", "list")], ["user00", "user01", "user02"])

        left = bytes_below(station.folder / "learning") + bytes_below(station.folder / "recorder")
        self.assertIn(b"user01", left)
        for gone in [b"user03", ids[3].encode(), ids[4].encode(), self.files[3].name.encode(), OWN_SAMPLE.encode()]:
            self.assertNotIn(gone, left)
        # The trial's file is stored compressed: neither may the frame be there.
        for frame in self.frames_of(backup, ids[3:]):
            self.assertNotIn(frame, left)
        audit = [line for line in station.log().splitlines() if "audit" in line and "ErasePerson" in line]
        self.assertTrue(audit)
        self.assertFalse([line for line in audit if "user03" in line])

        code, _, said = station.run("person", "erase", "user03", "--yes")
        self.assertEqual(code, 3, said)
        self.assertEqual(station.run("person", "erase", "nobody", "--yes")[0], 3)

        # The old backup brings nobody back: neither here nor elsewhere, where a newer backup knows.
        newer = self.folder / "after.tar"
        station.ask("backup", newer, "--recordings")
        restored = station.ask("restore", backup, "--replace")
        self.check_without_user03(station, restored, ids)
        fresh = Station(self, self.folder / "b")
        restored = fresh.ask("restore", backup, "--erased-in", newer)
        self.check_without_user03(fresh, restored, ids)
        # ... but what they give afterwards is kept.
        fresh.ask("trial", "submit", "--skill", "again", "--person", "user03", self.files[3])
        last = self.folder / "last.tar"
        fresh.ask("backup", last)
        station.ask("restore", last, "--replace", "--only", "learning")
        self.assertEqual([t["skill"] for t in station.ask("trial", "list", "--person", "user03")], ["again"])

    def frames_of(self, backup, ids):
        with tarfile.open(backup) as archive:
            for trial in ids:
                frame = archive.extractfile(f"learning/trials/{trial}.zst").read()
                yield frame[64:128]

    def check_without_user03(self, station, restored, ids):
        left_out = [item["name"] for service in restored["services"] for item in service["items"] if item["action"] == "left out"]
        self.assertIn(ids[4], left_out)
        self.assertIn("theirs.mcap", left_out)
        self.assertNotIn("user03", [p["person"] for p in station.ask("person", "list")])
        self.assertEqual([t["id"] for t in station.ask("trial", "list", "--skill", "press")], ids[:3])
        versions = station.ask("skill", "versions", "press")
        self.assertEqual([sorted(v["trial_ids"]) for v in versions], [sorted(ids[:3])])
        self.assertEqual(station.run("skill", "show", "alone")[0], 3)

    def test_a_backup_taken_while_services_work_is_restored_byte_for_byte(self):
        station = Station(self, self.folder / "a")
        ids = self.teach(station)
        station.record("done", "--person", "user01")
        station.ask("record", "start", "--name", "running")
        # More trials come, and a skill is learned, while the copy is taken.
        stop = threading.Event()
        extra = trials.write_set(self.folder / "extra", [(0.5 + 0.001 * i, 0.01 * i, 0.05) for i in range(12)])

        def submit():
            for file in extra:
                if not stop.is_set():
                    run("trial", "submit", "--skill", "more", file, "--server", station.learning)

        worker = threading.Thread(target=submit)
        worker.start()
        learner = threading.Thread(target=lambda: run("skill", "learn", "press", "--server", station.learning))
        learner.start()
        file = self.folder / "backup.tar"
        said = station.ask("backup", file, "--recordings")
        worker.join()
        learner.join()
        station.ask("record", "stop")
        notices = [notice for service in said["services"] for notice in service["notices"]]
        self.assertTrue([notice for notice in notices if "running.mcap" in notice], notices)
        self.assertEqual(file.stat().st_mode & 0o777, 0o600)
        self.check_manifest(file)
        exemplar("backup", "verify", file)

        other = Station(self, self.folder / "b")
        other.ask("restore", file)
        for trial in ids:
            a, b = (run("trial", "export", trial, "--server", s.gateway)[1] for s in (station, other))
            self.assertEqual(a, b)
        self.assertEqual(self.rows(station, ids), self.rows(other, ids))
        self.assertEqual([p["person"] for p in other.ask("person", "list") if p["person"]], ["user00", "user01", "user02", "user03"])
        for skill in ("press", "alone"):
            version = ["--version", "1"]
            a, b = (s.ask("skill", "query", skill, *version, "--object", QUERY) for s in (station, other))
            self.assertEqual(a, b)
            a, b = (s.ask("skill", "show", skill, *version) for s in (station, other))
            self.assertEqual(a, b)
        name = "recorder/done.mcap"
        self.assertEqual((station.folder / name).read_bytes(), (other.folder / name).read_bytes())

        # Not empty any more.
        code, _, said = other.run("restore", file)
        self.assertEqual(code, 4, said)
        before = other.ask("trial", "list")
        merged = other.ask("restore", file, "--merge")
        self.assertEqual({item["action"] for service in merged["services"] for item in service["items"]}, {"kept"})
        self.assertEqual(other.ask("trial", "list"), before)
        # Version numbers go on.
        last = max(v["version"] for v in other.ask("skill", "versions", "alone"))
        other.ask("skill", "learn", "alone")
        self.assertEqual(other.ask("skill", "versions", "alone")[-1]["version"], last + 1)

    def rows(self, station, ids):
        connection = sqlite3.connect(f"file:{station.folder}/learning/learning.db?mode=ro", uri=True)
        try:
            marks = ",".join("?" * len(ids))
            return connection.execute(f"SELECT id, skill, source, submitted_ns, info, file FROM trials WHERE id IN ({marks}) ORDER BY id", ids).fetchall()
        finally:
            connection.close()

    def check_manifest(self, file):
        with tarfile.open(file) as archive:
            names = archive.getnames()
            self.assertEqual(names[-1], "manifest.json")
            manifest = json.load(archive.extractfile("manifest.json"))
            self.assertEqual([part["name"] for part in manifest["parts"]], names[:-1])
            for part in manifest["parts"]:
                data = archive.extractfile(part["name"]).read()
                self.assertEqual((len(data), hashlib.sha256(data).hexdigest()), (part["bytes"], part["sha256"]))

    def test_a_damaged_or_cut_backup_is_refused_with_its_place(self):
        station = Station(self, self.folder / "a")
        station.ask("trial", "submit", "--skill", "press", *self.files)
        file = self.folder / "backup.tar"
        station.ask("backup", file)
        whole = file.read_bytes()
        with tarfile.open(file) as archive:
            part = archive.getmember(next(name for name in archive.getnames() if "/trials/" in name))
        broken = self.folder / "broken.tar"
        for data, words in [
            (whole[: part.offset_data + 100], f"byte {part.offset_data + 100}: the file ends here, within {part.name}"),
            (whole[:-1024], "its end mark is missing"),
            (whole[: part.offset_data + 9] + b"\xff" + whole[part.offset_data + 10 :], f"{part.name} is damaged, within bytes {part.offset_data} to"),
            (whole[: part.offset] + b"\xff" + whole[part.offset + 1 :], f"byte {part.offset}: the header here is damaged"),
            (b"no archive at all" * 100, "this is no tar archive"),
            (b"", "byte 0"),
        ]:
            broken.write_bytes(data)
            for words_of in (["backup", "verify", broken], ["restore", broken, "--replace", "--server", station.gateway]):
                code, _, said = run(*words_of)
                self.assertNotEqual(code, 0)
                self.assertIn(words, said)
        self.assertEqual(len(station.ask("trial", "list")), 5)
        # A tar file of somebody else.
        with tarfile.open(broken, "w") as archive:
            archive.addfile(tarfile.TarInfo("a.txt"), io.BytesIO())
        self.assertIn("no manifest.json", run("backup", "verify", broken)[2])
        # Never over what is there, and nothing stays where it cannot be written.
        self.assertEqual(station.run("backup", file)[0], 4)
        self.assertEqual(file.read_bytes(), whole)
        self.assertEqual(station.run("backup", self.folder / "none" / "backup.tar")[0], 3)
        full = self.folder / "full"
        full.mkdir()
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=8k", "none", full], check=False).returncode == 0
        if mounted:
            self.addCleanup(subprocess.run, ["umount", full], check=False)
            code, _, said = station.run("backup", full / "backup.tar")
            self.assertNotEqual(code, 0)
            self.assertIn("No space left", said)
            self.assertEqual(os.listdir(full), [])
        # A service that goes while it is copied from.
        station.learning_process.kill()
        gone = self.folder / "gone.tar"
        self.assertEqual(station.run("backup", gone)[0], 5)
        self.assertFalse([name for name in os.listdir(self.folder) if name.startswith("gone")])

    def test_an_erasure_that_breaks_off_is_finished_by_the_next(self):
        station = Station(self, self.folder / "a")
        self.teach(station)
        station.record("theirs", "--person", "user03")
        # A service that does not answer: nothing is begun.
        station.learning_process.send_signal(signal.SIGSTOP)
        code, _, said = station.run("person", "erase", "user03", "--yes", "--timeout", "2")
        self.assertNotEqual(code, 0)
        self.assertIn("nothing was erased", said)
        self.assertTrue((station.folder / "recorder" / "theirs.mcap").exists())
        station.learning_process.send_signal(signal.SIGCONT)
        # A kill between the trials and what was learned from them.
        command = [processes.BINARIES / "exemplar", "person", "erase", "user03", "--yes", "--server", station.gateway]
        erasing = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        database = f"file:{station.folder}/learning/learning.db?mode=ro"

        def begun():
            connection = sqlite3.connect(database, uri=True)
            try:
                return connection.execute("SELECT count(*) FROM erased_persons").fetchone()[0] > 0
            except sqlite3.OperationalError:
                return False
            finally:
                connection.close()

        wait_for(begun, "the erasure's beginning")
        station.learning_process.kill()
        out, said = erasing.communicate(timeout=60)
        if erasing.returncode != 0:
            self.assertIn("run it again", said)
            self.assertIn("theirs.mcap", out)
        station.learning_process.wait()
        port = station.learning.rsplit(":", 1)[1]
        words = ["exemplar-learning", "--listen", f"127.0.0.1:{port}", "--data-dir", station.folder / "learning"]
        station.learning_process = station.programs.start(*words, bus=False)
        wait_for(lambda: station.run("trial", "list")[0] == 0, "the service again")
        code, _, said = station.run("person", "erase", "user03", "--yes")
        self.assertIn(code, (0, 3), said)
        left = bytes_below(station.folder / "learning") + bytes_below(station.folder / "recorder")
        for gone in [b"user03", OWN_SAMPLE.encode(), self.files[4].name.encode()]:
            self.assertNotIn(gone, left)
        self.assertEqual(len(station.ask("skill", "versions", "press")), 1)

    def test_what_is_old_goes_but_not_what_a_skill_needs(self):
        station = Station(self, self.folder / "a")
        ids = self.teach(station)
        spare = station.ask("trial", "submit", "--skill", "spare", self.files[0])[0]["id"]
        station.record("old")
        nothing = station.ask("retention", "show")
        self.assertEqual([service["items"] for service in nothing["services"]], [[], []])
        day = 1e-6  # a tenth of a second ago is long ago
        wait_for(lambda: len(self.old(station, day)) > 0, "the first to be old")
        wait_for(lambda: "old.mcap" in self.old(station, day), "the recording to be old")
        self.assertIn(spare, self.old(station, day))
        self.assertFalse(set(ids) & set(self.old(station, day)))
        self.assertTrue(set(ids) <= set(self.old(station, day, "--expire-needed-trials")))
        self.assertTrue((station.folder / "recorder" / "old.mcap").exists())
        station.ask("retention", "apply", "--keep-days", day, "--keep-versions-days", day)
        self.assertEqual([v["version"] for v in station.ask("skill", "versions", "press")], [2])
        self.assertNotIn(spare, [t["id"] for t in station.ask("trial", "list")])
        self.assertEqual(len(station.ask("trial", "list", "--skill", "press")), 5)
        self.assertFalse((station.folder / "recorder" / "old.mcap").exists())
        lines = [line for line in station.log().splitlines() if "audit" in line and "retention" in line]
        self.assertTrue(re.search(rf"trial {spare}", "\n".join(lines)))
        self.assertTrue(re.search("recording old.mcap", "\n".join(lines)))
        # By itself, where it is set.
        station.learning_process.send_signal(signal.SIGTERM)
        station.learning_process.wait(20)
        strict = station.start("learning", "--keep-trials-days", str(day), "--expire-needed-trials")[1]
        wait_for(lambda: exemplar("trial", "list", "--server", strict) == [], "the trials to go")
        exemplar("skill", "query", "press", "--object", QUERY, "--server", strict)

    def old(self, station, days, *words):
        report = station.ask("retention", "show", "--keep-days", days, *words)
        return [item["name"] for service in report["services"] for item in service["items"]]


if __name__ == "__main__":
    unittest.main()

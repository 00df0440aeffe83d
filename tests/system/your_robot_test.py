"""docs/your_robot.md, command by command: what a newcomer types works as it stands.

Runs in a network namespace of its own (made by run_isolated).
"""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from processes import BINARIES, ROOT

PAGE = ROOT / "docs" / "your_robot.md"


def commands():
    """All that the page has one type, in order."""
    return re.findall(r"^```sh\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


class TutorialTest(unittest.TestCase):
    def test_every_command_runs_and_the_button_is_met(self):
        home = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-tutorial-"))
        self.addCleanup(shutil.rmtree, home)
        blocks = commands()
        self.assertGreater(len(blocks), 8)
        # A shell of a person: jobs are numbered, and what fails is seen.
        script = "set -em\ntrap 'kill $(jobs -p) 2>/dev/null || true' EXIT\n" + "\n".join(blocks)
        environment = {k: v for k, v in os.environ.items() if not k.startswith("EXEMPLAR_")} | {"HOME": str(home), "PATH": f"{BINARIES}:{os.environ['PATH']}"}
        done = subprocess.run(["bash", "-c", script], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=150, check=False)
        logs = "\n".join(f"{log.name}: {log.read_text()}" for log in sorted((home / "my_station").glob("*.log")))
        self.assertEqual(done.returncode, 0, f"{done.stdout}\n{done.stderr}\n{logs}")
        self.assertIn("no problem found", done.stdout)
        self.assertIn('demonstrate next with "target" at', done.stdout)
        contact = re.search(r"contact error +([\d.]+) mm", done.stdout)
        self.assertTrue(contact, done.stdout)
        self.assertLess(float(contact[1]), 5)
        for topic in ("ircp/joint_state", "ircp/joint_command"):
            self.assertRegex(done.stdout, rf"(?m)^{topic} +\d+")


if __name__ == "__main__":
    unittest.main()

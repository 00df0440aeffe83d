"""What real shells make of `exemplar completion`: bash, zsh and fish.

A shell that is not installed is skipped (deploy/packages-test.txt has them).
"""

import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import cli_test

BINARIES = cli_test.BINARIES
ENVIRONMENT = {k: v for k, v in os.environ.items() if k != "EXEMPLAR_SERVER"} | {"PATH": f"{BINARIES}:{os.environ['PATH']}"}

# The line is given as bash gives it: words are split at blanks and colons.
BASH = r"""
source <(exemplar completion bash)
COMP_LINE=$1 COMP_POINT=${#1}
split=${COMP_LINE//:/ : }
read -ra COMP_WORDS <<<"$split"
[[ $COMP_LINE == *[[:space:]:] ]] && COMP_WORDS+=('')
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
_exemplar
printf '%s\n' "${COMPREPLY[@]}"
"""

# Choices are listed, not put into the line.
ZSH = r"""
PS1= ; autoload -Uz compinit; compinit -u -d $FOLDER/dump; source <(exemplar completion zsh)
zstyle ':completion:*' menu no; LISTMAX=1000; bindkey '^I' list-choices; print RE''ADY
"""


def shell(*command, server=None):
    environment = ENVIRONMENT | ({"EXEMPLAR_SERVER": server} if server else {})
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=120, env=environment, check=False)
    return done.stdout + done.stderr


def bash(line, server=None):
    return shell("bash", "--norc", "-c", BASH, "bash", line, server=server).split("\n")


def zsh(line, said, folder, server=None):
    """What zsh shows on a terminal when the tabulator is pressed behind `line`, again and again, up to the expression `said`."""
    environment = ENVIRONMENT | {"TERM": "xterm", "COLUMNS": "200", "LINES": "100", "FOLDER": str(folder)} | ({"EXEMPLAR_SERVER": server} if server else {})
    process, terminal = pty.fork()
    if process == 0:
        os.execvpe("zsh", ["zsh", "-f", "-i"], environment)
    shown = ""

    def wait_for(expression, press=b""):
        nonlocal shown
        deadline = time.monotonic() + 90
        while not re.search(expression, shown):
            if time.monotonic() > deadline:
                raise AssertionError(f"{expression} is not in {shown!r}")
            if select.select([terminal], [], [], 3)[0]:
                shown += os.read(terminal, 65536).decode(errors="replace")
            else:
                os.write(terminal, press)

    try:
        os.write(terminal, ZSH.encode())
        wait_for("READY")
        shown = ""
        os.write(terminal, f"{line}\t".encode())
        wait_for(said, press=b"\t")
    finally:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        os.close(terminal)


def told(by, wanted):
    """What `by` returns, once all that is `wanted` is among it: the server's answer is not waited for long, but another time it is quicker."""
    deadline = time.monotonic() + 60
    while not set(wanted) <= set(answer := by()) and time.monotonic() < deadline:
        pass
    return answer


class CompletionTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-completion-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.learning = cli_test.Learning(cls.folder)
        cls.addClassCleanup(cls.learning.end)
        files = []
        for i, place in enumerate(cli_test.PLACES[:3]):
            files.append(cls.folder / f"t{i}.csv")
            cli_test.write_trial(files[-1], i, place)
        server = cls.learning.address
        ids = cli_test.run("trial", "submit", "--skill", "pressing", *files, server=server)
        cls.ids = ids.stdout.split()
        assert cli_test.run("skill", "learn", "pressing", server=server).returncode == 0

    def test_bash_completes_commands_options_and_values(self):
        self.assertIn("skill", bash("exemplar sk"))
        self.assertEqual(set(cli_test.COMMANDS["skill"]) - set(bash("exemplar skill ")), set())
        self.assertIn("query", bash("exemplar --server 127.0.0.1:50051 skill qu"))
        self.assertIn("--object", bash("exemplar skill query press --ob"))
        self.assertIn("--server", bash("exemplar skill list --se"))
        self.assertEqual({"csv", "json", "text"} - set(bash("exemplar skill query press --format ")), set())
        self.assertEqual(bash("exemplar completion z")[0], "zsh")
        self.assertNotIn("list", bash("exemplar skill list "))

    def test_bash_completes_names_that_the_server_tells(self):
        server = self.learning.address
        for line, wanted in (("skill show pr", ["pressing"]), ("trial show ", self.ids)):
            self.assertLessEqual(set(wanted), set(told(lambda line=line: bash(f"exemplar {line}", server), wanted)))
        self.assertIn("pressing", told(lambda: bash(f"exemplar --server {server} skill learn "), ["pressing"]))
        # No answer is no error, and nothing is waited for.
        self.assertEqual(bash("exemplar skill show pr", "127.0.0.1:1"), ["", ""])
        self.assertIn("ircp/joint_state", bash("exemplar watch ircp/joint_s", "127.0.0.1:1"))

    def test_bash_completes_files(self):
        self.assertIn(str(self.folder / "t0.csv"), bash(f"exemplar trial submit --skill a {self.folder}/t0"))

    def test_every_shell_takes_its_script(self):
        for name in ("bash", "zsh", "fish"):
            with self.subTest(shell=name):
                if not shutil.which(name):
                    self.skipTest(f"{name} is not installed")
                script = self.folder / f"script.{name}"
                script.write_text(cli_test.run("completion", name).stdout)
                self.assertEqual(shell(name, "-n", script), "")

    @unittest.skipUnless(shutil.which("fish"), "fish is not installed")
    def test_fish_completes_with_descriptions(self):
        def fish(line, server=None):
            return shell("fish", "--no-config", "-c", f"exemplar completion fish | source; complete -C '{line}'", server=server).split("\n")

        self.assertIn("skill\tSkills: learned from trials, asked for motions", fish("exemplar sk"))
        self.assertIn("suggest", [line.split("\t")[0] for line in fish("exemplar skill su")])
        described = "pressing\tversion 1, 3 trials"
        self.assertIn(described, told(lambda: fish("exemplar skill show pr", self.learning.address), [described]))
        self.assertTrue([line for line in fish(f"exemplar trial segments {self.folder}/t1") if "t1.csv" in line])

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
    def test_zsh_completes_with_descriptions(self):
        zsh("exemplar s", r"skill.* -- Skills: learned from trials", self.folder)
        zsh("exemplar skill show pr", r"pressing.* -- version 1, 3 trials", self.folder, self.learning.address)

    def test_words_that_are_no_use_are_no_error(self):
        for words in ([], [""], ["--nothing", "x"], ["skill", "show", "a", "b", "c"], ["\t\n"], ["--server"]):
            done = cli_test.run("__complete", *words)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertTrue(done.stdout.startswith(":"), done.stdout)


if __name__ == "__main__":
    unittest.main()

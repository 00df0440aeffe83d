"""The C++ client library as a user meets it: installed into a folder of its own, found by CMake and by pkg-config, used by the
examples against real services, one of which wants TLS and a token.

Runs in a network namespace of its own (made by run_isolated).
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import cli_test

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests" / "system"))
import processes  # noqa: E402
import trials  # noqa: E402

BUTTONS = [(0.55, -0.20, 0.06), (0.62, -0.05, 0.06), (0.48, -0.28, 0.06), (0.66, -0.22, 0.06)]
BUILD = cli_test.BINARIES.parent
EXAMPLES = ROOT / "clients" / "cpp" / "examples"
ROBOT = ROOT / "deploy" / "models" / "arm7"
SCENE = ROOT / "deploy" / "config" / "rail_press.yaml"


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=500, check=False, **options)
    assert done.returncode == 0, f"{words}: {done.stdout[-2000:]}{done.stderr[-4000:]}"
    return done.stdout


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-package-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.prefix = cls.folder / "opt"
        run("cmake", "--install", BUILD, "--component", "development", "--prefix", cls.prefix)
        # Away from the sources, so that nothing of them is found by chance.
        sources = shutil.copytree(EXAMPLES, cls.folder / "examples")
        cls.built = cls.folder / "build"
        run("cmake", "-S", sources, "-B", cls.built, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug", f"-DCMAKE_PREFIX_PATH={cls.prefix}")
        run("cmake", "--build", cls.built)
        cls.files = []
        for i, place in enumerate(cli_test.PLACES[:4]):
            cls.files.append(cls.folder / f"trial-{i}.csv")
            cli_test.write_trial(cls.files[-1], i, place)
        (cls.folder / "plain").mkdir()
        cls.learning = cli_test.Learning(cls.folder / "plain")
        cls.addClassCleanup(cls.learning.end)
        cls.told = run(cls.built / "learn_and_query", cls.learning.address, "press", "button", 0.55, -0.1, 0.05, *cls.files)

    def example(self, name, *words, env=None):
        command = [str(word) for word in (self.built / name, *words)]
        return subprocess.run(command, capture_output=True, text=True, timeout=200, check=False, env=os.environ | (env or {}))

    def test_it_learns_and_queries(self):
        learning, files, told = self.learning, self.files, self.told
        self.assertRegex(told, r"^version 1 by \w+ of 4 trials\n")
        meets = re.search(r"\d+ frames, [\d.]+ s, meets button at (\S+) +(\S+) +(\S+) m", told)
        self.assertTrue(meets, told)
        for value, expected in zip(meets.groups(), (0.55, -0.1, 0.05), strict=True):
            self.assertAlmostEqual(float(value), expected, delta=0.03)
        # Errors come as values, with the field.
        wrong = self.example("learn_and_query", learning.address, "press", "lever", "1", "2", "3", *files)
        self.assertEqual(wrong.returncode, 1)
        self.assertRegex(wrong.stderr, r'(?m)^not_found: .*"lever".* \(query\.objects\[0\]\.name\)$')
        nobody = self.example("learn_and_query", "127.0.0.1:1", "press", "button", "1", "2", "3", *files)
        self.assertIn("unavailable: ", nobody.stderr)

    def test_it_asks_again_and_again_over_one_stream(self):
        done = self.example("ask_again", self.learning.address, "press", "button", 0.55, -0.1, 0.05, 20)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stdout.count("frames"), 20)
        self.assertIn("elephant", done.stdout.splitlines()[-1])

    def test_it_executes_with_feedback(self):
        programs = processes.Programs(self.folder, 96)
        self.addCleanup(programs.end)
        port = self.folder / "executor.port"
        # The simulated time waits for the executor: how busy the machine is does not matter.
        programs.start("exemplar-simulator", "--robot", ROBOT, "--scene", SCENE, "--cameras", "off", "--in-step-with", "executor")
        programs.start(
            "exemplar-executor", "--robot", ROBOT, "--scene", SCENE, "--learning", self.learning.address, "--clock", "network",
            "--listen", "127.0.0.1:0", "--port-file", port)  # fmt: skip
        processes.wait_for(lambda: port.exists() and port.read_text().strip(), "the executor's port")
        address = "127.0.0.1:" + port.read_text().strip()
        processes.wait_for(lambda: processes.exemplar("robot", "status", "--server", address)["joints"], "the robot's joints")
        # Of the button that stands in the robot's scene.
        files = trials.write_set(self.folder / "robot", BUTTONS)
        processes.exemplar("trial", "submit", "--skill", "tap", *files, "--server", self.learning.address)
        processes.exemplar("skill", "learn", "tap", "--server", self.learning.address)
        done = self.example("execute", address, "tap", "target", 0.55, -0.15, 0.05)
        self.assertEqual(done.returncode, 0, f"{done.stdout}{done.stderr}{programs.logs()}")
        self.assertRegex(done.stdout, r"(?m)^executing [\d.]+ of [\d.]+ s, touch ")
        self.assertIn("contact met to", done.stdout)
        far = self.example("execute", address, "tap", "target", 3, 0, 0.05)
        self.assertEqual(far.returncode, 1)
        self.assertIn("failed_precondition: ", far.stderr)

    def test_it_shows_its_certificate_or_its_token_over_tls(self):
        folder = self.folder / "secured"
        folder.mkdir()
        station = folder / "station"
        security = lambda command, *words: run(cli_test.BINARIES / "exemplar", "security", command, station, *words)
        security("init", "--station", "test")
        security("issue", "learning", "--role", "learning")
        security("issue", "anna", "--role", "person", "--call", "teach")
        token = security("token", "ben", "--role", "observe").strip()
        server, anna = station / "members" / "learning", station / "members" / "anna"
        tls = ["--tls-cert", server / "cert.pem", "--tls-key", server / "key.pem", "--access", station / "access.yaml"]
        learning = cli_test.Learning(folder, *tls)
        self.addCleanup(learning.end)
        mutual = cli_test.Learning(folder, *tls, "--tls-client-ca", anna / "ca.pem", data="data-of-certificates")
        self.addCleanup(mutual.end)
        learn = lambda address, **env: self.example("learn_and_query", address, "press", "button", 0.55, -0.1, 0.05, *self.files, env=env)
        ca = {"EXEMPLAR_TLS_CA": str(anna / "ca.pem")}
        refused = learn(learning.address, **ca, EXEMPLAR_TOKEN=token)
        self.assertEqual(refused.returncode, 1)
        self.assertRegex(refused.stderr, r"^permission_denied: ben may not .* takes the role teach.* \(role\)\n$")
        self.assertRegex(learn(learning.address, **ca).stderr, r"^unauthenticated: .* \(token\)\n$")
        self.assertIn("unavailable: ", learn(learning.address).stderr)
        shown = {"EXEMPLAR_TLS_CERT": str(anna / "cert.pem"), "EXEMPLAR_TLS_KEY": str(anna / "key.pem")}
        taught = learn(mutual.address, **ca, **shown)
        self.assertEqual(taught.returncode, 0, taught.stderr)
        self.assertIn("unavailable: ", learn(mutual.address, **ca).stderr)

    def test_no_header_of_the_package_needs_grpc_protobuf_or_dds(self):
        headers = sorted((self.prefix / "include").rglob("*.hpp"))
        self.assertGreater(len(headers), 20)
        for header in headers:
            text = header.read_text(encoding="utf-8")
            self.assertNotRegex(text, r"#include [<\"](grpc|google/protobuf|fast|exemplar/v1)", header)
            # Whatever it includes of ours is installed as well.
            for name in re.findall(r'#include "(exemplar/[^"]+)"', text):
                self.assertTrue((self.prefix / "include" / name).is_file(), f"{header} includes {name}")

    def test_versions_are_told_and_kept_apart(self):
        asked = self.folder / "versions"
        asked.mkdir()
        (asked / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(asked NONE)\nenable_language(CXX)\n"
            "find_package(exemplar 0.1 REQUIRED)\nmessage(STATUS \"found ${exemplar_VERSION}\")\n"
            "find_package(exemplar 99.0 QUIET)\nif(exemplar_FOUND)\n  message(FATAL_ERROR \"took 99.0\")\nendif()\n"
        )
        told = run("cmake", "-S", asked, "-B", asked / "build", "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        version = cli_test.run("--version").stdout.split()[1]
        self.assertIn(f"found {version}", told)

    @unittest.skipUnless(shutil.which("pkg-config"), "pkg-config is not installed")
    def test_pkg_config_finds_it(self):
        folder = next(self.prefix.rglob("pkgconfig"))
        told = run("pkg-config", "--cflags", "--libs", f"--define-variable=prefix={self.prefix}", "exemplar-client", env=os.environ | {"PKG_CONFIG_PATH": str(folder)})
        self.assertIn(f"-I{self.prefix}/include", told)
        self.assertIn("-lexemplar_client", told)


if __name__ == "__main__":
    unittest.main()

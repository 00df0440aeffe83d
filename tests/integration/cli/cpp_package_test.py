"""The C++ client library as a user meets it: installed into a folder of its own, found by CMake and by pkg-config, used by the
example against a real learning service.
"""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import cli_test

BUILD = cli_test.BINARIES.parent
EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "clients" / "cpp" / "examples"


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=180, check=False, **options)
    assert done.returncode == 0, f"{words}: {done.stdout[-2000:]}{done.stderr[-4000:]}"
    return done.stdout


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-package-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.prefix = cls.folder / "opt"
        run("cmake", "--install", BUILD, "--component", "development", "--prefix", cls.prefix)

    def test_the_example_is_built_against_the_package_and_runs(self):
        # Away from the sources, so that nothing of them is found by chance.
        sources = shutil.copytree(EXAMPLES, self.folder / "example")
        build = self.folder / "build"
        run("cmake", "-S", sources, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        run("cmake", "--build", build)
        learning = cli_test.Learning(self.folder)
        self.addCleanup(learning.end)
        files = []
        for i, place in enumerate(cli_test.PLACES[:4]):
            files.append(self.folder / f"trial-{i}.csv")
            cli_test.write_trial(files[-1], i, place)
        told = run(build / "learn_and_query", learning.address, "press", "button", 0.55, -0.1, 0.05, *files)
        self.assertRegex(told, r"^version 1 by \w+ of 4 trials\n")
        meets = re.search(r"\d+ frames, [\d.]+ s, meets button at (\S+) +(\S+) +(\S+) m", told)
        self.assertTrue(meets, told)
        for value, expected in zip(meets.groups(), (0.55, -0.1, 0.05), strict=True):
            self.assertAlmostEqual(float(value), expected, delta=0.03)
        # Errors come as values, with the field.
        wrong = subprocess.run([build / "learn_and_query", learning.address, "press", "lever", "1", "2", "3", *files], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(wrong.returncode, 1)
        self.assertIn("lever", wrong.stderr)
        nobody = subprocess.run([build / "learn_and_query", "127.0.0.1:1", "press", "button", "1", "2", "3", *files], capture_output=True, text=True, timeout=60, check=False)
        self.assertIn("unavailable: ", nobody.stderr)

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

"""Cases made by the format's own library: written to the same bytes, and read the same in both ways."""

import json
import os
import pathlib
import random
import shutil
import subprocess
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent
PROGRAM = pathlib.Path(os.environ.get("EXEMPLAR_BIN", HERE.parents[1] / "build" / "release" / "bin")) / "mcap_conformance"
SHORT_FORM = 120  # of some 500 cases, chosen by a fixed seed; all of them with EXEMPLAR_ALL_CASES


def records(text):
    return [(record["type"], dict(record["fields"])) for record in json.loads(text)["records"]]


class CasesTest(unittest.TestCase):
    def test_cases_are_written_and_read_as_the_formats_own_library_does(self):
        if not shutil.which("node") or not (HERE / "node" / "node_modules").exists():
            self.skipTest("node or its packages are not installed (npm ci --prefix tests/conformance/node)")
        folder = pathlib.Path(tempfile.mkdtemp(prefix="exemplar-cases-"))
        self.addCleanup(shutil.rmtree, folder)
        subprocess.run(["node", HERE / "node" / "make_cases.mjs", folder], check=True)
        cases = sorted(folder.glob("*.json"))
        self.assertGreater(len(cases), 500)
        if not os.environ.get("EXEMPLAR_ALL_CASES"):
            cases = random.Random(5).sample(cases, SHORT_FORM)
        for case in cases:
            expected, file = records(case.read_text(encoding="utf-8")), case.with_suffix(".mcap")
            with self.subTest(case=case.stem):
                if "pad" not in case.stem.split("-"):
                    written = subprocess.run([PROGRAM, "write", case], check=True, stdout=subprocess.PIPE).stdout
                    self.assertEqual(written, file.read_bytes())
                for mode in ("read", "read-indexed"):
                    read = subprocess.run([PROGRAM, mode, file], check=True, stdout=subprocess.PIPE).stdout
                    self.assertEqual(records(read), expected, mode)


if __name__ == "__main__":
    unittest.main()

"""The layering rules find what they are there to find."""

import pathlib
import tempfile
import unittest

import layering


class LayeringTest(unittest.TestCase):
    def violations(self, path, *includes):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / path
            file.parent.mkdir(parents=True)
            file.write_text("".join(f"#include {include}\n" for include in includes), encoding="utf-8")
            return layering.check(folder)

    def test_outside_libraries_stay_in_their_rooms(self):
        for path, include in [
            ("services/lib/ircp/src/bus.cpp", "<fastdds/dds/domain/DomainParticipant.hpp>"),
            ("services/recorder/recorder.cpp", "<grpcpp/grpcpp.h>"),
            ("clients/cli/main.cpp", '"exemplar/v1/skill.pb.h"'),
            ("services/lib/motion/src/plan.cpp", "<fcl/fcl.h>"),
            ("services/simulator/world.cpp", "<opencv2/core.hpp>"),
            ("services/executor/executor.cpp", "<mujoco/mujoco.h>"),
        ]:
            self.assertEqual(len(self.violations(path, include)), 1, f"{include} in {path}")

    def test_libraries_depend_in_one_direction(self):
        self.assertTrue(self.violations("services/lib/learning/src/a.cpp", '"exemplar/kinematics/chain.hpp"'))
        self.assertTrue(self.violations("services/lib/base/src/a.cpp", '"exemplar/geometry/pose.hpp"'))
        self.assertFalse(self.violations("services/lib/motion/src/a.cpp", '"exemplar/collision/scene.hpp"'))

    def test_behaviour_knows_neither_transport_nor_other_programs(self):
        self.assertTrue(self.violations("services/executor/executor.cpp", '"exemplar/bus/participant.hpp"'))
        self.assertFalse(self.violations("services/executor/main.cpp", '"exemplar/bus/participant.hpp"'))
        self.assertTrue(self.violations("services/executor/executor.cpp", '"recorder/recorder.hpp"'))
        self.assertTrue(self.violations("services/lib/motion/src/a.cpp", '"executor/executor.hpp"'))

    def test_a_line_is_named(self):
        found = self.violations("services/lib/motion/src/plan.cpp", "<vector>", "<fcl/fcl.h>")
        self.assertTrue(found[0].startswith("services/lib/motion/src/plan.cpp:2: "), found)


if __name__ == "__main__":
    unittest.main()

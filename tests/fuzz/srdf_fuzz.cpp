// Any bytes go through the SRDF reader. What it takes is pairs of the robot's links, sorted, once.

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "exemplar/kinematics/srdf.hpp"

namespace {

constexpr const char* kArm = R"(<robot name="a"><link name="b"/><link name="c"/><link name="d"/>
  <joint name="e" type="fixed"><parent link="b"/><child link="c"/></joint>
  <joint name="f" type="fixed"><parent link="c"/><child link="d"/></joint></robot>)";

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace exemplar::kinematics;
  static const RobotModel model = *ParseUrdf(kArm, "arm.urdf");
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const exemplar::Result<LinkPairs> pairs = ParseSrdf(text, "fuzz.srdf", model);
  if (!pairs.ok()) return 0;
  if (!std::is_sorted(pairs->begin(), pairs->end())) std::abort();
  if (std::adjacent_find(pairs->begin(), pairs->end()) != pairs->end()) std::abort();
  for (const auto& [first, second] : *pairs) {
    if (first >= second || model.FindLink(first) < 0 || model.FindLink(second) < 0) std::abort();
  }
  return 0;
}

// Any bytes go through the URDF reader. What it takes is a tree whose links can be placed.

#include <cstdlib>
#include <string_view>

#include "exemplar/kinematics/chain.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace exemplar::kinematics;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const exemplar::Result<RobotModel> model = ParseUrdf(text, "fuzz.urdf");
  if (!model.ok()) return 0;
  if (model->links.size() != model->joints.size() + 1) std::abort();
  for (const Joint& joint : model->joints) {
    if (joint.parent_link >= joint.child_link) std::abort();
  }
  std::vector<exemplar::geometry::Pose> base_T_links;
  LinkPoses(*model, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model->joints.size())),
            base_T_links);
  (void)Chain::Create(*model, "", "");
  return 0;
}

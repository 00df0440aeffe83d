#include "exemplar/kinematics/robot_model.hpp"

#include <algorithm>

namespace exemplar::kinematics {
namespace {

template <class Named>
int FindByName(const std::vector<Named>& things, std::string_view name) {
  const auto found = std::find_if(things.begin(), things.end(),
                                  [&](const Named& thing) { return thing.name == name; });
  return found == things.end() ? -1 : static_cast<int>(found - things.begin());
}

}  // namespace

int RobotModel::FindLink(std::string_view link) const { return FindByName(links, link); }
int RobotModel::FindJoint(std::string_view joint) const { return FindByName(joints, joint); }

}  // namespace exemplar::kinematics

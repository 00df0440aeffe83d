#include "describe.hpp"

#include "exemplar/base/text.hpp"

namespace exemplar::motion {

namespace {

std::string Written(const Eigen::Vector3d& p) {
  return "(" + FormatFixed(p.x(), 3) + ", " + FormatFixed(p.y(), 3) + ", " + FormatFixed(p.z(), 3) +
         ")";
}

}  // namespace

std::string DescribeViolation(const collision::Violation& violation, double required_clearance_m) {
  const collision::Clearance& c = violation.clearance;
  const std::string where =
      " near " + Written(c.base_p_first) + " and " + Written(c.base_p_second) + " m";
  const std::string pair = "\"" + c.first + "\" and \"" + c.second + "\"";
  const std::string when = "at " + FormatFixed(violation.s, 2) + " s ";
  if (c.distance_m < 0) {
    return when + pair + " are " + FormatFixed(-1000 * c.distance_m, 1) + " mm inside each other" +
           where;
  }
  return when + pair + " come within " + FormatFixed(1000 * c.distance_m, 1) + " mm of each other" +
         where + ", less than the " + FormatFixed(1000 * required_clearance_m, 1) + " mm asked for";
}

}  // namespace exemplar::motion

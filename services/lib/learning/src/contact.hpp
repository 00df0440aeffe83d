#pragma once
// Where in the motion the tool meets an object (DESIGN.md, "Words": contact).

#include <Eigen/Core>
#include <vector>

#include "exemplars.hpp"

namespace exemplar::learning {

/// Contacts in time order. From touch where it was measured, else the stretches whose spread in an
/// object's frame is within noise.
std::vector<ContactSpan> FindContacts(const Exemplars& exemplars);

/// How the trials met the object at a contact's first frame.
struct ContactPoint {
  Eigen::Vector3d object_p_contact = Eigen::Vector3d::Zero();  ///< mean over the trials
  double spread_m = 0;  ///< root mean square distance from the mean
  bool turns = false;   ///< the point turns with the object; else it is only shifted
};
ContactPoint MeanContactPoint(const Exemplars& exemplars, const ContactSpan& contact);

}  // namespace exemplar::learning

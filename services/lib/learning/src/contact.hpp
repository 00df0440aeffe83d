#pragma once
// Where in the motion the tool meets an object (DESIGN.md, "Words": contact).

#include <Eigen/Core>
#include <vector>

#include "exemplars.hpp"

namespace exemplar::learning {

/// Sets the contacts, in time order: from touch where it was measured, else where the trials, each
/// on its own time, rest or turn back at a consistent place near an object.
void FindContacts(const Alignment& alignment, Exemplars& exemplars);

/// How the trials met the object at a contact.
struct ContactPoint {
  Eigen::Vector3d object_p_contact = Eigen::Vector3d::Zero();  ///< mean over the trials
  /// What keeps to the world: the way from the point that touches to the tool frame, of tools that
  /// do not turn with the object.
  Eigen::Vector3d base_offset = Eigen::Vector3d::Zero();
  double spread_m = 0;    ///< root mean square distance from the mean
  double left_out_m = 0;  ///< root mean square error of the others' point at each trial left out
  bool turns = false;     ///< the point turns with the object; else it is only shifted

  Eigen::Vector3d At(const geometry::Pose& base_T_object) const {
    return (turns ? base_T_object * object_p_contact
                  : Eigen::Vector3d(base_T_object.translation + object_p_contact)) +
           base_offset;
  }
};
ContactPoint MeanContactPoint(const Exemplars& exemplars, const ContactSpan& contact);

}  // namespace exemplar::learning

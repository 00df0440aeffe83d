#pragma once
// Governance and permissions of DDS-Security 1.1, as Fast DDS 2.9.1 takes them, before they are
// signed.

#include <string>
#include <string_view>
#include <vector>

#include "exemplar/security/certificate.hpp"

namespace exemplar::security {

/// Nobody takes part unauthenticated; discovery, liveliness and whole messages are encrypted; every
/// topic is subject to the permissions, encrypted with keys of its own that only its matched
/// readers get; what commands the robot is encrypted once more in itself, and proves its origin to
/// each reader.
std::string GovernanceXml();

struct Permissions {
  std::string subject;  ///< CertificateFacts::subject
  std::string station;  ///< the partition of the topics
  std::vector<std::string_view> writes;
  std::vector<std::string_view> reads;
  Validity validity;
};

/// All else is denied.
std::string PermissionsXml(const Permissions& permissions);

}  // namespace exemplar::security

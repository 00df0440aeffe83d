#include "exemplar/security/dds_documents.hpp"

#include <sstream>

#include "exemplar/base/xml.hpp"

namespace exemplar::security {
namespace {

constexpr const char* kHead = R"(<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation=)";
// Without a <max>, Fast DDS 2.9 applies no topic rule at all.
constexpr const char* kDomains =
    "<domains><id_range><min>0</min><max>232</max></id_range></domains>";

/// `samples`: of the sample itself, for its matched readers; `messages`: of what carries it.
void WriteTopicRule(std::ostream& out, const char* topic, const char* messages,
                    const char* samples) {
  out << R"(
        <topic_rule>
          <topic_expression>)"
      << topic << R"(</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>)"
      << messages << R"(</metadata_protection_kind>
          <data_protection_kind>)"
      << samples << R"(</data_protection_kind>
        </topic_rule>)";
}

/// "2026-11-22T03:24:33".
std::string XmlTime(Stamp stamp) { return ToIso8601(stamp).substr(0, 19); }

void WriteCriteria(std::ostream& out, const char* kind, const std::vector<std::string_view>& topics,
                   const std::string& station) {
  if (topics.empty()) return;
  out << "        <" << kind << ">\n          <topics>\n";
  for (const std::string_view topic : topics) {
    out << "            <topic>" << EscapeXml(topic) << "</topic>\n";
  }
  out << "          </topics>\n          <partitions><partition>" << EscapeXml(station)
      << "</partition></partitions>\n        </" << kind << ">\n";
}

}  // namespace

// Whole messages carry no proof of origin: with it, a program of Fast DDS 2.9.1 logs authentication
// errors without end, probably of what it sent itself.
std::string GovernanceXml() {
  std::ostringstream out;
  out << kHead << R"("omg_shared_ca_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      )"
      << kDomains << R"(
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>ENCRYPT</rtps_protection_kind>
      <topic_access_rules>)";
  WriteTopicRule(out, "ircp/joint_command", "ENCRYPT_WITH_ORIGIN_AUTHENTICATION", "ENCRYPT");
  WriteTopicRule(out, "*", "ENCRYPT", "NONE");
  out << R"(
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
)";
  return out.str();
}

std::string PermissionsXml(const Permissions& permissions) {
  std::ostringstream out;
  out << kHead << R"("omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="member">
      <subject_name>)"
      << EscapeXml(permissions.subject) << R"(</subject_name>
      <validity>
        <not_before>)"
      << XmlTime(permissions.validity.from) << R"(</not_before>
        <not_after>)"
      << XmlTime(permissions.validity.to) << R"(</not_after>
      </validity>
)";
  if (!permissions.writes.empty() || !permissions.reads.empty()) {
    out << "      <allow_rule>\n        " << kDomains << '\n';
    WriteCriteria(out, "publish", permissions.writes, permissions.station);
    WriteCriteria(out, "subscribe", permissions.reads, permissions.station);
    out << "      </allow_rule>\n";
  }
  out << R"(      <default>DENY</default>
    </grant>
  </permissions>
</dds>
)";
  return out.str();
}

}  // namespace exemplar::security

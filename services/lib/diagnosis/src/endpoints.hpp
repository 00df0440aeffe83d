#pragma once
#include <map>
#include <string>
#include <vector>

#include "exemplar/diagnosis/diagnose.hpp"

namespace exemplar::diagnosis {

/// Looks participants up, and knows which of them are asked about. Holds a reference to the
/// evidence.
class Names {
 public:
  explicit Names(const Evidence& evidence);
  /// Of a participant; "somebody" for one that was not announced.
  const std::string& Of(const std::string& participant) const;
  /// Whether a pair of two participants is asked about.
  bool Asked(const std::string& one, const std::string& other) const;
  /// Whether a single participant is.
  bool Asked(const std::string& participant) const;

 private:
  const Evidence& evidence_;
  std::map<std::string, std::string> names_;
};

/// "a, b and 3 more".
std::string Listed(const std::vector<std::string>& names, std::size_t most = 4);
/// The station that an endpoint's partitions name, for people.
std::string StationOf(const ircp::SeenEndpoint& endpoint);
/// Whether `name` is what somebody calls `asked`: the program's name, with or without "exemplar-".
bool IsCalled(const std::string& name, const std::string& asked);

/// What the endpoints' topics, types, partitions and policies say.
void DiagnoseEndpoints(const Evidence& evidence, const Names& names, Diagnosis& diagnosis);

}  // namespace exemplar::diagnosis

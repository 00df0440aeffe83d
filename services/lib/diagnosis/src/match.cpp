#include <fnmatch.h>

#include <algorithm>
#include <array>

#include "exemplar/base/text.hpp"
#include "exemplar/diagnosis/diagnose.hpp"

namespace exemplar::diagnosis {
namespace {

using ircp::EndpointQos;

std::string Period(Duration period) {
  return period == Duration::zero() ? "none" : FormatDouble(ToSeconds(period)) + " s";
}

/// Of durations where zero stands for "never": whether the writer promises at least as much.
bool AsShort(Duration offered, Duration asked) {
  if (asked == Duration::zero()) return true;
  return offered != Duration::zero() && offered <= asked;
}

template <std::size_t N>
std::string Word(const std::array<const char*, N>& words, int index) {
  return index >= 0 && index < static_cast<int>(N) ? words[static_cast<std::size_t>(index)]
                                                   : std::to_string(index);
}

constexpr std::array kDurability{"volatile", "transient local", "transient", "persistent"};
constexpr std::array kLiveliness{"automatic", "manual by participant", "manual by topic"};
constexpr std::array kScope{"instance", "topic", "group"};
constexpr std::array kRepresentation{"XCDR1", "XML", "XCDR2"};

std::string Representations(const std::vector<int>& ids) {
  std::vector<std::string> words;
  words.reserve(ids.size());
  for (const int id : ids) words.push_back(Word(kRepresentation, id));
  return words.empty() ? "XCDR1" : Join(words, ", ");
}

/// Patterns match names, never each other.
bool OneMeets(const std::string& a, const std::string& b) {
  constexpr const char* kWild = "*?[";
  const bool a_wild = a.find_first_of(kWild) != std::string::npos;
  const bool b_wild = b.find_first_of(kWild) != std::string::npos;
  if (a == b) return !a_wild;
  if (a_wild && !b_wild) return fnmatch(a.c_str(), b.c_str(), 0) == 0;
  if (b_wild && !a_wild) return fnmatch(b.c_str(), a.c_str(), 0) == 0;
  return false;
}

}  // namespace

std::vector<Mismatch> Compare(const EndpointQos& offered, const EndpointQos& asked) {
  std::vector<Mismatch> found;
  const auto differ = [&found](const char* policy, std::string offer, std::string question) {
    found.push_back({policy, std::move(offer), std::move(question)});
  };
  if (asked.reliable && !offered.reliable) differ("reliability", "best effort", "reliable");
  if (offered.durability < asked.durability) {
    differ("durability", Word(kDurability, offered.durability),
           Word(kDurability, asked.durability));
  }
  if (!AsShort(offered.deadline, asked.deadline)) {
    differ("deadline", Period(offered.deadline), Period(asked.deadline));
  }
  if (offered.latency_budget > asked.latency_budget) {
    differ("latency budget", Period(offered.latency_budget), Period(asked.latency_budget));
  }
  if (offered.exclusive_ownership != asked.exclusive_ownership) {
    differ("ownership", offered.exclusive_ownership ? "exclusive" : "shared",
           asked.exclusive_ownership ? "exclusive" : "shared");
  }
  if (offered.liveliness < asked.liveliness) {
    differ("liveliness", Word(kLiveliness, offered.liveliness),
           Word(kLiveliness, asked.liveliness));
  } else if (!AsShort(offered.liveliness_lease, asked.liveliness_lease)) {
    differ("liveliness", "a lease of " + Period(offered.liveliness_lease),
           "a lease of " + Period(asked.liveliness_lease));
  }
  if (asked.ordered_by_source && !offered.ordered_by_source) {
    differ("destination order", "by reception", "by source");
  }
  if (offered.access_scope < asked.access_scope) {
    differ("presentation", "the scope of one " + Word(kScope, offered.access_scope),
           "of one " + Word(kScope, asked.access_scope));
  } else if ((asked.coherent_access && !offered.coherent_access) ||
             (asked.ordered_access && !offered.ordered_access)) {
    differ("presentation", "no such access",
           asked.coherent_access ? "coherent access" : "ordered access");
  }
  // A writer sends in the first of its representations only.
  const int sends = offered.representations.empty() ? 0 : offered.representations.front();
  const std::vector<int> xcdr1{0};
  const std::vector<int>& takes = asked.representations.empty() ? xcdr1 : asked.representations;
  if (std::find(takes.begin(), takes.end(), sends) == takes.end()) {
    differ("data representation", Representations({sends}), Representations(takes));
  }
  return found;
}

bool PartitionsMeet(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  const std::vector<std::string> none{""};
  for (const std::string& one : a.empty() ? none : a) {
    for (const std::string& other : b.empty() ? none : b) {
      if (OneMeets(one, other)) return true;
    }
  }
  return false;
}

}  // namespace exemplar::diagnosis

#include "endpoints.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <tuple>

#include "exemplar/base/text.hpp"

namespace exemplar::diagnosis {
namespace {

using ircp::SeenEndpoint;

std::string WithoutBlanks(const std::string& text) {
  std::string packed;
  for (const char c : text) {
    if (std::isspace(static_cast<unsigned char>(c)) == 0) packed += c;
  }
  return packed;
}

/// Names of a program's own are much alike: one does not stand for another.
bool IsOfAProgram(const std::string& topic) {
  return topic.ends_with("/command") || topic.ends_with("/status");
}

std::string Unmatched(const std::string& from, const Mismatch& mismatch, const std::string& to) {
  return from + " offers " + mismatch.policy + " \"" + mismatch.offered + "\" and " + to +
         " asks for \"" + mismatch.asked + "\": nothing is delivered";
}

std::string ApartInStations(const std::string& from, const SeenEndpoint& writer,
                            const std::string& to, const SeenEndpoint& reader) {
  return from + " writes in " + StationOf(writer) + " and " + to + " reads in " +
         StationOf(reader) + ": stations do not mix";
}

std::string ApartInDomains(const std::string& from, int writes, const std::string& to, int reads) {
  return from + " is in domain " + std::to_string(writes) + " and " + to + " in domain " +
         std::to_string(reads) + ": domains do not hear each other";
}

struct TopicEnds {
  std::vector<const SeenEndpoint*> writers, readers;
};

/// Findings of one cause between the same two participants are told once, with all their topics.
struct Group {
  Finding finding;
  std::vector<std::string> topics;
};

class EndpointJudge {
 public:
  EndpointJudge(const Evidence& evidence, const Names& names) : names_(names) {
    for (const SeenEndpoint& endpoint : evidence.discovery.endpoints) {
      TopicEnds& ends = topics_[endpoint.topic];
      (endpoint.writer ? ends.writers : ends.readers).push_back(&endpoint);
    }
  }

  void Judge(Diagnosis& diagnosis) {
    for (const auto& [topic, ends] : topics_) {
      for (const SeenEndpoint* writer : ends.writers) {
        for (const SeenEndpoint* reader : ends.readers) JudgePair(*writer, *reader);
      }
    }
    for (const auto& [topic, ends] : topics_) {
      for (const SeenEndpoint* reader : ends.readers) {
        if (settled_.count(reader) == 0) ExplainSilence(*reader, ends);
      }
    }
    for (auto& entry : groups_) {
      Group& group = entry.second;
      std::sort(group.topics.begin(), group.topics.end());
      group.topics.erase(std::unique(group.topics.begin(), group.topics.end()), group.topics.end());
      group.finding.topic = group.topics.front();
      group.finding.what += " (" + Listed(group.topics) + ")";
      diagnosis.findings.push_back(std::move(group.finding));
    }
    for (auto& entry : flows_) diagnosis.flows.push_back(std::move(entry.second));
  }

 private:
  using GroupKey = std::tuple<std::string, std::string, std::string, std::string>;

  void Tell(const GroupKey& key, const std::string& topic, Finding finding) {
    groups_.try_emplace(key, Group{.finding = std::move(finding), .topics = {}})
        .first->second.topics.push_back(topic);
  }

  void JudgePair(const SeenEndpoint& writer, const SeenEndpoint& reader) {
    if (writer.participant == reader.participant || writer.domain != reader.domain ||
        !PartitionsMeet(writer.partitions, reader.partitions)) {
      return;
    }
    const std::string& from = names_.Of(writer.participant);
    const std::string& to = names_.Of(reader.participant);
    const bool asked = names_.Asked(writer.participant, reader.participant);
    Finding finding{.severity = Severity::kProblem,
                    .cause = "type",
                    .what = {},
                    .remedy = "Let both programs come of one build, or of one file of IDL.",
                    .participants = {from, to}};
    std::string detail;
    if (writer.type != reader.type) {
      finding.what = from + " writes the type " + writer.type + " and " + to + " reads " +
                     reader.type + " on the same topic: nothing is delivered";
      detail = writer.type + reader.type;
    } else if (writer.keyed != reader.keyed) {
      finding.what = from +
                     (writer.keyed ? " writes instances with keys" : " writes without keys") +
                     " and " + to + " reads " + (reader.keyed ? "with" : "without") +
                     " them, both as " + writer.type + ": nothing is delivered";
      finding.policy = "key";
      detail = "key";
    }
    if (!detail.empty()) {
      settled_.insert({&writer, &reader});
      if (asked) Tell({"type", from, to, detail}, reader.topic, std::move(finding));
      return;
    }
    const std::vector<Mismatch> mismatches = Compare(writer.qos, reader.qos);
    settled_.insert({&writer, &reader});
    if (!mismatches.empty() && IsHeardByAnother(writer, reader)) return;
    for (const Mismatch& mismatch : mismatches) {
      if (!asked) break;
      Tell({"qos", from, to, mismatch.policy}, reader.topic,
           {.severity = Severity::kProblem,
            .cause = "qos",
            .what = Unmatched(from, mismatch, to),
            .remedy = RemedyOf(mismatch.policy),
            .policy = mismatch.policy,
            .participants = {from, to}});
    }
    if (!mismatches.empty()) return;
    if (!writer.schema.empty() && !reader.schema.empty() &&
        WithoutBlanks(writer.schema) != WithoutBlanks(reader.schema) && asked) {
      finding.what = from + " and " + to + " mean different members by " + writer.type +
                     ": what is delivered cannot be read";
      Tell({"type", from, to, "schema"}, reader.topic, std::move(finding));
    }
    heard_.insert({&writer, &reader});
    if (!asked) return;
    Flow& flow = flows_[{reader.topic, reader.domain}];
    flow.topic = reader.topic;
    flow.domain = reader.domain;
    const auto add = [](std::vector<std::string>& list, const std::string& name) {
      if (std::find(list.begin(), list.end(), name) == list.end()) list.push_back(name);
    };
    add(flow.from, from);
    add(flow.to, to);
  }

  /// Recorders and gateways have a reader for each kind of writer.
  bool IsHeardByAnother(const SeenEndpoint& writer, const SeenEndpoint& reader) const {
    const std::vector<const SeenEndpoint*>& readers = topics_.at(reader.topic).readers;
    return std::any_of(readers.begin(), readers.end(), [&](const SeenEndpoint* other) {
      return other->participant == reader.participant && other->type == writer.type &&
             PartitionsMeet(writer.partitions, other->partitions) &&
             Compare(writer.qos, other->qos).empty();
    });
  }

  static std::string RemedyOf(const std::string& policy) {
    if (policy == "reliability") {
      return "Start both with --best-effort TOPIC, or both without (docs/topics.md has the table).";
    }
    if (policy == "data representation") {
      return "Let the other middleware use XCDR1 for this topic: Fast DDS 2.9 knows no other.";
    }
    return "Make the reader ask for no more than the writer offers (docs/topics.md has the table).";
  }

  /// A reader that no writer of its own domain and station meets.
  void ExplainSilence(const SeenEndpoint& reader, const TopicEnds& ends) {
    const std::string& to = names_.Of(reader.participant);
    for (const SeenEndpoint* writer : ends.writers) {
      if (writer->participant == reader.participant ||
          !names_.Asked(writer->participant, reader.participant)) {
        continue;
      }
      const std::string& from = names_.Of(writer->participant);
      // Who is heard where they are, belongs there.
      const Severity severity = heard_.count(writer) != 0 ? Severity::kNote : Severity::kProblem;
      if (writer->domain == reader.domain) {
        Tell({"station", from, to, StationOf(*writer) + '|' + StationOf(reader)}, reader.topic,
             {.severity = severity,
              .cause = "station",
              .what = ApartInStations(from, *writer, to, reader),
              .remedy = writer->partitions.empty() || reader.partitions.empty()
                            ? "Let the program without a partition use one, named as the station."
                            : "Start both with the same --station.",
              .participants = {from, to}});
      } else if (PartitionsMeet(writer->partitions, reader.partitions)) {
        Tell({"domain", from, to, std::to_string(writer->domain)}, reader.topic,
             {.severity = severity,
              .cause = "domain",
              .what = ApartInDomains(from, writer->domain, to, reader.domain),
              .remedy = "Start both with the same --domain.",
              .participants = {from, to}});
      }
    }
    if (!ends.writers.empty() || IsOfAProgram(reader.topic)) return;
    ExplainName(reader);
  }

  /// A reader of a topic that nobody writes anywhere: is there one of nearly that name?
  void ExplainName(const SeenEndpoint& reader) {
    std::vector<std::string> candidates;
    for (const auto& [topic, ends] : topics_) {
      if (topic == reader.topic || IsOfAProgram(topic)) continue;
      for (const SeenEndpoint* writer : ends.writers) {
        if (writer->domain == reader.domain && heard_.count(writer) == 0 &&
            PartitionsMeet(writer->partitions, reader.partitions) &&
            names_.Asked(writer->participant, reader.participant)) {
          candidates.push_back(topic);
          break;
        }
      }
    }
    std::optional<std::string> nearest = NearestName(reader.topic, candidates);
    // As ROS 2 maps its names onto DDS.
    for (const std::string& candidate : candidates) {
      if (candidate == "rt/" + reader.topic || reader.topic == "rt/" + candidate) {
        nearest = candidate;
      }
    }
    if (!nearest) return;
    const std::string& to = names_.Of(reader.participant);
    const std::string& from = names_.Of(topics_.at(*nearest).writers.front()->participant);
    Tell(
        {"topic", from, to, *nearest}, reader.topic,
        {.severity = Severity::kProblem,
         .cause = "topic",
         .what = to + " reads a topic that nobody writes; " + from + " writes \"" + *nearest + "\"",
         .remedy = "Give both the same name of the topic.",
         .participants = {from, to}});
  }

  const Names& names_;
  std::map<std::string, TopicEnds> topics_;
  std::set<const SeenEndpoint*> settled_;  ///< met a counterpart, for good or bad
  std::set<const SeenEndpoint*> heard_;    ///< samples flow from it or to it
  std::map<GroupKey, Group> groups_;
  std::map<std::pair<std::string, int>, Flow> flows_;
};

}  // namespace

Names::Names(const Evidence& evidence) : evidence_(evidence) {
  for (const ircp::SeenParticipant& one : evidence.discovery.participants) {
    names_[one.id] = one.name.empty() ? one.vendor + " participant " + one.id : one.name;
  }
}

const std::string& Names::Of(const std::string& participant) const {
  static const std::string unknown = "somebody";
  const auto found = names_.find(participant);
  return found == names_.end() ? unknown : found->second;
}

bool Names::Asked(const std::string& participant) const {
  const std::string& name = Of(participant);
  return evidence_.names.empty() ||
         std::any_of(evidence_.names.begin(), evidence_.names.end(),
                     [&](const std::string& asked) { return IsCalled(name, asked); });
}

bool Names::Asked(const std::string& one, const std::string& other) const {
  if (evidence_.names.size() < 2) return Asked(one) || Asked(other);
  return Asked(one) && Asked(other);
}

std::string Listed(const std::vector<std::string>& names, std::size_t most) {
  if (names.size() <= most) return Join(names, ", ");
  const std::vector<std::string> first(names.begin(),
                                       names.begin() + static_cast<std::ptrdiff_t>(most));
  return Join(first, ", ") + " and " + std::to_string(names.size() - most) + " more";
}

std::string StationOf(const SeenEndpoint& endpoint) {
  if (endpoint.partitions.empty()) return "no station";
  std::vector<std::string> quoted;
  for (const std::string& name : endpoint.partitions) quoted.push_back('"' + name + '"');
  return "station " + Join(quoted, ", ");
}

bool IsCalled(const std::string& name, const std::string& asked) {
  const auto is = [&](const std::string& word) { return name == word || name == word + "-tap"; };
  return is(asked) || is("exemplar-" + asked);
}

void DiagnoseEndpoints(const Evidence& evidence, const Names& names, Diagnosis& diagnosis) {
  EndpointJudge(evidence, names).Judge(diagnosis);
}

}  // namespace exemplar::diagnosis

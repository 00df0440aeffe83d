// How near the learner's answers come to what people did: trials held out of real data sets
// (EXEMPLAR_DATA), beside the figures of peers. Prints a table; every choice the learner makes is
// made inside the training set.
//
// usage: learning_accuracy [paper|frames|auto|selection|NAME=VALUE]...   (options hold for all
// methods; selection: where the vote and the joint choice of markers differ, and what follows)

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "../unit/learning/known_episodes.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/base/text.hpp"
#include "exemplar/demonstration/csv.hpp"
#include "exemplar/learning/skill.hpp"

namespace {

using exemplar::Result;
using exemplar::Rng;
using exemplar::demonstration::Trial;
using exemplar::learning::Evaluation;
using exemplar::learning::LearnOptions;
using exemplar::learning::NamedTrial;
using exemplar::learning::Skill;

std::filesystem::path DataFolder() {
  if (const char* folder = std::getenv("EXEMPLAR_DATA")) return folder;
  return std::filesystem::path(EXEMPLAR_SOURCE_DIR) / "../shared/data";
}

std::vector<NamedTrial> ReadFolder(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_directory(folder)) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == ".csv") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  std::vector<NamedTrial> trials;
  for (const std::filesystem::path& file : files) {
    std::ifstream stream(file);
    std::stringstream text;
    text << stream.rdbuf();
    Result<Trial> trial = exemplar::demonstration::ReadCsv(text.str(), file.filename().string());
    if (!trial.ok()) {
      std::fprintf(stderr, "%s\n", trial.error().message.c_str());
      continue;
    }
    trials.push_back({file.stem().string(), std::move(*trial)});
  }
  return trials;
}

/// Trials of one person: the file name up to the first underscore.
std::vector<std::vector<NamedTrial>> ByPerson(const std::vector<NamedTrial>& trials) {
  std::map<std::string, std::vector<NamedTrial>> people;
  for (const NamedTrial& trial : trials) {
    people[trial.id.substr(0, trial.id.find('_'))].push_back(trial);
  }
  std::vector<std::vector<NamedTrial>> result;
  for (auto& [name, of_person] : people) result.push_back(std::move(of_person));
  return result;
}

double Median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

/// Direction of the last twentieth of a path.
Eigen::Vector3d Heading(const std::vector<exemplar::geometry::Pose>& path) {
  const std::size_t back = std::max<std::size_t>(1, path.size() / 20);
  return (path.back().translation - path[path.size() - 1 - back].translation).normalized();
}

struct Tally {
  std::vector<double> frechet, end, turn, heading, predicted;
  int refused = 0;
};

void Predict(const std::vector<NamedTrial>& training, const std::vector<const NamedTrial*>& tests,
             const LearnOptions& options, Tally& tally) {
  const Result<Skill> skill = LearnSkill(training, options);
  if (!skill.ok()) {
    std::fprintf(stderr, "learning: %s\n", skill.error().message.c_str());
    tally.refused += static_cast<int>(tests.size());
    return;
  }
  for (const NamedTrial* test : tests) {
    const Result<Evaluation> evaluation = Evaluate(*skill, test->trial);
    if (!evaluation.ok()) {
      std::fprintf(stderr, "%s: %s\n", test->id.c_str(), evaluation.error().message.c_str());
      ++tally.refused;
      continue;
    }
    const auto& shown = test->trial.end_effectors.front().base_T_frame;
    tally.frechet.push_back(evaluation->deviation.frechet_m);
    tally.end.push_back(evaluation->deviation.end_error_m);
    tally.turn.push_back(evaluation->deviation.end_angle_rad);
    tally.heading.push_back(std::acos(
        std::clamp(Heading(shown).dot(Heading(evaluation->answer.base_T_tool)), -1., 1.)));
    if (!evaluation->answer.sigma_m.empty()) {
      tally.predicted.push_back(evaluation->answer.sigma_m.back());
    }
    if (std::getenv("LEARNING_ACCURACY_VERBOSE") != nullptr) {
      std::printf("    %-18s %-40s %8.4f %8.4f  sigma %.4f\n", test->id.c_str(),
                  skill->report().method.c_str(), tally.frechet.back(), tally.end.back(),
                  tally.predicted.empty() ? 0.0 : tally.predicted.back());
    }
  }
}

void Print(const char* what, const char* method, const Tally& tally, double unit,
           const char* reference, double seconds) {
  std::printf("%-28s %-7s %8.2f /%7.2f  %6.3f  %6.3f  %8.2f   %-26s %3zu%s %6.1f s\n", what, method,
              Median(tally.frechet) * unit, Median(tally.end) * unit, Median(tally.turn),
              Median(tally.heading), Median(tally.predicted) * unit, reference,
              tally.frechet.size(), tally.refused > 0 ? "!" : " ", seconds);
  std::fflush(stdout);
}

double Seconds(std::chrono::steady_clock::time_point since) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

void LeaveOneOut(const char* name, const char* method, const LearnOptions& options,
                 const char* reference) {
  const auto begin = std::chrono::steady_clock::now();
  Tally tally;
  for (const std::vector<NamedTrial>& person : ByPerson(ReadFolder(DataFolder() / name))) {
    for (std::size_t out = 0; out < person.size(); ++out) {
      std::vector<NamedTrial> training = person;
      training.erase(training.begin() + static_cast<std::ptrdiff_t>(out));
      Predict(training, {&person[out]}, options, tally);
    }
  }
  Print((std::string(name) + " one of six").c_str(), method, tally, 100, reference, Seconds(begin));
}

void Transfer(const char* name, const char* method, const LearnOptions& options,
              const char* reference) {
  const auto begin = std::chrono::steady_clock::now();
  Tally tally;
  for (const std::vector<NamedTrial>& person : ByPerson(ReadFolder(DataFolder() / name))) {
    const auto place = [](const NamedTrial& t) {
      return t.trial.objects.front().base_T_frame.front().translation;
    };
    for (const bool first : {true, false}) {
      std::vector<NamedTrial> training;
      std::vector<const NamedTrial*> tests;
      for (const NamedTrial& trial : person) {
        if (((place(trial) - place(person[0])).norm() < 1e-3) == first) {
          training.push_back(trial);
        } else {
          tests.push_back(&trial);
        }
      }
      Predict(training, tests, options, tally);
    }
  }
  Print((std::string(name) + " other pose").c_str(), method, tally, 100, reference, Seconds(begin));
}

void Reach(int k, const char* method, const LearnOptions& options, const char* reference) {
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<NamedTrial> all = ReadFolder(DataFolder() / "reach_target");
  Tally tally;
  Rng rng(1);
  for (int repeat = 0; repeat < 20 && all.size() == 9; ++repeat) {
    std::vector<std::size_t> order = {0, 1, 2, 3, 4, 5, 6, 7, 8};
    for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[rng.Below(i + 1)]);
    std::vector<NamedTrial> training;
    std::vector<const NamedTrial*> tests;
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i < static_cast<std::size_t>(k)) {
        training.push_back(all[order[i]]);
      } else {
        tests.push_back(&all[order[i]]);
      }
    }
    Predict(training, tests, options, tally);
  }
  Print(("reach_target k = " + std::to_string(k)).c_str(), method, tally, 1, reference,
        Seconds(begin));
}

/// One alignment by each rule, of the same trials.
struct BothAligned {
  exemplar::learning::Alignment vote, joint;
};

Result<BothAligned> AlignByBoth(const std::vector<exemplar::learning::UniformTrial>& trials) {
  LearnOptions options;
  options.selection = exemplar::learning::Selection::kVote;
  Result<exemplar::learning::Alignment> vote = Align(trials, options);
  if (!vote.ok()) return vote.error();
  options.selection = exemplar::learning::Selection::kJoint;
  Result<exemplar::learning::Alignment> joint = Align(trials, options);
  if (!joint.ok()) return joint.error();
  return BothAligned{std::move(*vote), std::move(*joint)};
}

int CountDiffering(const BothAligned& both) {
  int differing = 0;
  for (std::size_t i = 0; i < both.vote.trials.size(); ++i) {
    differing += both.vote.trials[i].chosen != both.joint.trials[i].chosen ? 1 : 0;
  }
  return differing;
}

void CompareSelectionsOf(const std::string& name, const std::vector<NamedTrial>& trials) {
  std::vector<exemplar::learning::UniformTrial> prepared;
  for (const NamedTrial& trial : trials) {
    Result<exemplar::learning::UniformTrial> uniform =
        Prepare(trial.trial, LearnOptions(), nullptr);
    if (!uniform.ok()) {
      std::fprintf(stderr, "%s: %s\n", trial.id.c_str(), uniform.error().message.c_str());
      return;
    }
    prepared.push_back(std::move(*uniform));
  }
  const Result<BothAligned> both = AlignByBoth(prepared);
  if (!both.ok()) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), both.error().message.c_str());
    return;
  }
  std::printf("%-24s %3zu trials %2zu markers  %3d differ   r %.3f / %.3f (in length only %.3f)\n",
              name.c_str(), trials.size(), both->vote.knots_s.size() - 2, CountDiffering(*both),
              both->vote.mean_correlation, both->joint.mean_correlation,
              both->vote.plain_correlation);
  std::fflush(stdout);
}

void CompareSelections() {
  std::printf("choice of markers, vote / joint\n");
  for (const char* name : {"rail_pressing", "rail_pushing"}) {
    for (const std::vector<NamedTrial>& person : ByPerson(ReadFolder(DataFolder() / name))) {
      CompareSelectionsOf(std::string(name) + " " + person[0].id.substr(0, person[0].id.find('_')),
                          person);
    }
    CompareSelectionsOf(std::string(name) + " all", ReadFolder(DataFolder() / name));
  }
  CompareSelectionsOf("reach_target", ReadFolder(DataFolder() / "reach_target"));
  CompareSelectionsOf("grating", ReadFolder(DataFolder() / "grating"));

  constexpr int kSets = 100;
  for (const int trials : {3, 4, 6}) {
    Rng rng(1);
    int vote_wrong = 0, joint_wrong = 0, differing = 0;
    for (int set = 0; set < kSets; ++set) {
      const auto all = exemplar::learning::DemonstrateAll(rng, trials);
      std::vector<exemplar::learning::UniformTrial> of_set;
      for (const auto& demonstration : all) of_set.push_back(demonstration.trial);
      const Result<BothAligned> both = AlignByBoth(of_set);
      if (!both.ok()) continue;
      vote_wrong += exemplar::learning::CountWrongTrials(both->vote, all);
      joint_wrong += exemplar::learning::CountWrongTrials(both->joint, all);
      differing += CountDiffering(*both);
    }
    std::printf("generated, %d in a set    %3d trials             %3d differ   wrong %d / %d\n",
                trials, kSets * trials, differing, vote_wrong, joint_wrong);
  }
  for (const char* name : {"rail_pressing", "rail_pushing"}) {
    for (const bool joint : {false, true}) {
      LearnOptions options;
      options.selection =
          joint ? exemplar::learning::Selection::kJoint : exemplar::learning::Selection::kVote;
      LeaveOneOut(name, joint ? "joint" : "vote", options, "");
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> methods;
  std::map<std::string, std::string> given;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos) {
      methods.push_back(word);
    } else {
      given[word.substr(0, equals)] = word.substr(equals + 1);
    }
  }
  if (methods.empty()) methods = {"paper", "frames", "auto"};
  if (!std::filesystem::is_directory(DataFolder())) {
    std::printf("skipped: no data at %s (set EXEMPLAR_DATA)\n", DataFolder().c_str());
    return 0;
  }
  std::printf(
      "medians; cm and rad (reach_target: plot units)\n%-28s %-7s %8s /%7s  %6s  %6s  %8s   %s\n",
      "data", "method", "Frechet", "end", "turn", "head", "sigma", "best known peer");
  for (const std::string& name : methods) {
    if (name == "selection") {
      CompareSelections();
      continue;
    }
    given["method"] = name;
    const Result<LearnOptions> read = LearnOptions::FromStrings(given);
    if (!read.ok()) {
      std::fprintf(stderr, "%s\n", read.error().message.c_str());
      return 2;
    }
    LearnOptions options = *read;
    const char* m = name.c_str();
    LeaveOneOut("rail_pressing", m, options, "3.54 / 1.29, 4.15 / 1.88");
    LeaveOneOut("rail_pushing", m, options, "7.40 / 2.15, 7.56 / 1.74");
    Transfer("rail_pressing", m, options, "4.8 / 3.00");
    Transfer("rail_pushing", m, options, "8.1 / 3.14");
    options.target = "target";
    Reach(5, m, options, "7.1 / 2.3, head .13");
    Reach(6, m, options, "6.6 / 2.2, head .13");
    Reach(7, m, options, "5.3 / 2.6, head .11");
  }
  return 0;
}

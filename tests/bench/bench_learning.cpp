// Learning as the service does it, and the choice of markers beside exhaustion. Prints a JSON list
// of rows as tests/bench/run collects them; with --write, only writes the trials as files.

#include <malloc.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <string>

#include "exemplar/base/rng.hpp"
#include "exemplar/demonstration/csv.hpp"
#include "exemplar/learning/marker_choice.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "long_presses.hpp"
#include "pair_correlator.hpp"
#include "subsets.hpp"

namespace exemplar {
namespace {

constexpr const char* kName = "bench_learning";
constexpr int kPoints = 240;

double Seconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

nlohmann::json Row(const std::string& name, double value, const std::string& unit,
                   const std::string& peer, double peer_value, double ratio) {
  return {{"name", name}, {"value", value},           {"unit", unit},
          {"peer", peer}, {"peer_value", peer_value}, {"ratio", ratio}};
}

// Bytes of a status line of this process.
double StatusBytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key + ":")) return 1024 * std::stod(line.substr(key.size() + 1));
  }
  return 0;
}

double BytesOf(const demonstration::ScalarSeries& series) {
  return static_cast<double>(sizeof(double)) *
         static_cast<double>(series.time_s.size() + static_cast<std::size_t>(series.values.size()));
}

double BytesOf(const demonstration::Trial& trial) {
  double bytes = BytesOf(trial.joints) + BytesOf(trial.tactile);
  for (const demonstration::PoseSeries& object : trial.objects) {
    bytes += static_cast<double>(8 * sizeof(double) * object.size());
  }
  return bytes;
}

void Learn(const kinematics::RobotDescription& robot, int count, nlohmann::json& rows) {
  const std::vector<learning::NamedTrial> trials = bench::MakeLongPresses(robot, count, 11);
  double data = 0;
  for (const learning::NamedTrial& named : trials) data += BytesOf(named.trial);
  const auto tool = std::make_shared<kinematics::Chain>(robot.chain);
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
  const double before = StatusBytes("VmRSS");
  std::string methods;
  const double seconds = Seconds([&] {
    const Result<learning::Skill> skill = learning::LearnSkill(trials, {}, tool);
    for (const learning::MethodScore& score : skill->report().methods) methods += score.method;
  });
  const double most = StatusBytes("VmHWM") - before;
  const std::string of = "learn_" + std::to_string(count) + "_trials";
  // The floor: each sample copied once.
  std::vector<learning::NamedTrial> copies;
  const double floor = Seconds([&] { copies = trials; });
  rows.push_back(Row(of + "_time", seconds, "s", "copying the trials", floor, seconds / floor));
  rows.push_back(Row(of + "_memory", most / 1e6, "MB", "the trials' samples", data / 1e6,
                     (most + data) / data));
}

// Bumps at the candidates, each of a height of its own.
learning::MarkerCandidates RandomTrial(Rng& rng, int index, std::size_t candidates) {
  learning::MarkerCandidates trial;
  trial.id = "trial " + std::to_string(index);
  trial.duration_s = rng.Uniform(8, 12);
  constexpr Eigen::Index kSamples = 600;
  trial.signal = Eigen::VectorXd::Zero(kSamples);
  const double room = trial.duration_s / static_cast<double>(candidates + 1);
  for (std::size_t c = 0; c < candidates; ++c) {
    trial.time_s.push_back(room * (static_cast<double>(c) + rng.Uniform(0.3, 1.2)));
    trial.score.push_back(rng.Uniform(1, 3));
    for (Eigen::Index k = 0; k < kSamples; ++k) {
      const double t = trial.duration_s * static_cast<double>(k) / (kSamples - 1);
      const double off = (t - trial.time_s.back() - 0.3 * room) / (0.3 * room);
      trial.signal[k] += trial.score.back() * std::exp(-off * off);
    }
  }
  return trial;
}

struct Case {
  std::vector<learning::MarkerCandidates> trials;
  std::vector<std::vector<learning::Subset>> subsets;
};

// `trials` with `candidates` markers each; the last has `least`.
Case MakeCase(Rng& rng, int trials, std::size_t candidates, std::size_t least) {
  Case made;
  for (int i = 0; i < trials; ++i) {
    made.trials.push_back(RandomTrial(rng, i, i + 1 == trials ? least : candidates));
    std::vector<int> all;
    for (int c = 0; c < static_cast<int>(made.trials.back().time_s.size()); ++c) all.push_back(c);
    made.subsets.push_back(learning::AllSubsets(all, least));
  }
  return made;
}

// Every pair of subsets once, and every joint choice with the sum carried along: the plain way to
// exhaust the joint objective.
double ExhaustJointly(const Case& c) {
  const std::size_t n = c.trials.size();
  std::vector<std::vector<std::vector<double>>> worth(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (const learning::Subset& a : c.subsets[i]) {
        worth[i * n + j].emplace_back();
        for (const learning::Subset& b : c.subsets[j]) {
          worth[i * n + j].back().push_back(
              learning::PairCorrelation(c.trials[i], a, c.trials[j], b, kPoints));
        }
      }
    }
  }
  double best = -std::numeric_limits<double>::infinity();
  std::vector<std::size_t> at(n, 0);
  const std::function<void(std::size_t, double)> descend = [&](std::size_t i, double sum) {
    if (i == n) {
      best = std::max(best, sum);
      return;
    }
    for (at[i] = 0; at[i] < c.subsets[i].size(); ++at[i]) {
      double more = sum;
      for (std::size_t k = 0; k < i; ++k) more += worth[k * n + i][at[k]][at[i]];
      descend(i + 1, more);
    }
  };
  descend(0, 0);
  return best;
}

// What a correlation costs by itself, at each point of the grid: 24 multiply-adds for either signal
// (its time, its place between knots, the spline, the value between samples), 7 for Pearson's r.
constexpr double kNaiveMultiplyAdds = 55;
// The same in PairCorrelator.
constexpr double kMultiplyAdds = 16;

struct Work {
  double points = 0;
  double naive_points = 0;
};

Work CountWork(const Case& c) {
  Work work;
  const std::vector<learning::CorrelatedTrial> correlated(c.trials.begin(), c.trials.end());
  const auto all = [&](std::size_t i) {
    std::vector<int> candidates(c.trials[i].time_s.size());
    std::iota(candidates.begin(), candidates.end(), 0);
    return candidates;
  };
  for (std::size_t i = 0; i < c.trials.size(); ++i) {
    for (std::size_t j = i + 1; j < c.trials.size(); ++j) {
      const auto pairs = static_cast<double>(c.subsets[i].size() * c.subsets[j].size());
      learning::PairCorrelator pair(correlated[i], correlated[j], kPoints, pairs);
      pair.CorrelateAll(all(i), all(j), c.subsets[0][0].size(),
                        [](std::size_t, std::size_t, double) {});
      work.points += static_cast<double>(pair.computed_points());
      work.naive_points += pairs * kPoints;
    }
  }
  return work;
}

void ChooseJointly(bool largest, nlohmann::json& rows) {
  Rng rng(5);
  struct Size {
    int trials;
    std::size_t candidates, least;
    const char* name;
    bool asked_for_only;
  };
  // The last trial has one subset, each other all.
  for (const Size& size : {Size{12, 4, 2, "joint_choice_exhausted", false},
                           Size{7, 20, 1, "joint_choice_of_20^6", false},
                           Size{8, 20, 1, "joint_choice_of_20^7", true}}) {
    const Case c = MakeCase(rng, size.trials, size.candidates, size.least);
    if (size.asked_for_only && !largest) continue;
    learning::MarkerChoice choice;
    double best = 0;
    const double joint = Seconds([&] { choice = learning::ChooseJointly(c.trials); });
    const double exhausted = Seconds([&] { best = ExhaustJointly(c); });
    if (std::abs(best - choice.value) > 1e-8) {
      std::fprintf(stderr, "%s: the joint choice is not the exhausted one\n", kName);
    }
    rows.push_back(
        Row(size.name, joint, "s", "exhausting the choices", exhausted, exhausted / joint));
  }
  for (const std::size_t least : {std::size_t{2}, std::size_t{5}, std::size_t{15}}) {
    const Case c = [&] {
      Case made;
      for (int i = 0; i < 12; ++i) made.trials.push_back(RandomTrial(rng, i, i == 11 ? least : 30));
      return made;
    }();
    const double joint = Seconds([&] { learning::ChooseJointly(c.trials); });
    const double vote = Seconds([&] { learning::ChooseByVote(c.trials); });
    rows.push_back(Row("joint_choice_12_trials_30_candidates_" + std::to_string(least) + "_chosen",
                       joint, "s", "the vote on the same candidates", vote, vote / joint));
  }
}

void ChooseByVote(nlohmann::json& rows) {
  Rng rng(6);
  for (const auto& [least, candidates] :
       {std::pair<std::size_t, std::size_t>{1, 24}, {2, 12}, {3, 9}, {4, 8}, {6, 9}}) {
    const Case c = MakeCase(rng, 4, candidates, least);
    const double vote = Seconds([&] { learning::ChooseByVote(c.trials); });
    const double naive = Seconds([&] {
      double sum = 0;
      for (std::size_t i = 0; i < c.trials.size(); ++i) {
        for (std::size_t j = i + 1; j < c.trials.size(); ++j) {
          for (const learning::Subset& a : c.subsets[i]) {
            for (const learning::Subset& b : c.subsets[j]) {
              sum += learning::PairCorrelation(c.trials[i], a, c.trials[j], b, kPoints);
            }
          }
        }
      }
      if (!(sum < 1e300)) std::fprintf(stderr, "%s: no sum\n", kName);
    });
    const std::string name = "vote_" + std::to_string(least) + "_of_" + std::to_string(candidates);
    rows.push_back(Row(name, vote, "s", "each correlation by itself", naive, naive / vote));
    const Work work = CountWork(c);
    const double own = kMultiplyAdds * work.points;
    const double by_itself = kNaiveMultiplyAdds * work.naive_points;
    rows.push_back(Row(name + "_multiply_adds", own / 1e6, "million", "each correlation by itself",
                       by_itself / 1e6, by_itself / own));
  }
}

}  // namespace
}  // namespace exemplar

int main(int argc, char** argv) {
  using namespace exemplar;
  std::string robot_folder, folder;
  int count = 100;
  bool largest = false;
  program::Options options(kName, "Measures learning and the choice of markers",
                           "bench_learning --robot deploy/models/leonardo", {});
  options.Add("--robot", robot_folder, "a folder of deploy/models").Required();
  options.Add("--write", folder, "write the trials as CSV files here, and end");
  options.Add("--trials", count, "how many").MinMax(1, 10000);
  options.Add("--largest", largest, "also exhaust a choice that takes a minute");
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  const auto robot = kinematics::ReadRobotDescription(robot_folder);
  if (!robot) return program::Fail(kName, robot.error());
  if (!folder.empty()) {
    for (const learning::NamedTrial& named : bench::MakeLongPresses(*robot, count, 11)) {
      std::ofstream out(std::filesystem::path(folder) / named.trial.source);
      out << demonstration::WriteCsv(named.trial);
      if (!out) return program::Fail(kName, Unavailable(folder + ": cannot be written"));
    }
    return 0;
  }
  nlohmann::json rows = nlohmann::json::array();
  Learn(*robot, count, rows);
  ChooseJointly(largest, rows);
  ChooseByVote(rows);
  std::printf("%s\n", rows.dump().c_str());
  return 0;
}

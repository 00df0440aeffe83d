#include "method_choice.hpp"

#include <algorithm>
#include <optional>

#include "block_kriging.hpp"
#include "deviation.hpp"
#include "exemplar/learning/objectivity.hpp"
#include "exemplar/learning/rbf.hpp"
#include "frames_model.hpp"
#include "freed_memory.hpp"
#include "paper_model.hpp"
#include "path_frames.hpp"
#include "rewarp.hpp"

namespace exemplar::learning {
namespace {

// Up to this many trials every choice is made anew without the trial; beyond, errors are those of
// the closed forms, of an even selection among an even selection of the trials.
constexpr int kMostRefits = 15;
constexpr int kMostScored = 100;
constexpr int kFrechetPoints = 300;

using Path = std::vector<geometry::Pose>;

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

Path AsPoses(const Eigen::Matrix3Xd& positions) {
  Path path;
  path.reserve(static_cast<std::size_t>(positions.cols()));
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    path.push_back(geometry::Pose::FromTranslation(positions.col(i)));
  }
  return path;
}

// What the others say at a trial.
class LeftOutPaths {
 public:
  virtual ~LeftOutPaths() = default;
  virtual Path At(int trial) = 0;
  virtual const Path& Shown(int trial) const = 0;
};

class Refitted final : public LeftOutPaths {
 public:
  Refitted(const std::string& choice, Exemplars exemplars,
           std::shared_ptr<const demonstration::ToolKinematics> tool)
      : choice_(choice), exemplars_(std::move(exemplars)), tool_(std::move(tool)) {}
  Path At(int trial) override {
    return FitModel(choice_, exemplars_.Without(trial), tool_)
        ->Predict(exemplars_.trials[static_cast<std::size_t>(trial)].situation)
        .tool;
  }
  const Path& Shown(int trial) const override {
    return exemplars_.trials[static_cast<std::size_t>(trial)].tool;
  }

 private:
  std::string choice_;
  Exemplars exemplars_;
  std::shared_ptr<const demonstration::ToolKinematics> tool_;
};

class FramesLeftOut final : public LeftOutPaths {
 public:
  explicit FramesLeftOut(Exemplars exemplars)
      : exemplars_(std::move(exemplars)), path_(exemplars_) {}
  Path At(int trial) override { return AsPoses(path_.LeftOut(trial)); }
  const Path& Shown(int trial) const override {
    return exemplars_.trials[static_cast<std::size_t>(trial)].tool;
  }

 private:
  Exemplars exemplars_;
  PathFrames path_;
};

// As PaperModel answers for the trial when fitted to the others, whose weights follow from one
// inverse (Rippa 1999).
class PaperLeftOut final : public LeftOutPaths {
 public:
  PaperLeftOut(const Exemplars& exemplars,
               std::shared_ptr<const demonstration::ToolKinematics> tool)
      : exemplars_(exemplars), tool_(std::move(tool)) {
    const int n = exemplars.size();
    const int target = exemplars.target;
    Eigen::MatrixXd positions(n, target < 0 ? 0 : 3);
    for (int j = 0; j < n; ++j) {
      base_.push_back(exemplars.BasePath(j));
      if (target < 0) continue;
      shifted_.push_back(exemplars.ShiftedPath(j, target));
      positions.row(j) = exemplars.trials[static_cast<std::size_t>(j)]
                             .situation.base_T_object[static_cast<std::size_t>(target)]
                             .translation.transpose();
    }
    rbf_.emplace(positions, RbfOptions{.trend = Trend::kAffine, .ridge = 0});
  }

  Path At(int trial) override {
    const Eigen::VectorXd weights = rbf_->LeftOutWeights(trial);
    const auto at = static_cast<std::size_t>(trial);
    Eigen::MatrixXd path = Absolute(weights);
    if (exemplars_.target >= 0) {
      // The last takes the place of the one left out while the variances are taken.
      std::swap(base_[at], base_.back());
      std::swap(shifted_[at], shifted_.back());
      const std::size_t others = base_.size() - 1;
      const Eigen::VectorXd upsilon =
          ComputeObjectivity(std::span(base_).first(others), std::span(shifted_).first(others),
                             exemplars_.FirstContact(exemplars_.target))
              .upsilon;
      std::swap(base_[at], base_.back());
      std::swap(shifted_[at], shifted_.back());
      Eigen::MatrixXd objective = Sum(shifted_, weights);
      objective.rowwise() +=
          exemplars_.trials[at]
              .situation.base_T_object[static_cast<std::size_t>(exemplars_.target)]
              .translation.transpose();
      path += (upsilon.asDiagonal() * (objective - path)).eval();
    }
    return AsPoses(path.transpose());
  }
  const Path& Shown(int trial) const override {
    return exemplars_.trials[static_cast<std::size_t>(trial)].tool;
  }

 private:
  static Eigen::MatrixXd Sum(const std::vector<Eigen::MatrixXd>& of_trial,
                             const Eigen::VectorXd& weights) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(of_trial[0].rows(), of_trial[0].cols());
    for (std::size_t j = 0; j < of_trial.size(); ++j) {
      sum += weights[static_cast<Eigen::Index>(j)] * of_trial[j];
    }
    return sum;
  }

  Eigen::MatrixXd Absolute(const Eigen::VectorXd& weights) const {
    if (tool_ == nullptr || exemplars_.joints() == 0) return Sum(base_, weights);
    Eigen::MatrixXd joints = Eigen::MatrixXd::Zero(exemplars_.frames, exemplars_.joints());
    for (std::size_t j = 0; j < base_.size(); ++j) {
      joints += weights[static_cast<Eigen::Index>(j)] * exemplars_.trials[j].joints;
    }
    Eigen::MatrixXd path(exemplars_.frames, 3);
    for (int i = 0; i < exemplars_.frames; ++i) {
      path.row(i) = tool_->ToolPose(joints.row(i).transpose()).translation.transpose();
    }
    return path;
  }

  const Exemplars& exemplars_;
  std::shared_ptr<const demonstration::ToolKinematics> tool_;
  std::vector<Eigen::MatrixXd> base_, shifted_;
  std::optional<CardinalRbf> rbf_;
};

}  // namespace

Exemplars ExemplarsFor(const std::string& choice, Exemplars exemplars) {
  if (choice == kFramesByLengthChoice) return AlignedByLength(std::move(exemplars));
  if (choice == kFramesByContactChoice) {
    return AlignedByLength(AlignedAtContacts(std::move(exemplars)));
  }
  return exemplars;
}

std::unique_ptr<const Model> FitModel(const std::string& choice, Exemplars exemplars,
                                      std::shared_ptr<const demonstration::ToolKinematics> tool) {
  if (choice == kFramesChoice || choice == kFramesByLengthChoice ||
      choice == kFramesByContactChoice) {
    return std::make_unique<FramesModel>(std::move(exemplars));
  }
  return std::make_unique<PaperModel>(std::move(exemplars), std::move(tool));
}

std::vector<MethodScore> ScoreMethods(std::span<const std::string> choices, Exemplars exemplars,
                                      std::shared_ptr<const demonstration::ToolKinematics> tool,
                                      const Progress& progress, const std::stop_token& stop) {
  if (exemplars.size() < 2 || !exemplars.has_tool) return {};
  exemplars = exemplars.Only(EvenChoice(exemplars.size(), kMostScored));
  const int n = exemplars.size();
  const std::vector<int> tested = EvenChoice(n, kMostRefits);
  std::vector<MethodScore> scores(choices.size());
  // The paper's method first: once it is scored, only paths are needed.
  std::vector<std::size_t> order;
  for (const bool paper : {true, false}) {
    for (std::size_t c = 0; c < choices.size(); ++c) {
      if ((choices[c] == kPaperChoice) == paper) order.push_back(c);
    }
  }
  bool paths_only = false;
  for (std::size_t turn = 0; turn < order.size(); ++turn) {
    const std::string& choice = choices[order[turn]];
    const bool paper = choice == kPaperChoice;
    if (stop.stop_requested()) return {};
    if (!paper && !paths_only) exemplars.KeepPathsOnly();
    paths_only = !paper;
    ReturnFreedMemory();
    std::unique_ptr<LeftOutPaths> others;
    if (n <= kMostRefits) {
      others = std::make_unique<Refitted>(choice, ExemplarsFor(choice, exemplars), tool);
    } else if (paper) {
      others = std::make_unique<PaperLeftOut>(exemplars, tool);
    } else {
      others = std::make_unique<FramesLeftOut>(ExemplarsFor(choice, exemplars));
    }
    MethodScore& score = scores[order[turn]];
    score.method = choice;
    std::vector<double> ends;
    for (std::size_t k = 0; k < tested.size(); ++k) {
      if (stop.stop_requested()) return {};
      if (progress) {
        progress((static_cast<double>(turn) +
                  static_cast<double>(k) / static_cast<double>(tested.size())) /
                     static_cast<double>(choices.size()),
                 "predicting each trial from the others: " + choice);
      }
      const demonstration::Deviation deviation =
          Compare(others->At(tested[k]), others->Shown(tested[k]), kFrechetPoints);
      score.frechet_by_trial_m.push_back(deviation.frechet_m);
      ends.push_back(deviation.end_error_m);
    }
    score.frechet_m = Median(score.frechet_by_trial_m);
    score.end_error_m = Median(ends);
  }
  return scores;
}

}  // namespace exemplar::learning

#include "method_choice.hpp"

#include <algorithm>

#include "deviation.hpp"
#include "frames_model.hpp"
#include "paper_model.hpp"
#include "rewarp.hpp"

namespace exemplar::learning {
namespace {

// Up to this many trials every choice is made anew without the trial; beyond, errors are those of
// the closed form and of an even selection.
constexpr int kMostRefits = 15;
constexpr int kFrechetPoints = 300;

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

std::vector<geometry::Pose> LeftOutPath(
    const std::string& choice, const Exemplars& exemplars, const FramesModel* whole, int trial,
    const std::shared_ptr<const demonstration::ToolKinematics>& tool) {
  if (whole != nullptr) {
    if (const auto positions = whole->LeftOut(trial)) {
      std::vector<geometry::Pose> path;
      for (Eigen::Index i = 0; i < positions->cols(); ++i) {
        path.push_back(geometry::Pose::FromTranslation(positions->col(i)));
      }
      return path;
    }
  }
  const Exemplars others = exemplars.Without(trial);
  const std::unique_ptr<const Model> model = FitModel(choice, others, tool);
  return model->Predict(exemplars.trials[static_cast<std::size_t>(trial)].situation).tool;
}

}  // namespace

Exemplars ExemplarsFor(const std::string& choice, Exemplars exemplars) {
  if (choice == kFramesByLengthChoice) return AlignedByLength(exemplars);
  if (choice == kFramesByContactChoice) return AlignedByLength(AlignedAtContacts(exemplars));
  return exemplars;
}

std::unique_ptr<const Model> FitModel(const std::string& choice, const Exemplars& exemplars,
                                      std::shared_ptr<const demonstration::ToolKinematics> tool) {
  if (choice == kFramesChoice || choice == kFramesByLengthChoice ||
      choice == kFramesByContactChoice) {
    return std::make_unique<FramesModel>(exemplars);
  }
  return std::make_unique<PaperModel>(exemplars, std::move(tool));
}

std::vector<MethodScore> ScoreMethods(std::span<const std::string> choices,
                                      const Exemplars& exemplars,
                                      std::shared_ptr<const demonstration::ToolKinematics> tool,
                                      const Progress& progress, const std::stop_token& stop) {
  std::vector<MethodScore> scores;
  const int n = exemplars.size();
  if (n < 2 || !exemplars.has_tool) return scores;
  const int count = std::min(n, kMostRefits);
  for (const std::string& choice : choices) {
    const Exemplars aligned = ExemplarsFor(choice, exemplars);
    std::unique_ptr<const FramesModel> whole;
    if (n > kMostRefits && choice != kPaperChoice) whole = std::make_unique<FramesModel>(aligned);
    MethodScore score;
    score.method = choice;
    std::vector<double> ends;
    for (int k = 0; k < count; ++k) {
      if (stop.stop_requested()) return scores;
      const int trial = k * n / count;
      if (progress) {
        progress((static_cast<double>(scores.size()) + static_cast<double>(k) / count) /
                     static_cast<double>(choices.size()),
                 "predicting each trial from the others: " + choice);
      }
      const std::vector<geometry::Pose> path =
          LeftOutPath(choice, aligned, whole.get(), trial, tool);
      const demonstration::Deviation deviation =
          Compare(path, aligned.trials[static_cast<std::size_t>(trial)].tool, kFrechetPoints);
      score.frechet_by_trial_m.push_back(deviation.frechet_m);
      ends.push_back(deviation.end_error_m);
    }
    score.frechet_m = Median(score.frechet_by_trial_m);
    score.end_error_m = Median(ends);
    scores.push_back(std::move(score));
  }
  return scores;
}

}  // namespace exemplar::learning

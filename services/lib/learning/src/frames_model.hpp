#pragma once
// method=frames: positions and orientations each in the frames that predict left-out trials best.

#include <optional>

#include "contact.hpp"
#include "exemplar/learning/rbf.hpp"
#include "exemplars.hpp"
#include "path_frames.hpp"
#include "prediction.hpp"
#include "rotation_frames.hpp"

namespace exemplar::learning {

/// Begins exactly at the situation's start; meets the trials' mean contact point where touch was
/// measured, or where that point predicts left-out trials clearly better than the path does.
/// Immutable.
class FramesModel final : public Model {
 public:
  /// Gives the trials' joints up as it takes them over, where nobody else holds them.
  explicit FramesModel(Exemplars exemplars);
  Prediction Predict(const Situation& situation) const override;

  std::vector<LeftOutTrial> LeftOut() const override;
  std::string Describe() const;

 private:
  Eigen::VectorXd StyleWeights(const Situation& situation) const;
  void MeetContacts(const Situation& situation, Prediction& prediction) const;

  int frames_ = 0;
  int target_ = -1;
  int joints_count_ = 0;
  std::vector<ContactSpan> contacts_;
  std::vector<ContactPoint> contact_points_;
  std::vector<bool> equality_;  // the path meets the contact point exactly
  std::optional<PathFrames> path_;
  std::optional<RotationFrames> rotation_;
  std::optional<CardinalRbf> style_;  // of joints and hand, over the target's position
  RoundedStreams joints_;             // a trial's joint values (joint by joint) a column
  Streams hand_;
  Eigen::MatrixXd objectivity_;
};

}  // namespace exemplar::learning

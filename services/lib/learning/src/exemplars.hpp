#pragma once
// Aligned trials as interpolation sees them: where things were (the adverb) and how it moved (the
// verb).

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "exemplar/demonstration/tool_kinematics.hpp"
#include "exemplar/learning/aligned.hpp"

namespace exemplar::learning {

/// What a motion depends on. Base frame.
struct Situation {
  std::optional<geometry::Pose> base_T_start;  ///< tool at the first frame
  bool start_has_orientation = true;
  std::optional<Eigen::VectorXd> joint_start;  ///< as Exemplars::joint_names
  std::vector<geometry::Pose> base_T_object;   ///< as Exemplars::object_names
};

/// When one trial met an object, in frames of the common time base.
struct ContactWindow {
  double first = 0;
  double still = 0;  ///< where it rested most
  double last = 0;
};

/// One aligned trial. Paths have Exemplars::frames rows.
struct ExemplarTrial {
  Situation situation;               ///< object poses at first contact, or where they rested
  std::vector<geometry::Pose> tool;  ///< base_T_tool, or empty
  Eigen::MatrixXd joints;            ///< frames x joints (or frames x 0)
  Eigen::VectorXd hand;              ///< frames, or empty
  Eigen::VectorXd touch_n;           ///< frames, or empty
  Eigen::VectorXd own_time;          ///< frames: part of the own duration, 0 to 1
  /// The trial's own windows of Exemplars::contacts, in (fractional) frames; empty where touch
  /// tells them.
  std::vector<ContactWindow> own_contacts;
  /// Poses over time of each object that moved, the reference frame of the tool at each frame;
  /// empty for one that rested.
  std::vector<std::vector<geometry::Pose>> moving;

  const geometry::Pose& ObjectAt(int object, int frame) const {
    const auto o = static_cast<std::size_t>(object);
    return moving[o].empty() ? situation.base_T_object[o]
                             : moving[o][static_cast<std::size_t>(frame)];
  }
};

/// A stretch in which the tools met an object.
struct ContactSpan {
  int object = 0;
  int first = 0;
  int last = 0;
  bool touch_measured = false;
  /// The frame at which the place of contact counts: the onset of touch, else the stillest.
  int meets = 0;
  bool at_one_time = false;  ///< the trials are aligned so that all are in contact at these frames
};

/// Trials that copies of the list share: a list is copied without its trials. Thread-compatible.
class SharedTrials {
 public:
  std::size_t size() const { return trials_.size(); }
  bool empty() const { return trials_.empty(); }
  const ExemplarTrial& operator[](std::size_t j) const { return *trials_[j]; }
  const ExemplarTrial& front() const { return *trials_.front(); }
  void Add(ExemplarTrial trial) {
    trials_.push_back(std::make_shared<ExemplarTrial>(std::move(trial)));
  }
  void Replace(std::size_t j, ExemplarTrial trial) {
    trials_[j] = std::make_shared<ExemplarTrial>(std::move(trial));
  }
  /// To change it: a trial that another list holds too is copied first.
  ExemplarTrial& Edit(std::size_t j) {
    if (trials_[j].use_count() > 1) Replace(j, *trials_[j]);
    return *trials_[j];
  }
  /// Frees the joints of a trial that no other list holds.
  void DropJoints(std::size_t j) {
    if (trials_[j].use_count() == 1) trials_[j]->joints.resize(0, 0);
  }
  void Share(const SharedTrials& others, std::size_t j) { trials_.push_back(others.trials_[j]); }
  void Remove(std::size_t j) { trials_.erase(trials_.begin() + static_cast<std::ptrdiff_t>(j)); }

  class Iterator {
   public:
    explicit Iterator(const std::shared_ptr<ExemplarTrial>* at) : at_(at) {}
    const ExemplarTrial& operator*() const { return **at_; }
    Iterator& operator++() {
      ++at_;
      return *this;
    }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    const std::shared_ptr<ExemplarTrial>* at_;
  };
  Iterator begin() const { return Iterator(trials_.data()); }
  Iterator end() const { return Iterator(trials_.data() + trials_.size()); }

 private:
  std::vector<std::shared_ptr<ExemplarTrial>> trials_;  // shared so that copies cost nothing
};

struct Exemplars {
  int frames = 0;
  std::vector<std::string> object_names;
  std::vector<bool> object_has_orientation;
  int target = -1;  ///< index of the object that the skill is about; -1 without objects
  bool has_tool = false;
  bool has_orientation = true;
  std::vector<std::string> joint_names;
  SharedTrials trials;
  std::vector<ContactSpan> contacts;

  int size() const { return static_cast<int>(trials.size()); }
  int objects() const { return static_cast<int>(object_names.size()); }
  int joints() const { return static_cast<int>(joint_names.size()); }
  /// Tool positions of a trial, frames x 3; in the base frame or relative to an object (shifted,
  /// not turned).
  Eigen::MatrixXd BasePath(int trial) const;
  Eigen::MatrixXd ShiftedPath(int trial, int object) const;
  /// The first contact with `object`, if any.
  std::optional<int> FirstContact(int object) const;
  /// The others; no trial is copied.
  Exemplars Without(int trial) const;
  /// These trials, in this order; none is copied.
  Exemplars Only(std::span<const int> chosen) const;
  /// Gives up what moves beside the tool: joints, hand, touch and the tool's orientation.
  void KeepPathsOnly();
  /// Gives up touch and the trials' own times, which no model needs.
  void DropTimes();
  /// Without streams, but for the first trial's tool path.
  Exemplars SituationsOnly() const;
};

/// Gathers the warped streams. `target` empty: the object towards whose frame the paths converge
/// most. `tool` orders the joints (all of the trials' without it). Precondition: alignment holds a
/// trial; objects, joints and streams are the same in all (LearnSkill checks).
Exemplars BuildExemplars(const Alignment& alignment, const std::string& target,
                         const demonstration::ToolKinematics* tool);

}  // namespace exemplar::learning

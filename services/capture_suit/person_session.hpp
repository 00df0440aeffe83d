#pragma once
// A simulated person in the suit, in real time.

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "capture_suit/dead_man.hpp"
#include "capture_suit/recorder_remote.hpp"
#include "capture_suit/session.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/reaching/person.hpp"
#include "exemplar/scene/description.hpp"

namespace exemplar::capture_suit {

struct PersonSessionOptions {
  std::string object = {};        ///< the button to press; empty: the scene's first
  std::string places = {};        ///< as ParsePlaces reads them; empty: where the button is
  std::string name = {};          ///< of the recordings
  std::string demonstrator = {};  ///< whose demonstrations: a pseudonymous id for the recordings
  bool dead_man = false;          ///< hold it, and begin when the robot follows
  bool record = false;            ///< tell the recorder
  bool place_only = false;        ///< put the button at each place and press nothing
  double press_depth_m = 0;       ///< 0: the button's travel and a little more
  double settle_s = 1.0;          ///< from placing the button until the trial may start
  reaching::PersonOptions person = {};  ///< its press_depth_m is set from the above
};

/// For every place: tells the simulator to put the button there, moves to the start of the trial,
/// has it recorded, and sends the person's joints on ircp/suit.
class PersonSession final : public Session {
 public:
  static Result<std::unique_ptr<PersonSession>> Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                       const kinematics::RobotDescription& robot,
                                                       const scene::Description& scene,
                                                       const PersonSessionOptions& options);

  Status Run(std::stop_token stop) override;
  std::vector<ircp::TopicCount> sent() const override;
  std::map<std::string, int> readers() const override;
  std::uint64_t trials_ended() const override { return trials_ended_; }

 private:
  PersonSession(const Clock& clock, Log& log, scene::Button button,
                std::vector<geometry::Pose> places, reaching::Person person,
                const PersonSessionOptions& options);

  Status Perform(std::size_t index, std::stop_token stop);
  /// Sends a smooth way from where the suit is to `goal`.
  Status MoveTo(const Eigen::VectorXd& goal, double seconds, const std::stop_token& stop);
  /// Sends the last posture again and again meanwhile, as a suit does whose wearer stands still.
  Status WhileStill(const std::function<Status()>& work, const std::stop_token& stop);
  /// The same as long as `goes_on`, which is asked before each sample.
  Status StandStill(const std::function<bool()>& goes_on, const std::stop_token& stop);
  /// Presses the dead-man and waits for the robot, where there is one to wait for.
  Status BeFollowed(const std::stop_token& stop);
  Status Send(const Eigen::Ref<const Eigen::VectorXd>& posture);
  bool WaitForAcknowledgments(const std::stop_token& stop);

  const Clock& clock_;
  Log& log_;
  scene::Button button_;
  std::vector<geometry::Pose> places_;
  reaching::Person person_;
  PersonSessionOptions options_;
  Eigen::VectorXd posture_;  ///< sent last
  std::atomic<std::uint64_t> trials_ended_{0};
  std::unique_ptr<ircp::Writer<ircp::SuitSample>> suit_;
  std::unique_ptr<ircp::ControlClient> simulator_;
  std::optional<RecorderRemote> recorder_;
  std::unique_ptr<DeadMan> dead_man_;             ///< null: nobody holds one
  std::unique_ptr<ircp::ControlServer> control_;  ///< destroyed first: it asks suit_ for its count
};

}  // namespace exemplar::capture_suit

#pragma once
// A simulated person with a hand, who takes an object and lays it down elsewhere, in real time.

#include <atomic>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

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

struct CarrySessionOptions {
  std::string object = {};        ///< what is taken; a movable object of the scene
  std::string to = {};            ///< upon what it is laid; an object of the scene
  std::string places = {};        ///< of `object`, as ParsePlaces reads them; empty: where it is
  std::string to_places = {};     ///< of `to`, as many; empty: where it is
  std::string name = {};          ///< of the recordings
  std::string demonstrator = {};  ///< whose demonstrations: a pseudonymous id for the recordings
  bool record = false;            ///< tell the recorder
  double settle_s = 1.0;          ///< from placing the objects until the trial may start
  reaching::PersonOptions person = {};
};

/// For every pair of places: tells the simulator to put the objects there, moves to the start of
/// the trial, has it recorded, and sends the person's joints on ircp/suit and the hand's opening on
/// ircp/end_effector.
class CarrySession final : public Session {
 public:
  static Result<std::unique_ptr<CarrySession>> Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                      const kinematics::RobotDescription& robot,
                                                      const scene::Description& scene,
                                                      const CarrySessionOptions& options);

  Status Run(std::stop_token stop) override;
  std::vector<ircp::TopicCount> sent() const override;
  std::map<std::string, int> readers() const override;
  std::uint64_t trials_ended() const override { return trials_ended_; }

 private:
  struct Places {
    geometry::Pose base_T_from, base_T_to;
  };
  CarrySession(const Clock& clock, Log& log, scene::Object from, scene::Object to,
               std::vector<Places> places, reaching::Person person,
               const CarrySessionOptions& options);

  Status Perform(std::size_t index, const std::stop_token& stop);
  Status MoveTo(const Eigen::VectorXd& goal, double seconds, const std::stop_token& stop);
  Status Send(const Eigen::Ref<const Eigen::VectorXd>& posture, double open);
  bool WaitForAcknowledgments(const std::stop_token& stop);

  const Clock& clock_;
  Log& log_;
  const scene::Object from_, to_;
  const std::vector<Places> places_;
  reaching::Person person_;
  const CarrySessionOptions options_;
  Eigen::VectorXd posture_;  ///< sent last
  std::atomic<std::uint64_t> trials_ended_{0};
  std::unique_ptr<ircp::Writer<ircp::SuitSample>> suit_;
  std::unique_ptr<ircp::Writer<ircp::EndEffectorSample>> glove_;
  std::unique_ptr<ircp::ControlClient> simulator_;
  std::optional<RecorderRemote> recorder_;
  std::unique_ptr<ircp::ControlServer> control_;  ///< destroyed first: it asks for the counts
};

}  // namespace exemplar::capture_suit

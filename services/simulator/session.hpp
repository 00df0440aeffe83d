#pragma once
// The simulated robot as its neighbours on the network know it: it follows joint commands (or a
// person's suit), says where its joints are and what its finger feels, shows what its cameras see.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "exemplar/base/clock.hpp"
#include "exemplar/base/log.hpp"
#include "exemplar/base/result.hpp"
#include "exemplar/ircp/bus.hpp"
#include "exemplar/ircp/simulated_time.hpp"
#include "exemplar/kinematics/robot_description.hpp"
#include "exemplar/scene/description.hpp"
#include "simulator/follower.hpp"
#include "simulator/world.hpp"

namespace exemplar::simulator {

/// Whom the robot follows.
enum class Leader { kCommand, kSuit };

/// Standard deviations of what is added to each measured value. The same seed gives the same noise.
struct SensorNoise {
  double position_rad = 0;    ///< or m
  double velocity_rad_s = 0;  ///< or m/s
  double touch_n = 0;
  double object_m = 0;    ///< of tracked things, along each axis
  double object_rad = 0;  ///< likewise, about each axis
  std::uint64_t seed = 1;
};

struct SessionOptions {
  Leader leader = Leader::kCommand;
  double rate_hz = 125;  ///< of ircp/joint_state
  /// Of ircp/objects: every button and object, as a tracking system would measure it; 0: none, and
  /// cameras see what has a marker.
  double track_hz = 0;
  bool cameras = true;
  /// Where pictures go, which would be in the way of the rest; null: to the session's own. Outlives
  /// the session.
  ircp::Bus* picture_bus = nullptr;
  /// "jpeg" or "png", and the former's quality.
  std::string picture_encoding = "jpeg";
  int picture_quality = 95;
  WorldOptions world = {};
  FollowerOptions follower = {};
  /// Simulated seconds a second; 0: as fast as everybody in step can. Other than 1, or with anybody
  /// in step: the simulated time goes out on ircp/clock (ircp/simulated_time.hpp).
  double pace = 1;
  /// Programs that follow the simulated time: it waits for them.
  std::vector<std::string> in_step_with = {};
  /// In step: once nobody has commanded the robot for so long (simulated), time stands still until
  /// somebody does: a motion then begins at a time that no request's arrival decides. 0: it goes
  /// on.
  Duration stand_after{0};
  /// In step: what the wall clock says at the beginning; the machine's, when absent.
  std::optional<Stamp> epoch = {};
  /// Set to the simulated wall time where that goes out; whoever stamps the session's samples and
  /// answers for it goes by this clock. May be null; outlives the session.
  ircp::LeaderClock* leader_clock = nullptr;
  /// From a command's arrival until the servos hear of it.
  Duration command_delay{0};
  SensorNoise noise = {};
};

/// Name of the touch sensor on ircp/joint_state: the sum over the robot's touch links.
inline constexpr const char* kTouchSensor = "finger";

/// How it goes.
struct Figures {
  double time_s = 0;    ///< simulated
  bool stands = false;  ///< time does, until somebody commands the robot
  std::string mode;     ///< "holding", "following", "going home"
  double touch_n = 0;
  double hand_open = 1;
  std::map<std::string, std::uint64_t> clicks;  ///< by button
  std::map<std::string, double> last_click_s;   ///< simulated; of those that clicked
  std::uint64_t refused = 0;                    ///< samples without sense for this robot
  std::uint64_t overrun = 0;                    ///< samples dropped: they came too fast
  std::uint64_t stale = 0;                      ///< times that samples stopped coming
  std::uint64_t slips = 0;                      ///< times that the world fell behind the clock
  std::uint64_t faults = 0;
  std::uint64_t states_dropped = 0;
  std::uint64_t pictures_skipped = 0;
};

/// Commands it answers (ircp/control.hpp, program "simulator"):
///   place{object, x, y [, z] [, qx, qy, qz, qw]}  what is left out stays as it is; also obstacles
///   and objects
///   home{}           back to the home posture at a gentle speed; the answer's `seconds` says when
///   reset_clicks{}
/// Its status carries `sim_time_s`, `mode`, `clicks.<button>`, `last_click_s.<button>`,
/// `position.<button or object>` ("x,y,z,qx,qy,qz,qw"), `hand_open` and counts of what went wrong.
class Session {
 public:
  /// `bus`, `clock` and `log` outlive the session.
  static Result<std::unique_ptr<Session>> Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                 const kinematics::RobotDescription& robot,
                                                 const scene::Description& scene,
                                                 const SessionOptions& options = {});
  virtual ~Session() = default;
  /// Steps the world until `stop`, in pace with the clock or in step with others. Call once.
  virtual void Run(std::stop_token stop) = 0;

  // For metrics; thread-safe.
  virtual Figures figures() const = 0;
  virtual std::vector<ircp::TopicCount> sent() const = 0;
  virtual std::string leader_topic() const = 0;
  virtual const ircp::Reader& leader_reader() const = 0;
};

}  // namespace exemplar::simulator

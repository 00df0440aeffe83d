#include "hand_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "exemplar/base/text.hpp"

namespace exemplar::reaching {
namespace {

using Eigen::Vector3d;

// Figures of human reaching; each trial varies around them.
constexpr double kReactionTime = 0.5;        // s
constexpr double kHover = 0.025;             // m above the target, where the reach ends
constexpr double kLift = 0.035;              // m
constexpr double kPushTime = 0.75;           // s
constexpr double kHoldTime = 0.35;           // s
constexpr double kLiftTime = 0.45;           // s
constexpr double kClearOfThings = 0.12;      // m, above what is taken or laid down
constexpr double kLowerTime = 0.9;           // s
constexpr double kPauseTime = 0.25;          // s
constexpr double kGripTime = 0.5;            // s, from open to closed
constexpr double kRestTime = 0.4;            // s, after the way back
constexpr double kFirstShare = 0.96;         // of the distance, by the first submovement
constexpr double kRise = 0.08;               // of the distance, above the straight line
constexpr double kSpeedNoise = 0.09;         // of the speed: an endpoint spread of 3 to 5 %
constexpr double kSpeedNoiseMemory = 0.06;   // s
constexpr double kSeeingNoise = 1.2e-3;      // m, of the distance finger to target
constexpr double kTremorAmplitude = 0.8e-4;  // m, of each of two components

/// Flash & Hogan's minimum-jerk course from 0 to 1.
double MinimumJerk(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10 + s * (-15 + 6 * s));
}

/// A detour that leaves and comes back at rest; 1 half way.
double Detour(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return 64 * std::pow(s * (1 - s), 3);
}

struct Submovement {
  double start_s = 0;
  double duration_s = 1;
  Vector3d displacement = Vector3d::Zero();
  Vector3d detour = Vector3d::Zero();

  Vector3d At(double t) const {
    const double s = (t - start_s) / duration_s;
    return MinimumJerk(s) * displacement + Detour(s) * detour;
  }
  double end_s() const { return start_s + duration_s; }
};

/// A vector that moves by overlapping submovements.
class Course {
 public:
  explicit Course(const Vector3d& start) : start_(start) {}
  void Add(const Submovement& submovement) { submovements_.push_back(submovement); }
  Vector3d At(double t) const {
    Vector3d sum = start_;
    for (const Submovement& submovement : submovements_) sum += submovement.At(t);
    return sum;
  }
  /// Where it comes to when nothing is added.
  Vector3d End() const { return At(std::numeric_limits<double>::max()); }
  double end_s() const {
    double last = 0;
    for (const Submovement& submovement : submovements_) last = std::max(last, submovement.end_s());
    return last;
  }

 private:
  Vector3d start_;
  std::vector<Submovement> submovements_;
};

class Hand {
 public:
  Hand(const Vector3d& rest, const Vector3d& pointing, const PersonOptions& options, double step_s,
       Rng rng)
      : options_(options),
        step_s_(step_s),
        rng_(rng),
        rest_(rest),
        rest_pointing_(pointing),
        tip_(rest),
        pointing_(pointing) {
    tempo_ = options.tempo * std::exp(0.15 * Vary());
    for (Vector3d* phases : {&tremor_phase_[0], &tremor_phase_[1]}) {
      for (int i = 0; i < 3; ++i) (*phases)[i] = rng_.Uniform(0, 2 * std::numbers::pi);
    }
    tremor_hz_[0] = rng_.Uniform(8, 10);
    tremor_hz_[1] = rng_.Uniform(10, 12);
    path_.step_s = step_s;
    Advance(Time(kReactionTime, 0.25));
  }

  void Press(const HandTarget& target) {
    PressTruth truth;
    truth.reach_onset_s = Now();
    const double hover = kHover * Around(0.25);
    Reach(target.base_p_contact + hover * target.base_normal, target.base_pointing, 2);

    const double hesitation = options_.variation_scale * rng_.Uniform(-0.1, 0.25) / tempo_;
    Advance(tip_.end_s() - Now() + hesitation);
    truth.press_onset_s = Now();
    const double depth = options_.press_depth_m * Around(0.12);
    const Vector3d bottom = target.base_p_contact - depth * target.base_normal;
    Vector3d push = bottom - Arrival();
    push += Seeing(target.base_normal);
    const double push_time = Time(kPushTime, 0.15);
    tip_.Add({Now(), push_time, push});
    Advance(push_time + Time(kHoldTime, 0.35));

    truth.release_onset_s = Now();
    const double lift_time = Time(kLiftTime, 0.15);
    tip_.Add({Now(), lift_time, (depth + kLift * Around(0.2)) * target.base_normal});
    // The way back, or on, begins before the lift has ended.
    Advance(0.65 * lift_time);
    path_.presses.push_back(truth);
  }

  /// Down to the target, there the hand goes to `open`, and up again. Returns when it began to.
  double Handle(const HandTarget& target, double open) {
    const double rise = kClearOfThings * Around(0.1);
    Reach(target.base_p_contact + rise * target.base_normal, target.base_pointing, 2);
    Advance(tip_.end_s() - Now() + Time(kPauseTime, 0.2));
    const double lower_time = Time(kLowerTime, 0.15);
    tip_.Add({Now(), lower_time, target.base_p_contact - Arrival() + Seeing(target.base_normal)});
    Advance(lower_time + Time(kPauseTime, 0.2));
    const double begin_s = Now();
    goal_open_ = open;
    Advance(kGripTime + Time(kPauseTime, 0.2));
    const double lift_time = Time(kLowerTime, 0.15);
    tip_.Add({Now(), lift_time, rise * target.base_normal});
    Advance(0.8 * lift_time);
    return begin_s;
  }

  void Carry(const HandTarget& from, const HandTarget& to) {
    path_.carry.grasp_s = Handle(from, 0);
    path_.carry.release_s = Handle(to, 1);
  }

  void Retract() {
    const Vector3d off = options_.variation_scale * 0.008 * Normals();
    Reach(rest_ + off, rest_pointing_, 1);
    Advance(tip_.end_s() - Now());
    path_.end_s = Now();
    Advance(Time(kRestTime, 0.3));
  }

  HandPath Take() && { return std::move(path_); }

 private:
  double Now() const { return step_s_ * static_cast<double>(steps_); }
  double Vary() { return options_.variation_scale * rng_.Normal(); }
  double Around(double deviation) { return std::clamp(1 + deviation * Vary(), 0.4, 1.8); }
  double Time(double seconds, double deviation) { return seconds * Around(deviation) / tempo_; }
  Vector3d Normals() {
    const double x = rng_.Normal();
    const double y = rng_.Normal();
    return {x, y, rng_.Normal()};
  }
  /// Error of what the eyes tell, across `line_of_push`: depth is felt, not seen.
  Vector3d Seeing(const Vector3d& line_of_push) {
    const Vector3d noise = options_.noise_scale * kSeeingNoise * Normals();
    return noise - noise.dot(line_of_push) * line_of_push;
  }
  /// Where the tip will come to, with what noise has done up to now.
  Vector3d Arrival() const { return tip_.End() + drift_; }

  void Reach(const Vector3d& aim, const Vector3d& pointing, int corrections) {
    const Vector3d way = aim - Arrival();
    const double distance = way.norm();
    const double duration = Time(0.4 + 0.9 * std::sqrt(distance), 0.1);
    const double share = std::clamp(
        options_.variation_scale == 0 ? kFirstShare : kFirstShare + 0.025 * Vary(), 0.85, 1.05);
    tip_.Add({Now(), duration, share * way, DetourOf(way)});
    pointing_.Add({Now(), duration, pointing - pointing_.End()});
    double next =
        rng_.Uniform(0.6, 0.6 + 0.15 * std::min(1.0, options_.variation_scale)) * duration;
    for (int i = 0; i < corrections; ++i) {
      Advance(next);
      Vector3d error = aim - Arrival();
      error += options_.noise_scale * kSeeingNoise * Normals();
      const double correction_time = Time(0.32, 0.15);
      tip_.Add({Now(), correction_time, error});
      next = 0.7 * correction_time;
    }
  }

  /// Reaches bow upwards, and to a side that changes.
  Vector3d DetourOf(const Vector3d& way) {
    const double rise = kRise * Around(0.4);
    const double side = 0.03 * Vary();
    const double distance = way.norm();
    if (distance < 1e-6) return Vector3d::Zero();
    const Vector3d along = way / distance;
    const Vector3d up = Vector3d::UnitZ() - along.z() * along;
    const Vector3d across = along.cross(Vector3d::UnitZ());
    return distance * (rise * up + side * across);
  }

  void Advance(double duration) {
    const double noise_decay = std::exp(-step_s_ / kSpeedNoiseMemory);
    const double noise_gain = std::sqrt(1 - noise_decay * noise_decay);
    for (long n = std::lround(duration / step_s_); n > 0; --n) {
      const double t = Now();
      const Vector3d planned = tip_.At(t);
      if (steps_ > 0) {
        motor_noise_ = noise_decay * motor_noise_ + noise_gain * Normals();
        drift_ +=
            options_.noise_scale * kSpeedNoise * (planned - planned_before_).norm() * motor_noise_;
      }
      planned_before_ = planned;
      path_.base_p_tip.push_back(planned + drift_ + Tremor(t));
      path_.base_pointing.push_back(pointing_.At(t).normalized());
      path_.open.push_back(open_);
      const double most = step_s_ / kGripTime;
      open_ += std::clamp(goal_open_ - open_, -most, most);
      ++steps_;
    }
  }

  Vector3d Tremor(double t) const {
    Vector3d sum = Vector3d::Zero();
    for (int k = 0; k < 2; ++k) {
      const double angle = 2 * std::numbers::pi * tremor_hz_[k] * t;
      sum.array() += (tremor_phase_[k].array() + angle).sin();
    }
    return options_.noise_scale * kTremorAmplitude * sum;
  }

  const PersonOptions& options_;
  const double step_s_;
  Rng rng_;
  const Vector3d rest_, rest_pointing_;
  Course tip_, pointing_;
  double open_ = 1;
  double goal_open_ = 1;
  double tempo_ = 1;
  double tremor_hz_[2] = {};
  Vector3d tremor_phase_[2];
  Vector3d motor_noise_ = Vector3d::Zero();
  Vector3d drift_ = Vector3d::Zero();
  Vector3d planned_before_ = Vector3d::Zero();
  long steps_ = 0;
  HandPath path_;
};

/// Where the tip crosses the target's face between two times, or a negative time.
double Crossing(const HandPath& path, const HandTarget& target, double from_s, double to_s,
                bool inward) {
  const auto height = [&](std::size_t i) {
    return target.base_normal.dot(path.base_p_tip[i] - target.base_p_contact);
  };
  const std::size_t first = static_cast<std::size_t>(std::lround(from_s / path.step_s));
  const std::size_t last = std::min(path.base_p_tip.size() - 1,
                                    static_cast<std::size_t>(std::lround(to_s / path.step_s)));
  for (std::size_t i = first; i < last; ++i) {
    const double a = height(i);
    const double b = height(i + 1);
    if (inward ? a > 0 && b <= 0 : a <= 0 && b > 0) {
      return path.step_s * (static_cast<double>(i) + a / (a - b));
    }
  }
  return -1;
}

}  // namespace

Result<HandPath> SimulateHand(const Vector3d& base_p_rest, const Vector3d& base_rest_pointing,
                              std::span<const HandTarget> targets, const PersonOptions& options,
                              double step_s, Rng rng) {
  Hand hand(base_p_rest, base_rest_pointing, options, step_s, rng);
  for (const HandTarget& target : targets) hand.Press(target);
  hand.Retract();
  HandPath path = std::move(hand).Take();
  for (std::size_t i = 0; i < targets.size(); ++i) {
    PressTruth& truth = path.presses[i];
    truth.contact_onset_s =
        Crossing(path, targets[i], truth.press_onset_s, truth.release_onset_s, true);
    truth.contact_end_s = Crossing(path, targets[i], truth.release_onset_s, path.end_s, false);
    if (truth.contact_onset_s < 0 || truth.contact_end_s < 0) {
      return FailedPrecondition("the finger missed target " + std::to_string(i + 1) +
                                    ": noise_scale " + FormatDouble(options.noise_scale) +
                                    " is too much for a press of " +
                                    FormatDouble(options.press_depth_m) + " m",
                                "noise_scale");
    }
    const double at = truth.contact_onset_s / step_s;
    const std::size_t before = static_cast<std::size_t>(at);
    const Vector3d& a = path.base_p_tip[before];
    truth.base_p_contact =
        a + (at - static_cast<double>(before)) * (path.base_p_tip[before + 1] - a);
  }
  return path;
}

HandPath SimulateCarry(const Vector3d& base_p_rest, const HandTarget& from, const HandTarget& to,
                       const PersonOptions& options, double step_s, Rng rng) {
  Hand hand(base_p_rest, from.base_pointing, options, step_s, rng);
  hand.Carry(from, to);
  hand.Retract();
  return std::move(hand).Take();
}

}  // namespace exemplar::reaching

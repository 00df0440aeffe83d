#include "executor/state_stream.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "exemplar/base/text.hpp"

namespace exemplar::executor {
namespace {

std::string Seconds(Duration duration) { return FormatFixed(ToSeconds(duration), 2) + " s"; }

}  // namespace

std::optional<std::string> StateStream::Judge(const MeasuredState& state,
                                              const Eigen::VectorXd& commanded, std::uint64_t sent,
                                              Duration period) {
  if (!last_) {
    changed_ = last_current_ = state.received;
    commanded_then_ = commanded;
  }
  std::optional<std::string> wrong = Jump(state);
  // Each keeps count, whatever the others say.
  for (std::optional<std::string>& found :
       std::array{Frozen(state, commanded), Delay(state), CommandAge(state, sent, period)}) {
    if (!wrong) wrong = std::move(found);
  }
  last_ = state;
  return wrong;
}

std::optional<std::string> StateStream::Jump(const MeasuredState& state) const {
  if (!last_) return std::nullopt;
  const double apart_s = ToSeconds(std::max(state.received - last_->received, limits_.burst));
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    const double way = std::abs(state.joints[k] - last_->joints[k]);
    const double most =
        limits_.jump_factor * joints_[j].velocity * apart_s + limits_.jump_margin_rad;
    if (way > most) {
      return "joint \"" + joint_names_[j] + "\" is measured " + FormatFixed(way, 3) +
             " rad from where it was measured " + FormatFixed(apart_s, 3) + " s before, which is " +
             FormatFixed(most, 3) + " at most: its state jumps";
    }
  }
  return std::nullopt;
}

std::optional<std::string> StateStream::Frozen(const MeasuredState& state,
                                               const Eigen::VectorXd& commanded) {
  if (!last_ || state.joints != last_->joints) {
    changed_ = state.received;
    commanded_then_ = commanded;
    return std::nullopt;
  }
  const Duration still = state.received - changed_;
  const double asked = (commanded - commanded_then_).cwiseAbs().maxCoeff();
  if (still < limits_.frozen_patience || asked < limits_.frozen_motion_rad) return std::nullopt;
  return "the robot's joint state is frozen: the same for " + Seconds(still) +
         " while the commands moved by " + FormatFixed(asked, 3) + " rad";
}

std::optional<std::string> StateStream::Delay(const MeasuredState& state) {
  const Duration delay = state.received - Duration(state.stamp.nanoseconds());
  least_delay_ = std::min(least_delay_.value_or(delay), delay);
  if (delay - *least_delay_ <= limits_.delay_patience) return std::nullopt;
  return "the robot's joint states come " + Seconds(delay - *least_delay_) +
         " later than before, by their stamps; " + Seconds(limits_.delay_patience) + " allowed";
}

std::optional<std::string> StateStream::CommandAge(const MeasuredState& state, std::uint64_t sent,
                                                   Duration period) {
  if (state.command_seq == 0) return std::nullopt;  // it does not say
  Duration age = state.received - last_current_;
  if (state.command_seq <= sent) {
    last_current_ = state.received;
    age = static_cast<std::int64_t>(sent - state.command_seq) * period;
  }
  if (age <= limits_.command_patience) return std::nullopt;
  return "the robot acts on commands that are " + Seconds(age) + " old, " +
         Seconds(limits_.command_patience) + " allowed";
}

}  // namespace exemplar::executor

#include "reference_driver/driver.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "robots.hpp"

namespace exemplar::reference_driver {
namespace {

using std::chrono::milliseconds;

class ReferenceDriver : public ::testing::Test {
 protected:
  Eigen::VectorXd positions() const {
    const ircp::JointStateSample state = driver_.State();
    return Eigen::Map<const Eigen::VectorXd>(state.positions.data(), robot_.chain.dof());
  }
  ircp::JointCommandSample CommandTo(const Eigen::VectorXd& q, double speed = 0) {
    ircp::JointCommandSample command;
    command.header.seq = ++seq_;
    command.names = robot_.chain.joint_names();
    command.positions.assign(q.data(), q.data() + q.size());
    command.velocities.assign(command.names.size(), speed);
    command.validity = milliseconds(100);
    return command;
  }
  void StepUntil(Duration until) {
    for (; now_ < until; now_ += milliseconds(8)) driver_.Step(now_);
  }

  const kinematics::RobotDescription robot_ = simulator::Robot("arm7");
  Driver driver_{robot_.chain.joint_names(), robot_.chain.limits(), robot_.home};
  Duration now_{0};
  std::uint64_t seq_ = 0;
};

TEST_F(ReferenceDriver, FollowsCommandsAndNamesTheLastOne) {
  StepUntil(milliseconds(80));
  const Eigen::VectorXd goal = robot_.home.array() + 0.01;
  ASSERT_TRUE(driver_.Take(CommandTo(goal), now_));
  StepUntil(milliseconds(160));
  EXPECT_NEAR((positions() - goal).cwiseAbs().maxCoeff(), 0, 1e-12);
  EXPECT_EQ(driver_.State().command_seq, 1u);
}

TEST_F(ReferenceDriver, BrakesAndHoldsWhenCommandsStopComing) {
  StepUntil(milliseconds(80));
  const double speed = 0.4;
  for (int i = 0; i < 20; ++i) {
    const double way = speed * 0.008 * i;
    ASSERT_TRUE(driver_.Take(CommandTo(robot_.home.array() + way, speed), now_));
    StepUntil(now_ + milliseconds(8));
  }
  EXPECT_NEAR(driver_.State().velocities.front(), speed, 1e-9);
  const Eigen::VectorXd before = positions();
  StepUntil(now_ + milliseconds(1000));
  EXPECT_FALSE(driver_.is_following());
  EXPECT_EQ(driver_.stale(), 1u);
  const Eigen::VectorXd held = positions();
  // As long as the command was valid, and the way of braking.
  EXPECT_LT((held - before).cwiseAbs().maxCoeff(), speed * 0.12 + speed * speed / 2 / 6 + 0.005);
  StepUntil(now_ + milliseconds(1000));
  EXPECT_EQ(positions(), held);
  for (const double v : driver_.State().velocities) EXPECT_EQ(v, 0);
}

TEST_F(ReferenceDriver, NeverLeavesPositionAndSpeedLimits) {
  StepUntil(milliseconds(8));
  Eigen::VectorXd last = positions();
  for (int i = 0; i < 500; ++i) {
    ASSERT_TRUE(driver_.Take(CommandTo(Eigen::VectorXd::Constant(robot_.chain.dof(), 1e3)), now_));
    StepUntil(now_ + milliseconds(8));
    const Eigen::VectorXd now = positions();
    for (int j = 0; j < robot_.chain.dof(); ++j) {
      const kinematics::JointLimits& limit = robot_.chain.limits()[static_cast<std::size_t>(j)];
      ASSERT_LE(now[j], limit.upper);
      ASSERT_LE(std::abs(now[j] - last[j]), limit.velocity * 0.008 + 1e-12);
    }
    last = now;
  }
}

TEST_F(ReferenceDriver, RefusesCommandsWithoutSense) {
  StepUntil(milliseconds(8));
  ircp::JointCommandSample strange = CommandTo(robot_.home);
  for (std::string& name : strange.names) name += "?";
  EXPECT_FALSE(driver_.Take(strange, now_));
  ircp::JointCommandSample uneven = CommandTo(robot_.home);
  uneven.positions.pop_back();
  EXPECT_FALSE(driver_.Take(uneven, now_));
  ircp::JointCommandSample infinite = CommandTo(robot_.home);
  infinite.positions.front() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(driver_.Take(infinite, now_));
  EXPECT_EQ(driver_.refused(), 3u);
  EXPECT_FALSE(driver_.is_following());
}

TEST_F(ReferenceDriver, LeavesJointsThatACommandDoesNotName) {
  StepUntil(milliseconds(8));
  ircp::JointCommandSample one = CommandTo(robot_.home);
  one.names = {robot_.chain.joint_names()[2]};
  one.positions = {robot_.home[2] + 0.01};
  one.velocities.clear();
  ASSERT_TRUE(driver_.Take(one, now_));
  StepUntil(milliseconds(100));
  Eigen::VectorXd goal = robot_.home;
  goal[2] += 0.01;
  EXPECT_NEAR((positions() - goal).cwiseAbs().maxCoeff(), 0, 1e-12);
}

}  // namespace
}  // namespace exemplar::reference_driver

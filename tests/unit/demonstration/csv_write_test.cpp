#include <cmath>

#include "csv_builder.hpp"
#include "exemplar/base/rng.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::demonstration {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Eigen::Quaterniond RandomRotation(Rng& rng) {
  Eigen::Vector4d xyzw;
  for (double& c : xyzw) c = rng.Normal();
  return Eigen::Quaterniond(xyzw).normalized();
}

/// All groups on shared time stamps.
Trial RandomTrial(Rng& rng, int samples) {
  Trial trial;
  std::vector<double> time_s = {0};
  while (static_cast<int>(time_s.size()) < samples) {
    time_s.push_back(time_s.back() + rng.Uniform(1e-3, 1e-2));
  }
  const auto scalars = [&](std::vector<std::string> names) {
    ScalarSeries series{std::move(names), time_s, {}};
    series.values.resize(samples, static_cast<Eigen::Index>(series.names.size()));
    for (Eigen::Index i = 0; i < series.values.size(); ++i) series.values(i) = rng.Uniform();
    return series;
  };
  const auto poses = [&](const std::string& name, bool has_orientation) {
    PoseSeries series{name, time_s, {}, has_orientation};
    for (int i = 0; i < samples; ++i) {
      geometry::Pose& pose = series.base_T_frame.emplace_back();
      pose.translation = {rng.Normal(), rng.Normal(), rng.Normal()};
      if (has_orientation) pose.rotation = RandomRotation(rng);
    }
    geometry::MakeSignsContinuous(series.base_T_frame);
    return series;
  };
  trial.joints = scalars({"elbow", "rail", "wrist"});
  trial.prismatic_joints = {"rail"};
  trial.measured_joints = scalars({"elbow", "rail"});
  trial.end_effectors = {poses("", true), poses("left", false)};
  trial.objects = {poses("box", true), poses("red_mark", false)};
  trial.hands = scalars({"", "left"});
  trial.tactile = scalars({"tip", "palm_2"});
  trial.wrench = scalars({"fx", "fy", "fz", "tx", "ty", "tz"});
  trial.label = scalars({"label"});
  trial.label.values = trial.label.values.unaryExpr([](double v) { return std::floor(4 * v); });
  return trial;
}

TEST(WriteCsv, ReadsBackTheSameSamples) {
  Rng rng(7);
  for (int i = 0; i < 20; ++i) {
    const Trial trial = RandomTrial(rng, 2 + static_cast<int>(rng.Below(60)));
    ASSERT_TRUE(Validate(trial).ok());
    EXPECT_TRUE(SameContent(MustRead(WriteCsv(trial)), trial));
  }
}

TEST(WriteCsv, PutsSlowStreamsOntoTheDensestOne) {
  Trial trial;
  trial.joints = {{"a"}, {0, 0.1, 0.2, 0.3, 0.4}, Eigen::MatrixXd::Zero(5, 1)};
  trial.tactile = {{"t"}, {0.1, 0.3}, Eigen::MatrixXd(2, 1)};
  trial.tactile.values << 2, 4;
  trial.label = {{"label"}, {0, 0.3}, Eigen::MatrixXd(2, 1)};
  trial.label.values << 1, 2;
  const Trial written = MustRead(WriteCsv(trial));
  ASSERT_EQ(written.tactile.size(), 5u);
  EXPECT_DOUBLE_EQ(written.tactile.values(0, 0), 2);
  EXPECT_DOUBLE_EQ(written.tactile.values(2, 0), 3);
  EXPECT_DOUBLE_EQ(written.tactile.values(4, 0), 4);
  EXPECT_DOUBLE_EQ(written.label.values(2, 0), 1);
  EXPECT_DOUBLE_EQ(written.label.values(3, 0), 2);
}

TEST(Validate, NamesStreamAndIndex) {
  Rng rng(3);
  const Trial good = RandomTrial(rng, 10);
  Trial trial = good;
  trial.joints.time_s[4] = trial.joints.time_s[3];
  ASSERT_FALSE(Validate(trial).ok());
  EXPECT_THAT(Validate(trial).error().message, StartsWith("joints[4]: time is"));

  trial = good;
  trial.objects[0].base_T_frame[6].rotation.coeffs() *= -1;
  EXPECT_THAT(Validate(trial).error().message, HasSubstr("object box[6]: the quaternion flips"));

  trial = good;
  trial.tactile.values(2, 1) = std::nan("");
  EXPECT_THAT(Validate(trial).error().message, HasSubstr("tactile[2]: palm_2"));

  trial = good;
  trial.end_effectors[1].name = "";
  EXPECT_FALSE(Validate(trial).ok());

  EXPECT_FALSE(Validate(Trial{}).ok());
}

TEST(SameContent, SeesEveryStream) {
  Rng rng(5);
  const Trial trial = RandomTrial(rng, 6);
  Trial other = trial;
  other.source = "elsewhere";
  other.notices = {"mended"};
  EXPECT_TRUE(SameContent(trial, other));
  other.objects[1].base_T_frame[2].translation.x() += 1e-12;
  EXPECT_FALSE(SameContent(trial, other));
  other = trial;
  other.measured_joints.values(3, 0) += 1e-12;
  EXPECT_FALSE(SameContent(trial, other));
  other = trial;
  other.label.values(3, 0) += 1;
  EXPECT_FALSE(SameContent(trial, other));
  other = trial;
  other.hands.names[1] = "right";
  EXPECT_FALSE(SameContent(trial, other));
}

}  // namespace
}  // namespace exemplar::demonstration

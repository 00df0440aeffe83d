#include "exemplar/signal/resample.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"

namespace exemplar::signal {
namespace {

using ::testing::ElementsAre;

TEST(Resample, LinearMotionOnAnIrregularClockComesBackExactly) {
  Rng rng(1);
  std::vector<double> times = {0};
  while (times.size() < 300) times.push_back(times.back() + rng.Uniform(0.001, 0.03));
  Eigen::MatrixXd values(300, 2);
  for (int k = 0; k < 300; ++k) {
    values.row(k) << 1 + 2 * times[static_cast<std::size_t>(k)],
        -5 * times[static_cast<std::size_t>(k)];
  }
  const std::vector<double> even = EvenTimes(0, times.back(), 500);
  const Eigen::MatrixXd out = Interpolate(times, values, even);
  for (int k = 0; k < 500; ++k) {
    EXPECT_NEAR(out(k, 0), 1 + 2 * even[static_cast<std::size_t>(k)], 1e-12);
    EXPECT_NEAR(out(k, 1), -5 * even[static_cast<std::size_t>(k)], 1e-12);
  }
}

TEST(Resample, HoldsTheEndsOutside) {
  const Eigen::Vector2d values(3, 7);
  const Eigen::MatrixXd out =
      Interpolate(std::vector<double>{1, 2}, values, std::vector<double>{0, 1, 2, 9});
  EXPECT_THAT(std::vector<double>(out.data(), out.data() + 4), ElementsAre(3, 3, 7, 7));
  const Eigen::MatrixXd single = Interpolate(
      std::vector<double>{1}, Eigen::VectorXd::Constant(1, 4), std::vector<double>{0, 1, 5});
  EXPECT_EQ(single, Eigen::MatrixXd::Constant(3, 1, 4));
}

TEST(Resample, EvenTimesMeetBothEndsExactly) {
  const std::vector<double> times = EvenTimes(0.1, 10.7, 613);
  EXPECT_EQ(times.size(), 613u);
  EXPECT_EQ(times.front(), 0.1);
  EXPECT_EQ(times.back(), 10.7);
}

TEST(Resample, GapsAreNamedByTheirSamples) {
  const std::vector<Gap> gaps = FindGaps(std::vector<double>{0, 0.1, 0.9, 1.0, 2.5}, 0.5);
  ASSERT_EQ(gaps.size(), 2u);
  EXPECT_EQ(gaps[0].begin_s, 0.1);
  EXPECT_EQ(gaps[1].end_s, 2.5);
  EXPECT_DOUBLE_EQ(MedianInterval(std::vector<double>{0, 0.1, 0.2, 3}), 0.1);
}

// A source of 40 Hz recorded at 100 Hz, with a rest from sample 50 to 99.
Eigen::VectorXd HeldRamp() {
  Eigen::VectorXd held(150);
  for (int k = 0; k < 150; ++k) {
    const int moving = k < 50 ? k : (k < 100 ? 50 : k - 50);
    held[k] = static_cast<int>(moving * 0.4);
  }
  return held;
}

TEST(Resample, NewsOfAHeldStreamAreItsStepsAndBothEndsOfARest) {
  const Eigen::VectorXd held = HeldRamp();
  const std::vector<double> times = EvenTimes(0, 1.49, 150);
  const std::vector<std::size_t> news = FindNews(times, held);
  EXPECT_LT(news.size(), 60u);
  EXPECT_EQ(news.front(), 0u);
  EXPECT_EQ(news.back(), 149u);
  int longest = 0;
  for (std::size_t i = 1; i < news.size(); ++i) {
    const int run = static_cast<int>(news[i] - news[i - 1]);
    if (run > longest) longest = run;
  }
  EXPECT_GE(longest, 45);  // the rest: its first and its last sample are kept
  Eigen::VectorXd kept(static_cast<Eigen::Index>(news.size()));
  std::vector<double> kept_times;
  for (std::size_t i = 0; i < news.size(); ++i) {
    kept[static_cast<Eigen::Index>(i)] = held[static_cast<Eigen::Index>(news[i])];
    kept_times.push_back(times[news[i]]);
  }
  const Eigen::MatrixXd middle = Interpolate(kept_times, kept, std::vector<double>{0.6, 0.75, 0.9});
  EXPECT_EQ(middle, Eigen::MatrixXd::Constant(3, 1, 20));
}

TEST(Resample, AStreamThatSeldomRepeatsIsAllNews) {
  Rng rng(4);
  Eigen::VectorXd values(100);
  for (double& v : values) v = rng.Normal();
  values[10] = values[9];
  EXPECT_EQ(FindNews(EvenTimes(0, 1, 100), values).size(), 100u);
  EXPECT_EQ(FindNews(EvenTimes(0, 1, 100), Eigen::VectorXd::Zero(100)).size(), 100u);
}

}  // namespace
}  // namespace exemplar::signal

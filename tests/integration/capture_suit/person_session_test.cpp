#include "capture_suit/person_session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "capture_suit/places.hpp"
#include "station.hpp"

namespace exemplar::capture_suit {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::Station;

const kinematics::RobotDescription& Leonardo() {
  static const kinematics::RobotDescription robot =
      *kinematics::ReadRobotDescription(EXEMPLAR_SOURCE_DIR "/deploy/models/leonardo");
  return robot;
}

scene::Description TableWithButton() {
  scene::Description scene;
  scene.buttons.resize(1);
  scene.buttons[0].name = "target";
  scene.buttons[0].base_T_object.translation = {0.45, -0.2, 0.04};
  return scene;
}

Status Perform(Station& station, const PersonSessionOptions& options, std::stop_token stop = {},
               const scene::Description& scene = TableWithButton()) {
  auto session =
      PersonSession::Create(station.bus, station.clock, station.log, Leonardo(), scene, options);
  return session ? (*session)->Run(stop) : Status(session.error());
}

TEST(PersonSession, PlacesTheButtonThenHasTheTrialRecordedWhileItIsPerformed) {
  Station station({"simulator", "recorder"});
  const Status status =
      Perform(station, {.places = "0.46,-0.12;0.40,-0.28,0.05", .name = "press", .record = true});
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_THAT(station.story,
              ElementsAre("simulator place", "ircp/suit", "recorder start", "ircp/suit",
                          "recorder stop", "simulator place", "ircp/suit", "recorder start",
                          "ircp/suit", "recorder stop", "ircp/suit"));
  EXPECT_EQ(station.commands[0].arguments.at("object"), "target");
  EXPECT_EQ(station.commands[0].arguments.at("x"), "0.46");
  EXPECT_EQ(station.commands[0].arguments.at("z"), "0.04") << "the scene's own height";
  EXPECT_EQ(station.commands[1].arguments.at("name"), "press-001");
  EXPECT_EQ(station.commands[3].arguments.at("z"), "0.05");
  EXPECT_THAT(station.log.events(), Contains(HasSubstr("trial 2 of 2: button at (0.40, -0.28), ")));
}

TEST(PersonSession, SendsTheSuitAt60HzWithoutJumps) {
  Station station({"simulator"});
  ASSERT_TRUE(Perform(station, {.places = "0.46,-0.12;0.40,-0.28;0.52,-0.22"}).ok());
  ASSERT_GT(station.suit.size(), 600U);
  for (std::size_t k = 1; k < station.suit.size(); ++k) {
    const ircp::SuitSample& before = station.suit[k - 1];
    const ircp::SuitSample& now = station.suit[k];
    EXPECT_EQ(now.header.seq, before.header.seq + 1);
    EXPECT_EQ(now.names, Leonardo().chain.joint_names());
    const double step_s = ToSeconds(now.header.stamp - before.header.stamp);
    EXPECT_LE(step_s, 1.0 / 60 + 1e-6);
    for (int i = 0; i < 9; ++i) {
      EXPECT_LT(std::abs(now.positions[i] - before.positions[i]), 0.06) << "sample " << k;
    }
  }
}

TEST(PersonSession, PressesBeyondTheButtonsTravel) {
  Station station({"simulator"});
  ASSERT_TRUE(Perform(station, {.places = "0.40,-0.28"}).ok());
  double lowest = 1;
  for (const ircp::SuitSample& sample : station.suit) {
    const Eigen::Map<const Eigen::VectorXd> q(sample.positions.data(), 9);
    const Eigen::Vector3d tip = Leonardo().chain.ToolPose(q).translation;
    if (std::hypot(tip.x() - 0.40, tip.y() + 0.28) < 0.01) lowest = std::min(lowest, tip.z());
  }
  EXPECT_LT(lowest, 0.04 - 0.004);
  EXPECT_GT(lowest, 0.04 - 0.015);
}

TEST(PersonSession, OnlyPlacesTheButtonWhenAsked) {
  Station station({"simulator", "recorder"});
  ASSERT_TRUE(
      Perform(station, {.places = "0.4,-0.1;0.5,-0.2", .record = true, .place_only = true}).ok());
  EXPECT_EQ(station.story.size(), 2U);
  EXPECT_THAT(station.story, Each("simulator place"));
}

TEST(PersonSession, StopsTheRecordingWhenItIsStoppedHalfWay) {
  Station station({"simulator", "recorder"});
  std::stop_source stop;
  station.on_sample = [&] {
    if (station.suit.size() == 150) stop.request_stop();
  };
  const Status status =
      Perform(station, {.places = "0.4,-0.1;0.5,-0.2", .record = true}, stop.get_token());
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(station.suit.size(), 150U);
  EXPECT_EQ(station.story.back(), "recorder stop");
}

TEST(PersonSession, EndsWhenTheSimulatorRefusesThePlace) {
  Station station({"simulator"});
  station.refuse = "place";
  const Status status = Perform(station, {.places = "0.4,-0.1"});
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("at (0.40, -0.10): I will not place"));
  EXPECT_TRUE(station.suit.empty());
}

TEST(PersonSession, EndsWithTheReasonWhenTheButtonIsOutOfReach) {
  Station station({"simulator"});
  const Status status = Perform(station, {.places = "2,0"});
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(status.error().message, HasSubstr("out of comfortable reach"));
}

TEST(PersonSession, OffersTheNearestButtonForAMisspeltOne) {
  Station station({"simulator"});
  const Status status = Perform(station, {.object = "tagret"});
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("did you mean \"target\"?"));
  EXPECT_EQ(Perform(station, {}, {}, scene::Description{}).error().field, "scene");
}

TEST(ParsePlaces, TakesTwoThreeOrSevenNumbers) {
  const geometry::Pose otherwise = geometry::Pose::FromTranslation({9, 9, 0.5});
  const auto places = ParsePlaces("1,2; 3,4,5 ;6,7,8,0,0,1,0;", otherwise);
  ASSERT_TRUE(places.ok()) << places.error().message;
  ASSERT_EQ(places->size(), 3U);
  EXPECT_EQ((*places)[0].translation, Eigen::Vector3d(1, 2, 0.5));
  EXPECT_EQ((*places)[1].translation, Eigen::Vector3d(3, 4, 5));
  EXPECT_EQ((*places)[2].rotation.z(), 1);
}

TEST(ParsePlaces, NamesThePlaceThatIsWrong) {
  const auto error_of = [](const char* text) {
    return ParsePlaces(text, geometry::Pose()).error().message;
  };
  EXPECT_THAT(error_of("1,2;3"), HasSubstr("place 2 (3): holds 1 numbers"));
  EXPECT_THAT(error_of("1,x"), HasSubstr("place 1 (1,x): \"x\" is not a finite number"));
  EXPECT_THAT(error_of("1,inf"), HasSubstr("not a finite"));
  EXPECT_THAT(error_of("1,2,3,0,0,0,0"), HasSubstr("quaternion has length 0"));
  EXPECT_THAT(error_of(" ; "), HasSubstr("no place"));
}

TEST(RecordingName, NumbersSeveralTrials) {
  EXPECT_EQ(RecordingName("press", 0, 1), "press");
  EXPECT_EQ(RecordingName("press", 0, 2), "press-001");
  EXPECT_EQ(RecordingName("", 11, 20), "trial-012");
}

}  // namespace
}  // namespace exemplar::capture_suit

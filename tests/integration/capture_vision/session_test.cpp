#include "capture_vision/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "drawing.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/ircp/memory_bus.hpp"

namespace exemplar::capture_vision {
namespace {

using ::testing::HasSubstr;

constexpr int kId = 7;
constexpr double kSize = 0.1;

scene::Description TestScene() {
  scene::Description scene;
  scene.cameras = {perception::TestCamera()};
  scene::Button button;
  button.name = "target";
  button.marker = scene::Marker{
      .id = kId, .size_m = kSize, .object_T_marker = {{0.07, 0, -0.03}, {1, 0, 0, 0}}};
  scene.buttons = {button};
  return scene;
}

/// A session on a network within the process.
class VisionRig : public testing::Test {
 protected:
  VisionRig() {
    session_ = *Session::Create(bus_, clock_, log_, scene_);
    object_reader_ = *bus_.MakeReader<ircp::ObjectSample>(
        [this](const ircp::ObjectSample& sample, const ircp::Reception&) {
          const std::lock_guard lock(mutex_);
          objects_.push_back(sample);
          heard_.notify_all();
        });
    status_reader_ = *bus_.MakeReaderOn<ircp::StatusSample>(
        ircp::StatusTopic("capture_vision"), [this](const ircp::StatusSample& sample, const auto&) {
          const std::lock_guard lock(mutex_);
          status_ = sample;
          heard_.notify_all();
        });
    client_ = *ircp::ControlClient::Create(bus_, clock_, "capture_vision", "test", 1);
    writer_ = *bus_.MakeWriter<ircp::CameraSample>("camera");
    thread_ = std::jthread([this](std::stop_token stop) { session_->Run(stop); });
  }

  ircp::CameraSample Pair(const geometry::Pose& left_T_marker) const {
    const scene::StereoCamera& camera = scene_.cameras[0];
    ircp::CameraSample sample;
    sample.header.stamp = Stamp::FromSeconds(1000);
    sample.calibration_id = camera.name;
    sample.encoding = "png";
    for (const bool right : {false, true}) {
      (right ? sample.right : sample.left) = *perception::Encode(
          perception::DrawMarker(camera, right, left_T_marker, kId, kSize, 3), "png");
    }
    return sample;
  }

  /// Waits for a status whose value `name` is `wanted`, asking for it.
  void AwaitValue(const std::string& name, const std::string& wanted) {
    for (int i = 0; i < 2000; ++i) {
      (void)client_->Call("look", {}, std::chrono::seconds(30));  // answered with the values
      std::unique_lock lock(mutex_);
      if (status_.values[name] == wanted) return;
      heard_.wait_for(lock, std::chrono::milliseconds(5));
    }
    FAIL() << name << " did not become " << wanted;
  }

  const scene::Description scene_ = TestScene();
  ManualClock clock_;
  NullLog log_;
  ircp::MemoryBus bus_{clock_};
  std::mutex mutex_;
  std::condition_variable heard_;
  std::vector<ircp::ObjectSample> objects_;
  ircp::StatusSample status_;
  std::unique_ptr<Session> session_;
  std::unique_ptr<ircp::Reader> object_reader_;
  std::unique_ptr<ircp::Reader> status_reader_;
  std::unique_ptr<ircp::ControlClient> client_;
  std::unique_ptr<ircp::Writer<ircp::CameraSample>> writer_;
  std::jthread thread_;
};

TEST_F(VisionRig, SaysWhereAnObjectIsWithThePicturesStamp) {
  Rng rng(1);
  const geometry::Pose left_T_marker = perception::RandomMarkerPose(rng, 0.3);
  const ircp::CameraSample pair = Pair(left_T_marker);
  ASSERT_TRUE(writer_->Write(pair).ok());
  {
    std::unique_lock lock(mutex_);
    ASSERT_TRUE(heard_.wait_for(lock, std::chrono::seconds(30), [&] { return !objects_.empty(); }));
  }
  const geometry::Pose expected = scene_.cameras[0].base_T_left * left_T_marker *
                                  scene_.buttons[0].marker->object_T_marker.Inverse();
  const ircp::ObjectSample& object = objects_.front();
  EXPECT_EQ(object.name, "target");
  EXPECT_EQ(object.frame, "base");
  EXPECT_EQ(object.header.source, "vision");
  EXPECT_EQ(object.header.stamp, pair.header.stamp);
  EXPECT_TRUE(object.has_orientation);
  EXPECT_LT((object.base_T_object.translation - expected.translation).norm(), 0.004);
  EXPECT_LT(geometry::AngleBetween(object.base_T_object.rotation, expected.rotation), 0.05);
  for (const double variance : object.position_variance_m2) {
    EXPECT_GT(variance, 0);
    EXPECT_LT(variance, 0.01 * 0.01);
  }
  EXPECT_GT(object.rotation_variance_rad2, 0);
  AwaitValue("found", "1");
  EXPECT_EQ(status_.state, "seeing");
  ASSERT_EQ(status_.sent.size(), 1u);
  EXPECT_EQ(status_.sent[0].sent, 1u);
}

TEST_F(VisionRig, WhatOneEyeSeesIsCounted) {
  Rng rng(2);
  ircp::CameraSample pair = Pair(perception::RandomMarkerPose(rng, 0.3));
  const scene::StereoCamera& camera = scene_.cameras[0];
  const std::size_t bytes = 3 * static_cast<std::size_t>(camera.width * camera.height);
  pair.right = *perception::Encode(
      {camera.width, camera.height, std::vector<std::uint8_t>(bytes, 128)}, "png");
  ASSERT_TRUE(writer_->Write(pair).ok());
  AwaitValue("one_eyed", "1");
  EXPECT_TRUE(objects_.empty());
}

TEST_F(VisionRig, DamagedAndForeignPicturesAreCountedAndSurvived) {
  Rng rng(3);
  const geometry::Pose left_T_marker = perception::RandomMarkerPose(rng, 0.3);
  ircp::CameraSample damaged = Pair(left_T_marker);
  damaged.left.resize(damaged.left.size() / 2);
  ASSERT_TRUE(writer_->Write(damaged).ok());
  AwaitValue("unreadable", "1");
  ircp::CameraSample foreign = Pair(left_T_marker);
  foreign.calibration_id = "another";
  ASSERT_TRUE(writer_->Write(foreign).ok());
  AwaitValue("unknown_camera", "1");
  ASSERT_TRUE(writer_->Write(Pair(left_T_marker)).ok());
  AwaitValue("found", "1");
}

TEST(VisionSession, NeedsACameraAndAMarker) {
  ManualClock clock;
  NullLog log;
  ircp::MemoryBus bus(clock);
  scene::Description scene = TestScene();
  scene.buttons[0].marker.reset();
  const auto without_marker = Session::Create(bus, clock, log, scene);
  ASSERT_FALSE(without_marker.ok());
  EXPECT_THAT(without_marker.error().message, HasSubstr("marker"));
  scene.cameras.clear();
  const auto without_camera = Session::Create(bus, clock, log, scene);
  ASSERT_FALSE(without_camera.ok());
  EXPECT_THAT(without_camera.error().message, HasSubstr("camera"));
}

}  // namespace
}  // namespace exemplar::capture_vision

#pragma once
// The learning service as clients see it: a real server on port 0, a real client, a real store.

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "demonstrations.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/rpc/client.hpp"
#include "exemplar/rpc/server.hpp"
#include "learning/data.hpp"
#include "learning/skills.hpp"
#include "learning/store.hpp"
#include "learning/trials.hpp"

namespace exemplar::learning_service {

inline const std::vector<Place> kPlaces = {{0.50, -0.20}, {0.60, 0.00},  {0.45, 0.10},
                                           {0.62, -0.22}, {0.52, -0.05}, {0.57, 0.12}};

inline Result<demonstration::Trial> NoMcap(std::string_view, std::string_view source) {
  return InvalidArgument(std::string(source) + ": no recordings in this test");
}

/// All that one process of the service holds.
struct Service {
  explicit Service(const std::filesystem::path& folder) {
    auto opened = Store::Open(folder);
    EXPECT_TRUE(opened.ok()) << opened.error().message;
    store = *std::move(opened);
    trials = std::make_unique<Trials>(*store, clock, nullptr, NoMcap);
    skills = std::make_unique<Skills>(*store, *trials, clock, nullptr, log);
    data = std::make_unique<Data>(*store, *skills, clock, log, Retention{});
    auto started = rpc::Server::Create(
        {}, {.trials = trials.get(), .skills = skills.get(), .learning_data = data.get()});
    EXPECT_TRUE(started.ok()) << started.error().message;
    server = *std::move(started);
    auto connected = rpc::Connect({.server = server->address()});
    EXPECT_TRUE(connected.ok());
    client = *std::move(connected);
  }

  NullLog log;
  ManualClock clock;
  std::unique_ptr<Store> store;
  std::unique_ptr<Trials> trials;
  std::unique_ptr<Skills> skills;
  std::unique_ptr<Data> data;
  std::unique_ptr<rpc::Server> server;
  rpc::Clients client;
};

class LearningServiceTest : public testing::Test {
 protected:
  LearningServiceTest()
      : folder_(std::filesystem::path(testing::TempDir()) /
                (std::string("exemplar-learning-") +
                 testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::remove_all(folder_);
    service_ = std::make_unique<Service>(folder_);
  }
  ~LearningServiceTest() override {
    service_.reset();
    std::filesystem::remove_all(folder_);
  }

  api::TrialApi& trials() { return *service_->client.trials; }
  api::SkillApi& skills() { return *service_->client.skills; }

  void SubmitAll(const std::string& skill = "press") {
    for (std::size_t i = 0; i < kPlaces.size(); ++i) {
      const auto submitted =
          trials().Submit(skill, "trial" + std::to_string(i) + ".csv", PressTrial(kPlaces[i], i));
      ASSERT_TRUE(submitted.ok()) << submitted.error().message;
      ids_.push_back(submitted->info.id);
    }
  }
  void SubmitAllAndLearn() {
    SubmitAll();
    const auto report = skills().Learn("press", {}, {}, {});
    ASSERT_TRUE(report.ok()) << report.error().message;
  }

  static demonstration::SkillQuery At(const Place& place) {
    demonstration::SkillQuery query;
    query.objects = {{"button", geometry::Pose::FromTranslation({place.x, place.y, 0.05}), true}};
    return query;
  }
  static Eigen::MatrixXd Path(const demonstration::SkillMotion& motion) {
    Eigen::MatrixXd path(motion.frames(), 3);
    for (int i = 0; i < motion.frames(); ++i) path.row(i) = motion.base_T_tool[i].translation;
    return path;
  }

  std::filesystem::path folder_;
  std::unique_ptr<Service> service_;
  std::vector<std::string> ids_;
};

}  // namespace exemplar::learning_service

// The learning service as clients see it: a real server on port 0, a real client, a real store.

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "exemplar/demonstration/csv.hpp"
#include "running_service.hpp"

namespace exemplar::learning_service {
namespace {

TEST_F(LearningServiceTest, LearnsFromSubmittedTrialsAndReachesAButtonThatNoTrialHad) {
  SubmitAllAndLearn();
  const Place place{0.55, -0.10};
  const auto motion = skills().Query("press", 0, At(place));
  ASSERT_TRUE(motion.ok()) << motion.error().message;
  EXPECT_EQ(motion->skill, "press");
  EXPECT_EQ(motion->version, 1);
  const Eigen::Vector3d button(place.x, place.y, 0.05);
  const double nearest_m =
      (Path(*motion).rowwise() - button.transpose()).rowwise().norm().minCoeff();
  EXPECT_LT(nearest_m, 0.01);

  const auto evaluation = skills().Evaluate("press", 0, "left-out.csv", PressTrial(place, 99));
  ASSERT_TRUE(evaluation.ok()) << evaluation.error().message;
  EXPECT_LT(evaluation->deviation.frechet_m, 0.10);
  EXPECT_EQ(evaluation->query.objects.at(0).name, "button");
}

TEST_F(LearningServiceTest, AnswersTheSameAfterARestart) {
  SubmitAllAndLearn();
  const auto before = skills().Query("press", 0, At({0.51, 0.03}));
  ASSERT_TRUE(before.ok());
  const auto report_before = skills().Show("press", 0);
  const auto trials_before = trials().List("");
  service_.reset();
  service_ = std::make_unique<Service>(folder_);
  const auto after = skills().Query("press", 0, At({0.51, 0.03}));
  ASSERT_TRUE(after.ok()) << after.error().message;
  EXPECT_EQ(after->time_s, before->time_s);
  EXPECT_LT((Path(*after) - Path(*before)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(ToJson(*skills().Show("press", 0)), ToJson(*report_before));
  const auto trials_after = trials().List("");
  ASSERT_EQ(trials_after->size(), trials_before->size());
  for (std::size_t i = 0; i < trials_after->size(); ++i) {
    EXPECT_EQ((*trials_after)[i].id, (*trials_before)[i].id);
    EXPECT_EQ((*trials_after)[i].submitted, (*trials_before)[i].submitted);
  }
}

TEST_F(LearningServiceTest, TheSameTrialTwiceInOneSkillIsOneTrial) {
  const std::string file = PressTrial(kPlaces[0], 1);
  const auto first = trials().Submit("press", "a.csv", file);
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_FALSE(first->duplicate);
  const auto second = trials().Submit("press", "b.csv", file);
  ASSERT_TRUE(second.ok());
  EXPECT_TRUE(second->duplicate);
  EXPECT_EQ(second->info.id, first->info.id);
  EXPECT_EQ(second->info.source, "a.csv");
  EXPECT_EQ(trials().List("press")->size(), 1u);
}

TEST_F(LearningServiceTest, TheSameTrialInTwoSkillsIsTwo) {
  const std::string file = PressTrial(kPlaces[0], 1);
  const auto first = trials().Submit("press", "a.csv", file);
  const auto second = trials().Submit("push", "a.csv", file);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_FALSE(second->duplicate);
  EXPECT_NE(second->info.id, first->info.id);
  EXPECT_EQ(trials().List("")->size(), 2u);
  EXPECT_EQ(trials().List("push")->size(), 1u);
}

TEST_F(LearningServiceTest, ATrialComesBackAsItWasSubmitted) {
  const std::string file = PressTrial(kPlaces[0], 1);
  const auto submitted = trials().Submit("press", "a.csv", file);
  ASSERT_TRUE(submitted.ok());
  const auto original = demonstration::ReadCsv(file, "a.csv");
  const auto loaded = trials().Load(submitted->info.id);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  EXPECT_TRUE(SameContent(*loaded, *original));
  const auto exported = trials().ExportCsv(submitted->info.id);
  ASSERT_TRUE(exported.ok());
  EXPECT_TRUE(SameContent(*demonstration::ReadCsv(*exported, "b.csv"), *original));
  const auto info = trials().Get(submitted->info.id);
  EXPECT_EQ(info->source, "a.csv");
  EXPECT_EQ(info->samples, original->end_effectors[0].size());
  EXPECT_EQ(info->streams,
            (std::vector<std::string>{"end effector", "object button", "tactile (1)"}));
}

TEST_F(LearningServiceTest, SegmentsOfAFileAreThoseOfTheStoredTrial) {
  const std::string file = PressTrial(kPlaces[0], 1);
  const auto submitted = trials().Submit("press", "a.csv", file);
  const auto stored = trials().Segments(submitted->info.id, {});
  const auto sent = trials().SegmentsOfFile("a.csv", file, {});
  ASSERT_TRUE(stored.ok() && sent.ok());
  EXPECT_FALSE(stored->segmentation.markers.empty());
  EXPECT_EQ(stored->segmentation.msv, sent->segmentation.msv);
  EXPECT_EQ(stored->segmentation.markers.size(), sent->segmentation.markers.size());
}

TEST_F(LearningServiceTest, ErrorsNameWhatIsWrong) {
  SubmitAllAndLearn();
  const auto expect = [](const auto& result, ErrorCode code, const std::string& field,
                         const std::string& words) {
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, code) << result.error().message;
    EXPECT_EQ(result.error().field, field) << result.error().message;
    EXPECT_NE(result.error().message.find(words), std::string::npos) << result.error().message;
  };
  expect(skills().Query("pres", 0, At({0.5, 0})), ErrorCode::kNotFound, "skill.name",
         "did you mean \"press\"?");
  expect(skills().Query("press", 7, At({0.5, 0})), ErrorCode::kNotFound, "skill.version",
         "its last is 1");
  expect(skills().Learn("press", {{"methd", "paper"}}, {}, {}), ErrorCode::kInvalidArgument,
         "options.methd", "did you mean \"method\"?");
  expect(skills().Learn("press", {{"leave_out", "nobody.csv"}}, {}, {}),
         ErrorCode::kInvalidArgument, "options.leave_out", "nobody.csv");
  expect(skills().Learn("empty", {}, {}, {}), ErrorCode::kNotFound, "name", "has no trials");
  expect(skills().Learn("a/b", {}, {}, {}), ErrorCode::kInvalidArgument, "name", "a/b");
  expect(trials().Submit("-x", "a.csv", PressTrial(kPlaces[0], 1)), ErrorCode::kInvalidArgument,
         "skill", "-x");
  expect(trials().Get("trial-0"), ErrorCode::kNotFound, "id", "trial-0");
  expect(trials().Delete("trial-0"), ErrorCode::kNotFound, "id", "trial-0");
  expect(trials().Submit("press", "cut.mcap", "time_s"), ErrorCode::kInvalidArgument, "file",
         "cut.mcap");
  expect(trials().Submit("press", "empty.csv", ""), ErrorCode::kInvalidArgument, "file",
         "empty.csv");
  std::string broken = PressTrial(kPlaces[0], 1);
  broken.replace(broken.find("\n0.05,") + 6, 1, "x");
  const auto submitted = trials().Submit("press", "broken.csv", broken);
  ASSERT_FALSE(submitted.ok());
  EXPECT_NE(submitted.error().message.find("broken.csv:7"), std::string::npos)
      << submitted.error().message;
  EXPECT_EQ(skills().Rollback("press", 0).error().field, "version");
  EXPECT_EQ(skills().Rollback("press", 9).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(skills().Delete("nothing").error().code, ErrorCode::kNotFound);
}

TEST_F(LearningServiceTest, QueriesAreAnsweredWhileTheSkillIsLearnedAnew) {
  SubmitAllAndLearn();
  int answered = 0;
  // Called by the learner itself: an answer that waited for it would never come.
  const auto report =
      service_->skills->Learn("press", {},
                              [&](double, std::string_view) {
                                const auto motion = skills().Query("press", 0, At({0.5, 0}));
                                ASSERT_TRUE(motion.ok()) << motion.error().message;
                                EXPECT_EQ(motion->version, 1);
                                ++answered;
                              },
                              {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_GT(answered, 3);
  EXPECT_EQ(skills().Query("press", 0, At({0.5, 0}))->version, 2);
}

TEST_F(LearningServiceTest, OneSkillIsLearnedOnceAtATime) {
  SubmitAll();
  SubmitAll("push");
  std::optional<Error> refused;
  bool other_learned = false;
  const auto report = service_->skills->Learn(
      "press", {},
      [&](double, std::string_view) {
        if (refused) return;
        refused = skills().Learn("press", {}, {}, {}).error();
        EXPECT_EQ(skills().Delete("press").error().code, ErrorCode::kFailedPrecondition);
        other_learned = skills().Learn("push", {}, {}, {}).ok();
      },
      {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  ASSERT_TRUE(refused.has_value());
  EXPECT_EQ(refused->code, ErrorCode::kFailedPrecondition);
  EXPECT_TRUE(other_learned);
}

TEST_F(LearningServiceTest, CancelledLearningChangesNothing) {
  SubmitAllAndLearn();
  std::stop_source stop;
  const auto report = service_->skills->Learn(
      "press", {}, [&](double, std::string_view) { stop.request_stop(); }, stop.get_token());
  ASSERT_FALSE(report.ok());
  EXPECT_EQ(report.error().code, ErrorCode::kCancelled);
  EXPECT_EQ(skills().Versions("press")->size(), 1u);
  EXPECT_TRUE(skills().Learn("press", {}, {}, {}).ok());
}

TEST_F(LearningServiceTest, SuggestsWhereToDemonstrateNextAndNamesWhatIsWrong) {
  SubmitAllAndLearn();
  const auto found = skills().Suggest("press", 0, {.count = 2});
  ASSERT_TRUE(found.ok()) << found.error().message;
  ASSERT_FALSE(found->places.empty());
  EXPECT_LE(found->places.size(), 2u);
  EXPECT_EQ(found->places[0].target.name, "button");
  EXPECT_GT(found->places[0].nearest_trial_m, 0);
  EXPECT_FALSE(found->places[0].reason.empty());
  EXPECT_EQ(skills().Suggest("press", 0, {.count = 21}).error().field, "count");
  EXPECT_EQ(skills().Suggest("pres", 0, {}).error().code, ErrorCode::kNotFound);
}

TEST_F(LearningServiceTest, RollbackMakesAnOlderVersionTheCurrentOne) {
  SubmitAllAndLearn();
  ASSERT_TRUE(skills().Learn("press", {{"leave_out", "trial0.csv"}}, {}, {}).ok());
  EXPECT_EQ(skills().List()->at(0).version, 2);
  EXPECT_EQ(skills().List()->at(0).trials, 5);
  ASSERT_TRUE(skills().Rollback("press", 1).ok());
  EXPECT_EQ(skills().Query("press", 0, At({0.5, 0}))->version, 1);
  EXPECT_EQ(skills().Query("press", 2, At({0.5, 0}))->version, 2);
  service_.reset();
  service_ = std::make_unique<Service>(folder_);
  EXPECT_EQ(skills().Query("press", 0, At({0.5, 0}))->version, 1);
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  const auto versions = skills().Versions("press");
  ASSERT_TRUE(versions.ok());
  ASSERT_EQ(versions->size(), 3u);
  EXPECT_TRUE(versions->back().current);
  EXPECT_EQ(versions->back().version, 3);
  EXPECT_EQ(versions->front().trial_ids, ids_);
}

TEST_F(LearningServiceTest, AnOlderVersionIsReadFromTheStoreOnce) {
  SubmitAllAndLearn();
  ASSERT_TRUE(skills().Learn("press", {{"leave_out", "trial0.csv"}}, {}, {}).ok());
  const auto first = skills().Query("press", 1, At({0.5, 0}));
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_EQ(first->version, 1);
  // Gone from the store behind the service's back: only memory can answer now.
  ASSERT_TRUE(*service_->store->DeleteSkill("press"));
  const auto again = skills().Query("press", 1, At({0.5, 0}));
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(Path(*again), Path(*first));
}

TEST_F(LearningServiceTest, ADeletedSkillIsForgottenAndLearnedAnewUnderTheNextNumber) {
  SubmitAllAndLearn();
  ASSERT_TRUE(skills().Learn("press", {}, {}, {}).ok());
  ASSERT_TRUE(skills().Query("press", 1, At({0.5, 0})).ok());
  ASSERT_TRUE(skills().Delete("press").ok());
  for (const int version : {0, 1, 2}) {
    EXPECT_EQ(skills().Query("press", version, At({0.5, 0})).error().code, ErrorCode::kNotFound);
  }
  const auto anew = skills().Learn("press", {}, {}, {});
  ASSERT_TRUE(anew.ok()) << anew.error().message;
  EXPECT_EQ(anew->version, 3);
  EXPECT_EQ(skills().Versions("press")->size(), 1u);
  EXPECT_EQ(skills().Query("press", 1, At({0.5, 0})).error().field, "skill.version");
}

TEST_F(LearningServiceTest, SkillsStoredWithNumbersAsArraysAreStillRead) {
  SubmitAllAndLearn();
  const auto before = skills().Query("press", 0, At({0.51, 0.03}));
  ASSERT_TRUE(before.ok());
  // Version 2: the same, written as the first programs wrote it.
  const auto kept = learning::SkillFromBytes(**service_->store->Document("press", 1));
  ASSERT_TRUE(kept.ok()) << kept.error().message;
  StoredVersion old;
  old.skill = "press";
  old.info = service_->store->ListVersions("press")->at(0);
  old.info.version = 2;
  nlohmann::json::to_cbor(learning::ToJson(kept->Named("press", 2)), old.document);
  EXPECT_NE(old.document, **service_->store->Document("press", 1));
  ASSERT_TRUE(service_->store->AddVersion(old).ok());
  service_.reset();
  service_ = std::make_unique<Service>(folder_);
  const auto after = skills().Query("press", 0, At({0.51, 0.03}));
  ASSERT_TRUE(after.ok()) << after.error().message;
  EXPECT_EQ(after->version, 2);
  EXPECT_EQ(Path(*after), Path(*before));
}

TEST_F(LearningServiceTest, TwoPressesAreTwoContactsInTheAnswer) {
  for (std::size_t i = 0; i < kPlaces.size(); ++i) {
    const std::string file = PressTrial(kPlaces[i], i, 2);
    ASSERT_TRUE(trials().Submit("twice", "trial" + std::to_string(i) + ".csv", file).ok());
  }
  const auto report = skills().Learn("twice", {}, {}, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  const Place place{0.55, -0.10};
  const auto motion = skills().Query("twice", 0, At(place));
  ASSERT_TRUE(motion.ok()) << motion.error().message;
  ASSERT_EQ(motion->contacts.size(), 2u);
  EXPECT_LT(motion->contacts[0].last, motion->contacts[1].first);
  const Eigen::MatrixXd path = Path(*motion);
  const Eigen::RowVector3d button(place.x, place.y, 0.05);
  for (const demonstration::Contact& contact : motion->contacts) {
    EXPECT_TRUE(contact.touch_measured);
    EXPECT_LT((path.row(contact.first) - button).norm(), 2e-3);
  }
  // Between them the finger leaves the button.
  const int between = (motion->contacts[0].last + motion->contacts[1].first) / 2;
  EXPECT_GT(path(between, 2), 0.05 + 0.03);
}

TEST_F(LearningServiceTest, DeletingASkillKeepsItsTrials) {
  SubmitAllAndLearn();
  ASSERT_TRUE(skills().Delete("press").ok());
  EXPECT_TRUE(skills().List()->empty());
  EXPECT_EQ(skills().Query("press", 0, At({0.5, 0})).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(trials().List("press")->size(), kPlaces.size());
  EXPECT_TRUE(skills().Learn("press", {}, {}, {}).ok());
}

TEST_F(LearningServiceTest, ADeletedTrialIsNotLearnedFrom) {
  SubmitAll();
  ASSERT_TRUE(trials().Delete(ids_[2]).ok());
  const auto report = skills().Learn("press", {}, {}, {});
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_EQ(report->trials.size(), kPlaces.size() - 1);
  for (const auto& trial : report->trials) EXPECT_NE(trial.id, ids_[2]);
}

TEST_F(LearningServiceTest, ASkillIsExportedAsJson) {
  SubmitAllAndLearn();
  const auto document = skills().ExportJson("press", 0);
  ASSERT_TRUE(document.ok()) << document.error().message;
  const nlohmann::json json = nlohmann::json::parse(*document, nullptr, false);
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json["report"]["trials"].size(), kPlaces.size());
  EXPECT_EQ(json["alignment"]["trials"].size(), kPlaces.size());
}

TEST_F(LearningServiceTest, AStreamFollowsAMovingButton) {
  SubmitAllAndLearn();
  const auto stream = rpc::OpenMotionStream({.server = service_->server->address()}, "press", 0);
  ASSERT_TRUE(stream.ok());
  for (int i = 0; i < 10; ++i) {
    const Place place{0.50 + 0.01 * i, -0.1};
    const auto streamed = (*stream)->Ask(At(place));
    const auto asked = skills().Query("press", 0, At(place));
    ASSERT_TRUE(streamed.ok() && asked.ok());
    EXPECT_EQ(Path(*streamed), Path(*asked));
  }
}

}  // namespace
}  // namespace exemplar::learning_service

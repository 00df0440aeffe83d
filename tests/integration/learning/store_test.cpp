#include "learning/store.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "learning/compression.hpp"

namespace exemplar::learning_service {
namespace {

class StoreTest : public testing::Test {
 protected:
  StoreTest()
      : folder_(std::filesystem::path(testing::TempDir()) /
                (std::string("exemplar-store-") +
                 testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::remove_all(folder_);
  }
  ~StoreTest() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<Store> Open() {
    auto store = Store::Open(folder_);
    EXPECT_TRUE(store.ok()) << store.error().message;
    return store.ok() ? *std::move(store) : nullptr;
  }

  std::filesystem::path folder_;
};

TEST_F(StoreTest, KeepsTrialFilesByteForByte) {
  const std::string file("\0binary\xff\n", 9);
  api::TrialInfo info;
  info.id = "trial-1";
  info.source = "a.csv";
  ASSERT_TRUE(Open()->AddTrial(info, file).ok());
  const auto store = Open();
  EXPECT_EQ(*store->TrialFile("trial-1"), file);
  EXPECT_EQ((*store->FindTrial("trial-1"))->source, "a.csv");
  EXPECT_FALSE(store->FindTrial("trial-2")->has_value());
  EXPECT_EQ(store->TrialFile("trial-2").error().code, ErrorCode::kNotFound);
}

TEST_F(StoreTest, NumbersVersionsOnwardAfterARollback) {
  const auto store = Open();
  for (int version = 1; version <= 3; ++version) {
    EXPECT_EQ(*store->NextVersion("press"), version);
    StoredVersion stored;
    stored.skill = "press";
    stored.info.version = version;
    stored.document = "document " + std::to_string(version);
    ASSERT_TRUE(store->AddVersion(stored).ok());
  }
  ASSERT_TRUE(store->SetCurrent("press", 1).ok());
  EXPECT_EQ(*store->NextVersion("press"), 4);
  EXPECT_EQ(store->ListSkills()->at(0).version, 1);
  EXPECT_EQ(store->ListSkills()->at(0).versions, 3);
  EXPECT_EQ(**store->Document("press", 2), "document 2");
  EXPECT_FALSE(store->Document("press", 4)->has_value());
  EXPECT_TRUE(*store->DeleteSkill("press"));
  EXPECT_FALSE(*store->DeleteSkill("press"));
  EXPECT_FALSE(store->Document("press", 2)->has_value());
}

TEST_F(StoreTest, NumbersVersionsOnwardAfterTheSkillWasDeleted) {
  const auto add = [](Store& store, int version) {
    StoredVersion stored;
    stored.skill = "press";
    stored.info.version = version;
    return store.AddVersion(stored).ok();
  };
  {
    const auto store = Open();
    ASSERT_TRUE(add(*store, 1) && add(*store, 2));
    ASSERT_TRUE(*store->DeleteSkill("press"));
    EXPECT_EQ(*store->NextVersion("press"), 3);
    EXPECT_EQ(*store->NextVersion("push"), 1);
  }
  const auto store = Open();
  EXPECT_EQ(*store->NextVersion("press"), 3);
  ASSERT_TRUE(add(*store, 3));
  EXPECT_EQ(store->ListSkills()->at(0).versions, 1);
  EXPECT_EQ(*store->NextVersion("press"), 4);
}

/// As the first schema had it.
constexpr const char* kFirstSchema = R"sql(
CREATE TABLE trials (number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE,
  skill TEXT NOT NULL, source TEXT NOT NULL, submitted_ns INTEGER NOT NULL, info TEXT NOT NULL,
  file BLOB NOT NULL) STRICT;
CREATE INDEX trials_by_skill ON trials (skill, number);
CREATE TABLE skills (name TEXT PRIMARY KEY, current INTEGER NOT NULL, last INTEGER NOT NULL) STRICT;
CREATE TABLE versions (skill TEXT NOT NULL REFERENCES skills (name) ON DELETE CASCADE,
  version INTEGER NOT NULL, method TEXT NOT NULL, target TEXT NOT NULL, learned_ns INTEGER NOT NULL,
  options TEXT NOT NULL, trial_ids TEXT NOT NULL, document BLOB NOT NULL,
  PRIMARY KEY (skill, version)) STRICT;
PRAGMA application_id = 1165520240; PRAGMA user_version = 1;
)sql";

TEST_F(StoreTest, BringsAStoreOfTheFirstSchemaUpToDateAndKeepsAllOfIt) {
  std::filesystem::create_directories(folder_);
  {
    const auto database = Database::Open(folder_ / "learning.db");
    ASSERT_TRUE((*database)->Execute(kFirstSchema).ok());
    const std::string file = Compress("time_s\n0\n");
    ASSERT_TRUE((*database)
                    ->Prepare("INSERT INTO trials (id, skill, source, submitted_ns, info, file)"
                              " VALUES ('trial-1', 'press', 'a.csv', 5, '{}', ?)")
                    .BindBlob(file)
                    .Run());
    ASSERT_TRUE((*database)->Execute("INSERT INTO skills VALUES ('press', 2, 7)").ok());
    for (const std::int64_t version : {1, 2}) {
      const std::string document = Compress("document " + std::to_string(version));
      ASSERT_TRUE((*database)
                      ->Prepare("INSERT INTO versions VALUES ('press', ?, 'frames', 'button', 9,"
                                " '{}', '[\"trial-1\"]', ?)")
                      .Bind(version)
                      .BindBlob(document)
                      .Run());
    }
  }
  for (int time = 0; time < 2; ++time) {
    const auto store = Open();
    ASSERT_NE(store, nullptr);
    EXPECT_EQ(*store->TrialFile("trial-1"), "time_s\n0\n");
    EXPECT_EQ(**store->Document("press", 1), "document 1");
    EXPECT_EQ(**store->Document("press", 2), "document 2");
    EXPECT_EQ(store->ListSkills()->at(0).version, 2);
    EXPECT_EQ(store->ListVersions("press")->at(1).trial_ids, std::vector<std::string>{"trial-1"});
    EXPECT_EQ(*store->NextVersion("press"), 8);
    // Whose trial it is nobody said before the third schema.
    EXPECT_EQ(store->ListTrials("", "")->at(0).person, time == 0 ? "" : "user03");
    EXPECT_TRUE(*store->SetPerson("trial-1", "user03"));
    EXPECT_FALSE(*store->SetPerson("trial-2", "user03"));
  }
}

TEST_F(StoreTest, IsOpenInOneProcessOnly) {
  const auto store = Open();
  const auto second = Store::Open(folder_);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_NE(second.error().message.find(folder_.string()), std::string::npos);
}

TEST_F(StoreTest, RefusesAFileOfANewerProgram) {
  Open();
  {
    auto database = Database::Open(folder_ / "learning.db");
    ASSERT_TRUE((*database)->Execute("PRAGMA user_version = 1000").ok());
  }
  const auto store = Store::Open(folder_);
  ASSERT_FALSE(store.ok());
  EXPECT_EQ(store.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_NE(store.error().message.find("1000"), std::string::npos);
}

TEST_F(StoreTest, RefusesAFileThatIsNoDatabase) {
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "learning.db") << std::string(10'000, 'x');
  const auto store = Store::Open(folder_);
  ASSERT_FALSE(store.ok());
  EXPECT_EQ(store.error().code, ErrorCode::kDataLoss);
  EXPECT_NE(store.error().message.find("learning.db"), std::string::npos);
}

TEST_F(StoreTest, RefusesADatabaseOfAnotherProgram) {
  std::filesystem::create_directories(folder_);
  {
    auto database = Database::Open(folder_ / "learning.db");
    ASSERT_TRUE((*database)->Execute("CREATE TABLE a (b); PRAGMA user_version = 1").ok());
  }
  EXPECT_EQ(Store::Open(folder_).error().code, ErrorCode::kFailedPrecondition);
}

TEST_F(StoreTest, ATransactionThatIsNotCommittedLeavesNothing) {
  std::filesystem::create_directories(folder_);
  auto database = Database::Open(folder_ / "other.db");
  ASSERT_TRUE((*database)->Execute("CREATE TABLE a (b)").ok());
  {
    auto transaction = Transaction::Begin(**database);
    ASSERT_TRUE(transaction.ok());
    ASSERT_TRUE((*database)->Execute("INSERT INTO a VALUES (1)").ok());
  }
  Statement count = (*database)->Prepare("SELECT count(*) FROM a");
  ASSERT_TRUE(*count.Step());
  EXPECT_EQ(count.Integer(0), 0);
}

TEST(CompressionTest, DamageIsFound) {
  const std::string bytes(100'000, 'a');
  std::string frame = Compress(bytes);
  EXPECT_LT(frame.size(), bytes.size());
  EXPECT_EQ(*Decompress(frame), bytes);
  EXPECT_EQ(*Decompress(Compress("")), "");
  EXPECT_EQ(Decompress("no frame").error().code, ErrorCode::kDataLoss);
  EXPECT_EQ(Decompress(frame.substr(0, frame.size() / 2)).error().code, ErrorCode::kDataLoss);
  frame[frame.size() - 1] = static_cast<char>(frame[frame.size() - 1] + 1);
  EXPECT_EQ(Decompress(frame).error().code, ErrorCode::kDataLoss);
}

}  // namespace
}  // namespace exemplar::learning_service

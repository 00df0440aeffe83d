#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include "exemplar/bus/participant.hpp"
#include "exemplar/security/station.hpp"
#include "support/dds_domain.hpp"

namespace exemplar::bus {

/// The files of a station in a folder of the test's, and participants with them.
class BusSecurityTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "exemplar-dds-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
    station_ = MakeStation("station");
  }
  void TearDown() override { std::filesystem::remove_all(root_); }

  /// The folder of a new station "lab".
  std::filesystem::path MakeStation(const std::string& folder) const {
    const Status made =
        security::InitStation({.folder = root_ / folder, .station = "lab"}, SystemClock().Now());
    EXPECT_TRUE(made.ok()) << made.error().message;
    return root_ / folder;
  }
  static std::string Issue(const std::filesystem::path& station, const std::string& name,
                           const std::string& role) {
    const auto folder =
        security::IssueMember({.folder = station, .name = name, .role = role}, SystemClock().Now());
    EXPECT_TRUE(folder.ok()) << folder.error().message;
    return folder->string();
  }
  Result<std::unique_ptr<Participant>> TryJoin(const std::string& security,
                                               const std::string& station = "lab") const {
    return Participant::Create(
        {.domain = domain_.number(), .station = station, .security = security});
  }
  std::unique_ptr<Participant> Join(const std::string& security) const {
    auto participant = TryJoin(security);
    EXPECT_TRUE(participant.ok()) << participant.error().message;
    return std::move(*participant);
  }
  std::unique_ptr<Participant> JoinAs(const std::string& role) const {
    return Join(Issue(station_, role, role));
  }

  testing::DdsDomain domain_;
  std::filesystem::path root_;
  std::filesystem::path station_;
};

template <class Sample>
std::unique_ptr<ircp::Writer<Sample>> WriterOf(Participant& participant) {
  auto writer = participant.MakeWriter<Sample>("source");
  EXPECT_TRUE(writer.ok()) << writer.error().message;
  return std::move(*writer);
}

/// Counts what arrives.
template <class Sample>
struct Counted {
  explicit Counted(Participant& participant) {
    auto made =
        participant.MakeReader<Sample>([this](const Sample&, const ircp::Reception&) { ++count; });
    EXPECT_TRUE(made.ok()) << made.error().message;
    reader = std::move(*made);
  }
  std::atomic<int> count{0};
  std::unique_ptr<ircp::Reader> reader;
};

}  // namespace exemplar::bus

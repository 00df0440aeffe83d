#include "exemplar/diagnosis/diagnose.hpp"

namespace exemplar::diagnosis {
namespace {

using ircp::SeenEndpoint;
using ircp::SeenParticipant;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A network with a suit and a recorder that hear each other on ircp/suit.
class DiagnoseTest : public ::testing::Test {
 protected:
  DiagnoseTest() {
    evidence_.station = "lab";
    AddParticipant("exemplar-capture-suit");
    AddParticipant("exemplar-recorder");
    AddEndpoint("exemplar-capture-suit", true);
    AddEndpoint("exemplar-recorder", false);
  }

  SeenParticipant& AddParticipant(const std::string& name) {
    evidence_.discovery.participants.push_back(
        {.id = "id of " + name, .name = name, .vendor = "Fast DDS"});
    return evidence_.discovery.participants.back();
  }
  SeenEndpoint& AddEndpoint(const std::string& participant, bool writer) {
    evidence_.discovery.endpoints.push_back(
        {.id = participant + std::to_string(evidence_.discovery.endpoints.size()),
         .participant = "id of " + participant,
         .writer = writer,
         .topic = "ircp/suit",
         .type = "Suit",
         .partitions = {"lab"},
         .keyed = true,
         .qos = {.reliable = true}});
    return evidence_.discovery.endpoints.back();
  }
  SeenEndpoint& writer() { return evidence_.discovery.endpoints[0]; }
  SeenEndpoint& reader() { return evidence_.discovery.endpoints[1]; }
  void MoveReader(int domain) {
    reader().domain = domain;
    evidence_.discovery.participants[1].domain = domain;
  }

  /// The finding of the highest severity; there must be one.
  Finding First() {
    const Diagnosis diagnosis = Diagnose(evidence_);
    EXPECT_FALSE(diagnosis.findings.empty());
    return diagnosis.findings.empty() ? Finding{} : diagnosis.findings.front();
  }
  void ExpectProblem(const std::string& cause, const std::string& what) {
    const Finding finding = First();
    EXPECT_EQ(finding.severity, Severity::kProblem) << finding.what;
    EXPECT_EQ(finding.cause, cause) << finding.what;
    EXPECT_THAT(finding.what, HasSubstr(what));
    EXPECT_FALSE(finding.remedy.empty());
  }

  Evidence evidence_;
};

TEST_F(DiagnoseTest, FindsNothingWhereAllHearEachOther) {
  const Diagnosis diagnosis = Diagnose(evidence_);
  EXPECT_THAT(diagnosis.findings, IsEmpty());
  ASSERT_EQ(diagnosis.flows.size(), 1U);
  EXPECT_EQ(diagnosis.flows[0].topic, "ircp/suit");
  EXPECT_THAT(diagnosis.flows[0].from, ElementsAre("exemplar-capture-suit"));
  EXPECT_THAT(diagnosis.flows[0].to, ElementsAre("exemplar-recorder"));
}

TEST_F(DiagnoseTest, TellsThatStationsDiffer) {
  reader().partitions = {"hall"};
  ExpectProblem("station", "station \"lab\" and exemplar-recorder reads in station \"hall\"");
}

TEST_F(DiagnoseTest, WriterWithAReaderOfItsOwnIsNotBlamedForAnotherStation) {
  AddParticipant("exemplar-gateway");
  AddEndpoint("exemplar-gateway", false).partitions = {"hall"};
  EXPECT_EQ(First().severity, Severity::kNote);
}

TEST_F(DiagnoseTest, TellsThatDomainsDiffer) {
  MoveReader(3);
  const Diagnosis diagnosis = Diagnose(evidence_);
  ASSERT_FALSE(diagnosis.findings.empty());
  ExpectProblem("domain", "exemplar-recorder in domain 3");
}

TEST_F(DiagnoseTest, TellsThatNobodyIsInTheDomainThatWasAskedAbout) {
  evidence_.domain = 7;
  ExpectProblem("domain", "in domain 0, not in 7, where nobody is");
}

TEST_F(DiagnoseTest, TellsWhichPolicyDoesNotMatch) {
  writer().qos.reliable = false;
  ExpectProblem("qos", "offers reliability \"best effort\"");
  EXPECT_EQ(First().policy, "reliability");
  EXPECT_EQ(First().topic, "ircp/suit");
}

TEST_F(DiagnoseTest, SecondReaderOfAParticipantThatMatchesMakesUpForTheFirst) {
  writer().qos.reliable = false;
  AddEndpoint("exemplar-recorder", false).qos.reliable = false;
  EXPECT_THAT(Diagnose(evidence_).findings, IsEmpty());
}

TEST_F(DiagnoseTest, TellsThatTypesDiffer) {
  writer().type = "Glove";
  ExpectProblem("type", "writes the type Glove");
}

TEST_F(DiagnoseTest, TellsThatOneHasKeysAndTheOtherNot) {
  writer().keyed = false;
  ExpectProblem("type", "without keys");
}

TEST_F(DiagnoseTest, TellsThatMembersOfATypeDiffer) {
  writer().schema = "struct Suit { double a; };";
  reader().schema = "struct Suit {\n  double a;\n};";
  EXPECT_THAT(Diagnose(evidence_).findings, IsEmpty());
  reader().schema = "struct Suit { float a; };";
  ExpectProblem("type", "different members");
}

TEST_F(DiagnoseTest, TellsOfATopicWithNearlyThatName) {
  reader().topic = "ircp/siut";
  ExpectProblem("topic", "writes \"ircp/suit\"");
  reader().topic = "rt/ircp/suit";
  ExpectProblem("topic", "writes \"ircp/suit\"");
}

TEST_F(DiagnoseTest, TellsThatSomeAreSecuredAndOthersNot) {
  evidence_.discovery.participants[0].secured = true;
  ExpectProblem("security", "exemplar-capture-suit talks only to participants with an identity");
}

TEST_F(DiagnoseTest, TellsThatAnIdentityWasRefused) {
  evidence_.secured = true;
  for (SeenParticipant& one : evidence_.discovery.participants) one.secured = true;
  evidence_.discovery.participants[0].trust = SeenParticipant::Trust::kRefused;
  ExpectProblem("security", "refuse each other");
}

TEST_F(DiagnoseTest, WarnsOfTheObserversOwnIdentity) {
  evidence_.identity_warnings = {"cert.pem counts for 9 more days"};
  const Finding finding = First();
  EXPECT_EQ(finding.severity, Severity::kWarning);
  EXPECT_EQ(finding.cause, "security");
  EXPECT_THAT(finding.what, HasSubstr("9 more days"));
}

TEST_F(DiagnoseTest, WarnsOfOneThatDidNotAnswerASecuredGreeting) {
  evidence_.secured = true;
  for (SeenParticipant& one : evidence_.discovery.participants) {
    one.secured = true;
    one.trust = SeenParticipant::Trust::kTrusted;
  }
  EXPECT_TRUE(Diagnose(evidence_).findings.empty());
  evidence_.discovery.participants[1].trust = SeenParticipant::Trust::kNotAsked;
  const Finding finding = First();
  EXPECT_EQ(finding.severity, Severity::kWarning);
  EXPECT_EQ(finding.cause, "security");
  EXPECT_EQ(finding.participants, std::vector<std::string>{"exemplar-recorder"});
}

TEST_F(DiagnoseTest, TellsThatNoDatagramReachesSomebody) {
  evidence_.reachability = {{.participant = "id of exemplar-recorder",
                             .reachable = false,
                             .detail = "10.0.0.7:7411: Network is unreachable"}};
  ExpectProblem("transport", "exemplar-recorder cannot be reached: 10.0.0.7:7411");
}

TEST_F(DiagnoseTest, WarnsWhereNoInterfaceCarriesMulticast) {
  evidence_.interfaces = {{.name = "lo", .loopback = true, .detail = "not for multicast"}};
  EXPECT_EQ(First().severity, Severity::kWarning);
  EXPECT_EQ(First().cause, "transport");
  evidence_.interfaces.push_back({.name = "eth0", .multicast = true});
  EXPECT_THAT(Diagnose(evidence_).findings, IsEmpty());
}

TEST_F(DiagnoseTest, WarnsOfOneThatIsHeardAndTellsOfNoTopic) {
  AddParticipant("exemplar-executor");
  EXPECT_THAT(First().what, HasSubstr("exemplar-executor announces itself but told of no topic"));
}

TEST_F(DiagnoseTest, TellsOfClocksThatCertainlyDiffer) {
  evidence_.clocks = {{.participant = "id of exemplar-recorder",
                       .program = "recorder",
                       .offset = std::chrono::seconds(-90),
                       .uncertainty = std::chrono::milliseconds(1)}};
  ExpectProblem("clock", "recorder is 90.000 s behind");
  evidence_.clocks[0].uncertainty = std::chrono::seconds(100);
  EXPECT_THAT(Diagnose(evidence_).findings, IsEmpty());
}

TEST_F(DiagnoseTest, TellsOfServicesThatDoNotAnswerOrAreNotReady) {
  evidence_.services = {{.address = "127.0.0.1:1", .detail = "refused"}};
  ExpectProblem("service", "nobody answers at 127.0.0.1:1");
  evidence_.services = {{.address = "127.0.0.1:1", .reachable = true, .detail = "NOT_SERVING"}};
  ExpectProblem("service", "is not ready");
}

TEST_F(DiagnoseTest, WarnsOfVersionsThatDiffer) {
  evidence_.discovery.participants[0].properties["exemplar.version"] = "0.1.0";
  evidence_.discovery.participants[1].properties["exemplar.version"] = "0.2.0";
  EXPECT_EQ(First().cause, "version");
  EXPECT_THAT(First().what, HasSubstr("0.1.0: exemplar-capture-suit; 0.2.0: exemplar-recorder"));
}

TEST_F(DiagnoseTest, SaysThatOneThatIsAskedAboutIsNotThere) {
  evidence_.names = {"exemplar-recoder"};
  ExpectProblem("participant", "\"exemplar-recoder\"");
  EXPECT_THAT(First().remedy, HasSubstr("\"exemplar-recorder\""));
}

TEST_F(DiagnoseTest, NamesLimitItToWhatLiesBetweenThem) {
  AddParticipant("exemplar-simulator");
  AddEndpoint("exemplar-simulator", true).qos.reliable = false;
  evidence_.names = {"capture-suit", "recorder"};
  EXPECT_THAT(Diagnose(evidence_).findings, IsEmpty());
  evidence_.names = {"simulator", "recorder"};
  ExpectProblem("qos", "exemplar-simulator offers");
}

TEST_F(DiagnoseTest, SaysThatTwoHaveNothingToDoWithEachOther) {
  reader().topic = "ircp/camera";
  writer().topic = "ircp/tactile";
  evidence_.names = {"capture-suit", "recorder"};
  EXPECT_THAT(First().what, HasSubstr("no topic of capture-suit and recorder"));
}

}  // namespace
}  // namespace exemplar::diagnosis

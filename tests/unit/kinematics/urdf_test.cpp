#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <fstream>
#include <sstream>

#include "exemplar/base/text.hpp"
#include "robots.hpp"

namespace exemplar::kinematics {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string ErrorOf(const std::string& urdf) {
  const Result<RobotModel> model = ParseUrdf(urdf, "arm.urdf");
  return model.ok() ? "no error" : model.error().message;
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string TextOf(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

TEST(ParseUrdf, OrdersParentsBeforeChildren) {
  std::string shuffled = R"(<robot name="r">
    <joint name="j2" type="fixed"><parent link="b"/><child link="c"/></joint>
    <link name="c"/><link name="b"/>
    <joint name="j1" type="fixed"><parent link="a"/><child link="b"/></joint>
    <link name="a"/></robot>)";
  const RobotModel model = testing::Parse(shuffled);
  ASSERT_EQ(model.links.size(), 3U);
  EXPECT_EQ(model.links[0].name, "a");
  EXPECT_EQ(model.links[0].parent_joint, -1);
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    EXPECT_LT(model.joints[j].parent_link, model.joints[j].child_link);
    EXPECT_EQ(model.links[model.joints[j].child_link].parent_joint, static_cast<int>(j));
  }
}

TEST(ParseUrdf, ReadsShapesMassesAndColours) {
  const RobotModel model = testing::Parse(R"(<robot name="r">
    <material name="red"><color rgba="1 0 0 0.5"/></material>
    <link name="a">
      <inertial><origin xyz="0 0 .1"/><mass value="2"/>
        <inertia ixx="1" ixy=".1" ixz=".2" iyy="2" iyz=".3" izz="3"/></inertial>
      <visual><geometry><sphere radius=".2"/></geometry><material name="red"/></visual>
      <collision><origin xyz="1 2 3"/><geometry><box size="1 2 3"/></geometry></collision>
      <collision><geometry><cylinder radius=".1" length="4"/></geometry></collision>
      <collision><geometry><mesh filename="part.stl" scale="1 1 -2"/></geometry></collision>
      <collision><geometry><box size="0 0 0"/></geometry></collision>
    </link></robot>)");
  const Link& link = model.links.at(0);
  ASSERT_TRUE(link.inertial);
  EXPECT_EQ(link.inertial->mass_kg, 2);
  EXPECT_EQ(link.inertial->inertia_kg_m2(1, 2), 0.3);
  EXPECT_EQ(link.inertial->inertia_kg_m2(2, 0), 0.2);
  ASSERT_TRUE(link.colour);
  EXPECT_EQ(*link.colour, Eigen::Vector4d(1, 0, 0, 0.5));
  ASSERT_EQ(link.collisions.size(), 3U) << "a box without extent only marks a place";
  EXPECT_EQ(std::get<Box>(link.collisions[0].shape).size, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(link.collisions[0].link_T_shape.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(std::get<Cylinder>(link.collisions[1].shape).length, 4);
  EXPECT_EQ(std::get<Mesh>(link.collisions[2].shape).scale.z(), -2);
}

TEST(ParseUrdf, FindsMeshesOfPackages) {
  const std::filesystem::path root =
      std::filesystem::path(::testing::TempDir()) / "urdf_meshes" / "my_robot";
  std::filesystem::create_directories(root / "urdf");
  std::filesystem::create_directories(root / "meshes");
  std::ofstream(root / "meshes" / "arm.stl") << "solid";
  const auto path_of = [&](const std::string& filename) {
    const Result<RobotModel> model =
        ParseUrdf("<robot name='r'><link name='a'><collision><geometry><mesh filename='" +
                      filename + "'/></geometry></collision></link></robot>",
                  "r.urdf", root / "urdf");
    return std::get<Mesh>(model.value().links[0].collisions[0].shape).path;
  };
  EXPECT_EQ(path_of("package://my_robot/meshes/arm.stl"), (root / "meshes/arm.stl").string());
  EXPECT_EQ(path_of("../meshes/arm.stl"), (root / "meshes/arm.stl").string());
  EXPECT_EQ(path_of("file:///x/arm.stl"), "/x/arm.stl");
  // The package's folder was given another name.
  EXPECT_EQ(path_of("package://its_old_name/meshes/arm.stl"), (root / "meshes/arm.stl").string());
  EXPECT_THAT(path_of("package://elsewhere/arm.stl"), EndsWith("elsewhere/arm.stl"));
}

TEST(ParseUrdf, FollowsMimicJointsToTheOneThatLeads) {
  std::string urdf = testing::MixedRobot();
  urdf = Replaced(urdf, "<limit lower=\"-1\" upper=\"1\" velocity=\"1\" effort=\"10\"/>",
                  "<limit lower=\"-1\" upper=\"1\" velocity=\"1\" effort=\"10\"/>"
                  "<mimic joint=\"follow\" multiplier=\"2\" offset=\"1\"/>");
  const RobotModel model = testing::Parse(urdf);
  const Joint& other = model.joints[model.FindJoint("other")];
  ASSERT_TRUE(other.mimic);
  EXPECT_EQ(other.mimic->joint, model.FindJoint("bend"));
  EXPECT_DOUBLE_EQ(other.mimic->multiplier, -1);
  EXPECT_DOUBLE_EQ(other.mimic->offset, 1.2);
}

TEST(ParseUrdf, NamesFileLineAndElementOfWhatIsWrong) {
  const std::string good = testing::TwoLinkRobot();
  const auto broken = [&](const std::string& from, const std::string& to) {
    return ErrorOf(Replaced(good, from, to));
  };
  EXPECT_THAT(broken("velocity=\"2\"", "velocity=\"-2\""),
              AllOf(StartsWith("arm.urdf:9: joint \"first\""), HasSubstr("limit velocity is -2")));
  EXPECT_THAT(broken("xyz=\"0.5 0 0\"", "xyz=\"0.5 0\""),
              AllOf(StartsWith("arm.urdf:12: joint \"second\""), HasSubstr("must hold 3 numbers")));
  EXPECT_THAT(broken("xyz=\"0.5 0 0\"", "xyz=\"0.5 nan 0\""), HasSubstr("\"nan\" is not a finite"));
  EXPECT_THAT(broken("xyz=\"0.5 0 0\"", "xyz=\"${l} 0 0\""), HasSubstr("\"${l}\" is not a finite"));
  EXPECT_THAT(broken("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>"), HasSubstr("no direction"));
  EXPECT_THAT(broken("<child link=\"lower\"/>", "<child link=\"loewr\"/>"),
              AllOf(StartsWith("arm.urdf:13:"), HasSubstr("\"loewr\" does not exist"),
                    HasSubstr("did you mean \"lower\"?")));
  EXPECT_THAT(broken("type=\"revolute\"", "type=\"floating\""),
              HasSubstr("type \"floating\" is not supported"));
  EXPECT_THAT(broken("lower=\"-3\" upper=\"3\"", "lower=\"3\" upper=\"-3\""),
              HasSubstr("limit lower 3 is above upper -3"));
  EXPECT_THAT(broken("<limit lower=\"-3\" upper=\"3\" velocity=\"2\" effort=\"10\"/>", ""),
              HasSubstr("joint \"first\": has no <limit>"));
  EXPECT_THAT(broken("<link name=\"lower\"/>", "<link name=\"upper\"/>"),
              AllOf(StartsWith("arm.urdf:4: link \"upper\""), HasSubstr("two links")));
  EXPECT_THAT(broken("<joint name=\"second\"", "<joint name=\"first\""), HasSubstr("two joints"));
  EXPECT_THAT(broken("<link name=\"tool\"/>", "<link name=\"tool\"/><link name=\"lost\"/>"),
              HasSubstr("\"ground\" and \"lost\" both have no parent"));
  EXPECT_THAT(broken("<parent link=\"ground\"/>", "<parent link=\"tool\"/>"),
              HasSubstr("hangs in a circle"));
  EXPECT_THAT(broken("</robot>", ""), StartsWith("arm.urdf:"));
  EXPECT_THAT(ErrorOf("<sdf/>"), HasSubstr("<sdf>"));
  EXPECT_THAT(ErrorOf("<robot name='r'/>"), HasSubstr("no links"));
  EXPECT_THAT(ErrorOf(""), StartsWith("arm.urdf:"));
}

TEST(ParseUrdf, SaysFileLineAndElementOfEachBrokenPartOfAChain) {
  const std::string good = testing::TwoLinkRobot();
  struct Row {
    const char* from;
    const char* to;
    const char* place;
    const char* said;
  };
  const Row rows[] = {
      {"<parent link=\"ground\"/>", "", "arm.urdf:6: joint \"first\"", "has no <parent"},
      {"<child link=\"upper\"/>", "<child/>", "arm.urdf:6: joint \"first\"", "has no <child"},
      {"<parent link=\"upper\"/>", "<parent link=\"uper\"/>", "arm.urdf:13: joint \"second\"",
       "parent link \"uper\" does not exist; did you mean \"upper\"?"},
      {"type=\"fixed\"", "type=\"welded\"", "arm.urdf:17: joint \"end\"",
       "type \"welded\" is not supported"},
      {"type=\"fixed\"", "", "arm.urdf:17: joint \"end\"", "has no type"},
      {"name=\"second\"", "name=\"first\"", "arm.urdf:11: joint \"first\"", "two joints"},
      {"<link name=\"tool\"/>", "<link name=\"ground\"/>", "arm.urdf:5: link \"ground\"",
       "two links"},
      {"<child link=\"lower\"/>", "<child link=\"upper\"/>", "arm.urdf:11: joint \"second\"", ""},
      {"lower=\"-2.5\"", "lower=\"-2,5\"", "arm.urdf:15: joint \"second\"", "\"-2,5\""},
      {"velocity=\"2\" effort=\"10\"", "velocity=\"fast\" effort=\"10\"",
       "arm.urdf:9: joint \"first\"", "\"fast\""},
      {"xyz=\"0.3 0 0\"", "xyz=\"0.3 0 1e999\"", "arm.urdf:18: joint \"end\"", "\"1e999\""},
      {"xyz=\"0.3 0 0\"", "xyz=\"0.3 0 0 0\"", "arm.urdf:18: joint \"end\"", "must hold 3 numbers"},
      {"effort=\"10\"/>\n  </joint>\n  <joint name=\"second\"",
       "effort=\"10\"/><mimic joint=\"secnod\"/>\n  </joint>\n  <joint name=\"second\"",
       "arm.urdf:9: joint \"first\"", "\"secnod\", which does not exist"},
  };
  for (const Row& row : rows) {
    EXPECT_THAT(ErrorOf(Replaced(good, row.from, row.to)),
                AllOf(StartsWith(row.place), HasSubstr(row.said)))
        << row.to;
  }
}

TEST(ParseUrdf, RefusesWrongShapesAndMasses) {
  const auto link = [](const std::string& inside) {
    return ErrorOf("<robot name='r'>\n<link name='a'>\n" + inside + "\n</link></robot>");
  };
  EXPECT_THAT(link("<collision><geometry><sphere radius='-1'/></geometry></collision>"),
              AllOf(StartsWith("arm.urdf:3: link \"a\""), HasSubstr("sphere radius is -1")));
  EXPECT_THAT(link("<collision><geometry><capsule/></geometry></collision>"),
              HasSubstr("<capsule> is not a shape"));
  EXPECT_THAT(link("<visual><geometry/></visual>"), HasSubstr("<geometry> is empty"));
  EXPECT_THAT(link("<visual/>"), HasSubstr("has no <geometry>"));
  EXPECT_THAT(link("<inertial><mass value='-1'/></inertial>"), HasSubstr("mass is -1 kg"));
  EXPECT_THAT(link("<inertial><mass value='1'/></inertial>"), HasSubstr("no <inertia>"));
  EXPECT_THAT(link("<inertial><mass value='1'/><inertia ixx='1' iyy='-1' izz='1'/></inertial>"),
              HasSubstr("inertia iyy is -1"));
}

TEST(ParseUrdf, RefusesMimicsThatLeadNowhere) {
  const std::string good = testing::MixedRobot();
  EXPECT_THAT(ErrorOf(Replaced(good, "joint=\"bend\"", "joint=\"bond\"")),
              HasSubstr("mimics joint \"bond\", which does not exist"));
  EXPECT_THAT(ErrorOf(Replaced(good, "joint=\"bend\"", "joint=\"follow\"")), HasSubstr("circle"));
  EXPECT_THAT(ErrorOf(Replaced(good, "joint=\"bend\"", "joint=\"end\"")), HasSubstr("fixed"));
}

TEST(ParseUrdf, NeverCrashesOnDamagedText) {
  const std::string good = TextOf(testing::ModelFolder("arm7") / "arm7.urdf");
  ASSERT_FALSE(good.empty());
  Rng rng(11);
  int refused = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string text = good.substr(0, rng.Below(2) != 0 ? good.size() : rng.Below(good.size()));
    for (std::uint64_t n = rng.Below(6); n > 0 && !text.empty(); --n) {
      const std::size_t at = rng.Below(text.size());
      if (rng.Below(2) != 0) {
        text[at] = static_cast<char>(rng.Below(256));
      } else {
        text.erase(at, rng.Below(40));
      }
    }
    const Result<RobotModel> model = ParseUrdf(text, "damaged.urdf");
    if (model.ok()) continue;
    ++refused;
    EXPECT_THAT(model.error().message, StartsWith("damaged.urdf:"));
  }
  EXPECT_GT(refused, 1500);
}

TEST(ReadUrdf, SaysWhichFileCannotBeRead) {
  const Result<RobotModel> model = ReadUrdf("/nowhere/arm.urdf");
  ASSERT_FALSE(model.ok());
  EXPECT_EQ(model.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(model.error().message, HasSubstr("/nowhere/arm.urdf"));
}

// ---- The peer: urdfdom ----

void ExpectNear(const geometry::Pose& ours, const urdf::Pose& theirs, const std::string& where) {
  EXPECT_NEAR(ours.translation.x(), theirs.position.x, 1e-12) << where;
  EXPECT_NEAR(ours.translation.y(), theirs.position.y, 1e-12) << where;
  EXPECT_NEAR(ours.translation.z(), theirs.position.z, 1e-12) << where;
  const Eigen::Quaterniond rotation(theirs.rotation.w, theirs.rotation.x, theirs.rotation.y,
                                    theirs.rotation.z);
  EXPECT_LT(geometry::AngleBetween(ours.rotation, rotation), 1e-9) << where;
}

void ExpectSameAsUrdfdom(const std::filesystem::path& file) {
  const Result<RobotModel> ours = ReadUrdf(file);
  ASSERT_TRUE(ours.ok()) << ours.error().message;
  const urdf::ModelInterfaceSharedPtr theirs = urdf::parseURDFFile(file.string());
  ASSERT_TRUE(theirs) << file;
  EXPECT_EQ(ours->name, theirs->getName());
  EXPECT_EQ(ours->links[0].name, theirs->getRoot()->name);
  EXPECT_EQ(ours->links.size(), theirs->links_.size());
  EXPECT_EQ(ours->joints.size(), theirs->joints_.size());
  for (const Joint& joint : ours->joints) {
    const urdf::JointConstSharedPtr peer = theirs->getJoint(joint.name);
    ASSERT_TRUE(peer) << joint.name;
    EXPECT_EQ(ours->links[joint.parent_link].name, peer->parent_link_name);
    EXPECT_EQ(ours->links[joint.child_link].name, peer->child_link_name);
    ExpectNear(joint.parent_T_joint, peer->parent_to_joint_origin_transform, joint.name);
    EXPECT_EQ(joint.type == JointType::kFixed, peer->type == urdf::Joint::FIXED);
    if (joint.type == JointType::kFixed) continue;
    const Eigen::Vector3d axis(peer->axis.x, peer->axis.y, peer->axis.z);
    EXPECT_LT((joint.axis - axis.normalized()).norm(), 1e-12) << joint.name;
    if (joint.type == JointType::kContinuous) continue;
    ASSERT_TRUE(peer->limits) << joint.name;
    EXPECT_DOUBLE_EQ(joint.limits.lower, peer->limits->lower) << joint.name;
    EXPECT_DOUBLE_EQ(joint.limits.upper, peer->limits->upper) << joint.name;
    EXPECT_DOUBLE_EQ(joint.limits.velocity, peer->limits->velocity) << joint.name;
    EXPECT_DOUBLE_EQ(joint.limits.effort, peer->limits->effort) << joint.name;
  }
  for (const Link& link : ours->links) {
    const urdf::LinkConstSharedPtr peer = theirs->getLink(link.name);
    ASSERT_TRUE(peer) << link.name;
    ASSERT_EQ(link.inertial.has_value(), peer->inertial != nullptr) << link.name;
    if (link.inertial) {
      EXPECT_DOUBLE_EQ(link.inertial->mass_kg, peer->inertial->mass) << link.name;
      EXPECT_DOUBLE_EQ(link.inertial->inertia_kg_m2(0, 1), peer->inertial->ixy) << link.name;
      ExpectNear(link.inertial->link_T_inertia, peer->inertial->origin, link.name);
    }
    if (link.collisions.empty()) continue;
    ASSERT_EQ(link.collisions.size(), peer->collision_array.size()) << link.name;
    for (std::size_t i = 0; i < link.collisions.size(); ++i) {
      ExpectNear(link.collisions[i].link_T_shape, peer->collision_array[i]->origin, link.name);
    }
  }
}

TEST(ReadUrdf, AgreesWithUrdfdomOnOurModels) {
  for (const char* robot : {"arm7", "leonardo", "ur5e_like"}) {
    ExpectSameAsUrdfdom(testing::ModelFolder(robot) / (std::string(robot) + ".urdf"));
  }
}

TEST(ReadUrdf, AgreesWithUrdfdomOnRealRobots) {
  const std::filesystem::path robots = testing::DataFolder() / "robots";
  if (!std::filesystem::is_directory(robots)) GTEST_SKIP() << "no data in " << robots;
  for (const char* file :
       {"panda/panda_description/urdf/panda.urdf", "ur5e.urdf", "icub.urdf", "jaco.urdf"}) {
    ExpectSameAsUrdfdom(robots / file);
  }
}

}  // namespace
}  // namespace exemplar::kinematics

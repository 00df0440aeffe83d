#include "exemplar/kinematics/srdf.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "exemplar/base/text.hpp"

namespace exemplar::kinematics {
namespace {

using tinyxml2::XMLElement;

std::string Quoted(std::string_view text) { return '"' + std::string(text) + '"'; }

class SrdfReader {
 public:
  SrdfReader(std::string_view source, const RobotModel& model) : source_(source), model_(model) {
    for (const Link& link : model.links) links_.push_back(link.name);
  }

  Result<LinkPairs> Read(std::string_view text) {
    tinyxml2::XMLDocument document;
    if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      return InvalidArgument(source_ + ":" + std::to_string(document.ErrorLineNum()) +
                             ": not well-formed XML (" + document.ErrorName() + ")");
    }
    const XMLElement* robot = document.RootElement();
    if (robot == nullptr) return InvalidArgument(source_ + ":1: there is no <robot> element");
    if (std::string_view(robot->Name()) != "robot") {
      return At(*robot, "the root element must be <robot>");
    }
    if (const XMLElement* second = robot->NextSiblingElement()) {
      return At(*second, "stands after the end of <robot>");
    }
    const char* name = robot->Attribute("name");
    if (name == nullptr) return At(*robot, "name is missing");
    if (name != model_.name) {
      return At(*robot,
                "is about the robot " + Quoted(name) + ", the URDF about " + Quoted(model_.name));
    }
    for (const XMLElement* element = robot->FirstChildElement(); element != nullptr;
         element = element->NextSiblingElement()) {
      if (const Status read = ReadElement(*element); !read) return read.error();
    }
    for (const auto& pair : enabled_) disabled_.erase(pair);
    return LinkPairs(disabled_.begin(), disabled_.end());
  }

 private:
  using NamePair = std::pair<std::string, std::string>;

  Error At(const XMLElement& element, const std::string& what) const {
    return InvalidArgument(source_ + ":" + std::to_string(element.GetLineNum()) + ": <" +
                           element.Name() + ">: " + what);
  }

  Result<std::string> ReadLink(const XMLElement& element, const char* attribute) const {
    const char* name = element.Attribute(attribute);
    if (name == nullptr) return At(element, std::string(attribute) + " is missing");
    if (model_.FindLink(name) < 0) {
      const std::optional<std::string> near = NearestName(name, links_);
      return At(element, std::string(attribute) + ": the robot has no link " + Quoted(name) +
                             (near ? "; did you mean " + Quoted(*near) + "?" : ""));
    }
    return std::string(name);
  }

  Result<NamePair> ReadPair(const XMLElement& element) const {
    Result<std::string> first = ReadLink(element, "link1");
    if (!first) return first.error();
    Result<std::string> second = ReadLink(element, "link2");
    if (!second) return second.error();
    if (*first == *second) return At(element, "link1 and link2 are both " + Quoted(*first));
    return NamePair(std::minmax(*first, *second));
  }

  Status ReadElement(const XMLElement& element) {
    const std::string_view kind = element.Name();
    if (kind == "disable_collisions" || kind == "enable_collisions") {
      Result<NamePair> pair = ReadPair(element);
      if (!pair) return pair.error();
      (kind == "disable_collisions" ? disabled_ : enabled_).insert(*pair);
      return {};
    }
    if (kind == "disable_default_collisions") {
      Result<std::string> link = ReadLink(element, "link");
      if (!link) return link.error();
      for (const std::string& other : links_) {
        if (other != *link) disabled_.insert(NamePair(std::minmax(*link, other)));
      }
      return {};
    }
    const std::vector<std::string> known = {"disable_collisions",
                                            "enable_collisions",
                                            "disable_default_collisions",
                                            "group",
                                            "group_state",
                                            "end_effector",
                                            "virtual_joint",
                                            "passive_joint",
                                            "link_sphere_approximation",
                                            "joint_property"};
    if (std::find(known.begin(), known.end(), kind) != known.end()) return {};
    if (const std::optional<std::string> near = NearestName(kind, known)) {
      return At(element, "unknown element; did you mean <" + *near + ">?");
    }
    return {};
  }

  std::string source_;
  const RobotModel& model_;
  std::vector<std::string> links_;
  std::set<NamePair> disabled_, enabled_;
};

}  // namespace

Result<LinkPairs> ParseSrdf(std::string_view text, std::string_view source,
                            const RobotModel& model) {
  return SrdfReader(source, model).Read(text);
}

Result<LinkPairs> ReadSrdf(const std::filesystem::path& file, const RobotModel& model) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return NotFound(file.string() + ": cannot be read", "srdf");
  std::ostringstream text;
  text << in.rdbuf();
  return ParseSrdf(text.str(), file.string(), model);
}

}  // namespace exemplar::kinematics

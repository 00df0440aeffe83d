// Submits trials, learns a skill of them and asks it for a motion:
//   learn_and_query HOST:PORT SKILL OBJECT X Y Z TRIAL.csv...

#include <cstdlib>
#include <exemplar/client.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

namespace {

int Fail(const exemplar::Error& error) {
  std::cerr << exemplar::ToString(error.code) << ": " << error.message;
  if (!error.field.empty()) std::cerr << " (" << error.field << ")";
  std::cerr << '\n';
  return 1;
}

std::string Bytes(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return std::move(bytes).str();
}

}  // namespace

int main(int argc, char** argv) {
  using namespace exemplar;
  if (argc < 8) {
    std::cerr << "usage: learn_and_query HOST:PORT SKILL OBJECT X Y Z TRIAL.csv...\n";
    return 2;
  }
  const std::string skill = argv[2];
  geometry::NamedPose object{.name = argv[3], .has_orientation = false};
  for (int i = 0; i < 3; ++i) {
    object.base_T_object.translation[i] = std::strtod(argv[4 + i], nullptr);
  }

  const auto clients = rpc::Connect({.server = argv[1]});
  if (!clients) return Fail(clients.error());
  for (int i = 7; i < argc; ++i) {
    const std::string name = std::filesystem::path(argv[i]).filename().string();
    const auto submitted = clients->trials->Submit(skill, name, Bytes(argv[i]));
    if (!submitted) return Fail(submitted.error());
  }

  const auto report = clients->skills->Learn(
      skill, {}, [](double, std::string_view step) { std::cerr << step << '\n'; }, {});
  if (!report) return Fail(report.error());
  std::cout << "version " << report->version << " by " << report->method << " of "
            << report->trials.size() << " trials\n";

  const auto motion = clients->skills->Query(skill, 0, {.objects = {object}});
  if (!motion) return Fail(motion.error());
  for (const std::string& warning : motion->warnings) std::cout << "warning: " << warning << '\n';
  std::cout << motion->frames() << " frames, " << motion->time_s.back() << " s";
  for (const demonstration::Contact& contact : motion->contacts) {
    const Eigen::Vector3d& tool = motion->base_T_tool[contact.first].translation;
    std::cout << ", meets " << contact.object << " at " << tool.transpose() << " m";
  }
  std::cout << '\n';
  return 0;
}

// Submits trials, learns a skill of them and asks it for a motion:
//   learn_and_query HOST:PORT SKILL OBJECT X Y Z TRIAL.csv...

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common.hpp"

namespace {

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
  const geometry::NamedPose object = ObjectOf(argv + 3);

  const auto clients = rpc::Connect(OptionsFor(argv[1]));
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

  demonstration::SkillQuery situation;
  situation.objects = {object};
  const auto motion = clients->skills->Query(skill, 0, situation);
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

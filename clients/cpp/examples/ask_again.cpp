// Asks a skill again and again as its object moves, over one open stream: what one answers to, a
// camera's pictures for instance. The object goes round on a circle of 2 cm:
//   ask_again HOST:PORT SKILL OBJECT X Y Z TIMES

#include <cmath>

#include "common.hpp"

int main(int argc, char** argv) {
  using namespace exemplar;
  if (argc != 8) {
    std::cerr << "usage: ask_again HOST:PORT SKILL OBJECT X Y Z TIMES\n";
    return 2;
  }
  geometry::NamedPose object = ObjectOf(argv + 3);
  const Eigen::Vector3d middle = object.base_T_object.translation;
  const int times = std::atoi(argv[7]);

  const auto stream = rpc::OpenMotionStream(OptionsFor(argv[1]), argv[2], 0);
  if (!stream) return Fail(stream.error());
  demonstration::SkillQuery situation;
  for (int i = 0; i < times; ++i) {
    const double angle = 2 * std::acos(-1.0) * i / times;
    object.base_T_object.translation =
        middle + 0.02 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    situation.objects = {object};
    const auto motion = (*stream)->Ask(situation);
    if (!motion) return Fail(motion.error());
    std::cout << object.base_T_object.translation.transpose() << " m: " << motion->frames()
              << " frames, " << motion->time_s.back() << " s\n";
  }
  // A question that cannot be answered says what is wrong with it, and leaves the stream open.
  object.name = "elephant";
  situation.objects = {object};
  const auto refused = (*stream)->Ask(situation);
  if (refused) return 1;
  std::cout << ToString(refused.error().code) << ": " << refused.error().message << " ("
            << refused.error().field << ")\n";
  return 0;
}

#pragma once
// What stands around the robot, as one YAML file that executor, simulator, vision and the simulated
// person share. Metres, radians, newtons; poses in the robot's base frame; quaternions x, y, z, w.
//
//   obstacles:
//     - {name: table, shape: box, size: [1.2, 0.8, 0.04], position: [0.7, 0, -0.02], quaternion:
//     [0, 0, 0, 1]}
//     - {name: bin, shape: mesh, mesh: bin.stl, position: [0.4, 0.3, 0]}  # convex: true: its hull
//   clouds:                       # points, one a line (x y z), that a camera saw
//     - {name: shelf, file: shelf.xyz, resolution: 0.02, position: [0, 0, 0]}
//   held:                         # moves with a link, in whose frame its pose is
//     - {name: peg, link: hand, shape: cylinder, radius: 0.01, length: 0.1, position: [0, 0, 0.1],
//        touch: [finger]}         # links of the robot that it may touch beside its own
//   buttons:
//     - name: target            # its frame's origin is where hand and button meet unless `contact`
//     says otherwise
//       position: [0.6, -0.2, 0.05]
//       quaternion: [0, 0, 0, 1]
//       contact: [0, 0, 0]      # centre of the cap's upper face, in the button's frame
//       normal: [0, 0, 1]       # outward, in the button's frame
//       radius: 0.02
//       height: 0.04            # of the housing below the cap
//       travel: 0.004
//       click_force: 3
//       marker: {id: 7, size: 0.04, position: [0.05, 0, -0.02], quaternion: [0, 0, 0, 1]}
//       rail: {direction: [0, 1, 0], length: 0.3, speed: 0.1}  # it stands on a cart, which goes
//       from
//                               # its position so far and back, for ever; at most 0.2 m/s
//   objects:                      # may be pushed and held, unless `fixed`
//     - {name: block, shape: box, size: [0.04, 0.04, 0.05], position: [0.5, -0.2, 0.025],
//        mass: 0.15, friction: 0.9, marker: {id: 3, size: 0.03, position: [0, 0, 0.0251]}}
//     - {name: tray, shape: box, size: [0.1, 0.1, 0.004], position: [0.5, 0.2, 0.002], fixed: true}
//   cameras:
//     - {name: stereo, position: [0.6, 0, 1.2], look_at: [0.6, 0, 0], up: [1, 0, 0], baseline: 0.1,
//        width: 640, height: 480, fovy_deg: 50, rate_hz: 10}

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "exemplar/base/result.hpp"
#include "exemplar/geometry/pose.hpp"
#include "exemplar/kinematics/robot_model.hpp"

namespace exemplar::scene {

struct Obstacle {
  std::string name;
  geometry::Pose base_T_shape;
  kinematics::Shape shape;
};

struct Cloud {
  std::string name;
  geometry::Pose base_T_cloud;
  std::vector<Eigen::Vector3d> cloud_p_points;
  double resolution_m = 0.02;
};

struct Held {
  std::string name;
  std::string link;
  geometry::Pose link_T_shape;
  kinematics::Shape shape;
  std::vector<std::string> touch_links;
};

/// A square ArUco marker (dictionary 4x4, 50 ids) fixed to an object; z out of the printed face.
struct Marker {
  int id = 0;
  double size_m = 0.04;  ///< edge of the black square
  geometry::Pose object_T_marker;
};

/// What a cart runs on, to and fro, from where it stands.
struct Rail {
  Eigen::Vector3d base_direction = Eigen::Vector3d::UnitX();  ///< unit
  double length_m = 0;
  double speed_m_s = 0;

  /// From the start of the rail, `time_s` after the cart stood there.
  double WayAt(double time_s) const;
};

struct Button {
  std::string name;
  geometry::Pose base_T_object;
  Eigen::Vector3d object_p_contact = Eigen::Vector3d::Zero();
  Eigen::Vector3d object_normal = Eigen::Vector3d::UnitZ();
  double radius_m = 0.02;
  double height_m = 0.04;
  double travel_m = 0.004;
  double click_force_n = 3;
  std::optional<Marker> marker;
  std::optional<Rail> rail = {};
};

/// Something that a robot may push or hold. Its frame is its shape's: origin in the middle.
struct Object {
  std::string name;
  geometry::Pose base_T_object;  ///< at first
  kinematics::Shape shape;       ///< a mesh only where it is fixed
  double mass_kg = 0.2;
  double friction = 0.8;  ///< Coulomb's, against everything
  bool fixed = false;     ///< stays where it is put
  std::optional<Marker> marker = {};
};

/// A rectified stereo pair: the right camera is `baseline_m` along the left camera's +x.
struct StereoCamera {
  std::string name;
  geometry::Pose base_T_left;  ///< optical frame: z forward, x right, y down
  double baseline_m = 0.1;
  int width = 640;
  int height = 480;
  double fovy_rad = 0.87;
  double rate_hz = 10;

  /// Focal length in pixels, both axes.
  double focal_px() const;
};

struct Description {
  std::vector<Obstacle> obstacles;
  std::vector<Button> buttons;
  std::vector<StereoCamera> cameras;
  std::vector<Cloud> clouds = {};
  std::vector<Held> held = {};
  std::vector<Object> objects = {};
};

/// What cameras can tell from everything else, by its marker.
struct Marked {
  std::string name;
  Marker marker;
};
std::vector<Marked> MarkedThings(const Description& description);

/// Errors name file, line and key; unknown keys are errors with the nearest known one.
Result<Description> ReadDescription(const std::filesystem::path& file);
Result<Description> ParseDescription(std::string_view yaml, std::string_view source);

}  // namespace exemplar::scene

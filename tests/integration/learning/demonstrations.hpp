#pragma once
// Trial files of a simple task, made in the test: reach over a button, press it, go back.

#include <algorithm>
#include <string>

#include "exemplar/base/rng.hpp"
#include "exemplar/base/text.hpp"

namespace exemplar::learning_service {

struct Place {
  double x = 0, y = 0;
};

/// One trial as CSV text at 100 Hz. Each seed has its own timing, start and wobble. The button is
/// pressed `presses` times.
inline std::string PressTrial(const Place& button, std::uint64_t seed, int presses = 1) {
  Rng rng(seed);
  constexpr double kButtonHeight = 0.05;
  const double start[3] = {0.30 + 0.01 * rng.Normal(), 0.01 * rng.Normal(), 0.30};
  const double above[3] = {button.x, button.y, kButtonHeight + 0.10};
  const double touch[3] = {button.x, button.y, kButtonHeight};
  const double rest_s = rng.Uniform(0.2, 0.4), reach_s = rng.Uniform(0.9, 1.3);
  const double press_s = rng.Uniform(0.5, 0.7), hold_s = rng.Uniform(0.3, 0.5);
  const auto jerk_free = [](double s) {
    s = std::clamp(s, 0.0, 1.0);
    return s * s * s * (10 - 15 * s + 6 * s * s);
  };
  std::string csv =
      "time_s,ee_x_m,ee_y_m,ee_z_m,ee_qx,ee_qy,ee_qz,ee_qw,tactile_finger_n,"
      "object_button_x_m,object_button_y_m,object_button_z_m,"
      "object_button_qx,object_button_qy,object_button_qz,object_button_qw\n";
  const double one_press_s = press_s + hold_s + press_s;
  const double end_s = rest_s + reach_s + presses * one_press_s + rest_s;
  const int samples = static_cast<int>(end_s * 100) + 1;
  for (int i = 0; i < samples; ++i) {
    const double t = 0.01 * i;
    const double to_above = jerk_free((t - rest_s) / reach_s);
    double depth = 0, force = 0;
    for (int press = 0; press < presses; ++press) {
      const double since = t - rest_s - reach_s - press * one_press_s;
      depth += jerk_free((since - 0.2) / (press_s - 0.2)) -
               jerk_free((since - press_s - hold_s) / press_s);
      force +=
          jerk_free((since - press_s) / 0.15) - jerk_free((since - press_s - hold_s + 0.15) / 0.15);
    }
    csv += FormatDouble(t);
    for (int axis = 0; axis < 3; ++axis) {
      const double reach = start[axis] + (above[axis] - start[axis]) * to_above;
      const double p = reach + (touch[axis] - above[axis]) * depth;
      csv += "," + FormatDouble(p + 1e-5 * rng.Normal());
    }
    csv += ",1,0,0,0," + FormatDouble(5 * force);
    csv += "," + FormatDouble(button.x) + "," + FormatDouble(button.y) + "," +
           FormatDouble(kButtonHeight) + ",0,0,0,1\n";
  }
  return csv;
}

}  // namespace exemplar::learning_service

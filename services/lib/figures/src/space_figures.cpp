// Figs. 10 to 14: where the object is, and what that does to the motion.

#include <algorithm>
#include <cmath>

#include "exemplar/base/text.hpp"
#include "parts.hpp"

namespace exemplar::figures {
namespace {

using learning::Inspection;

std::string Centimetres(double metres) { return FormatFixed(100 * metres, 1) + " cm"; }

std::string Millimetres(double metres) { return FormatFixed(1000 * metres, 1) + " mm"; }

std::string AbsoluteName(const Inspection& inspection) {
  return inspection.through_joints ? "joint-wise RBF" : "plain RBF on paths";
}

bool IsPaper(const Subject& subject) { return subject.report.method == "paper"; }

std::string ContactWords(const Inspection& inspection) {
  return inspection.contact_found ? "at the contact's onset"
                                  : "at the frame where the paths agree most in the object's frame "
                                    "(no contact was found)";
}

void ShadeContacts(const Subject& subject, Panel& panel) {
  for (const Inspection::Window& contact : subject.inspection.contacts) {
    panel.Stretch(subject.alignment.time_s[static_cast<std::size_t>(contact.first)],
                  subject.alignment.time_s[static_cast<std::size_t>(contact.last)], kRed,
                  "contact with the object");
  }
}

// A round number at or above the value.
double RoundUp(double value) {
  const double power = std::pow(10, std::floor(std::log10(std::max(value, 1e-9))));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (value <= factor * power) return factor * power;
  }
  return 10 * power;
}

void DrawObject(const learning::InspectedQuery& query, Panel3& panel) {
  panel.Mark(query.base_T_target.translation, Symbol::kSquare, 10, kInk, "object");
  panel.Mark(query.base_p_contact, Symbol::kCross, 13, kRed, "where the trials touch it");
}

std::string PlaceText(const learning::InspectedQuery& query) {
  const Eigen::Vector3d& p = query.base_T_target.translation;
  return "(" + FormatFixed(p.x(), 3) + ", " + FormatFixed(p.y(), 3) + ", " + FormatFixed(p.z(), 3) +
         ") m, where no trial had it";
}

double Miss(const Subject& subject, const Eigen::MatrixXd& path) {
  const Inspection& inspection = subject.inspection;
  return (RowOf(path, inspection.contact_frame) - inspection.query->base_p_contact).norm();
}

std::string SameSolutionsNote(const Inspection& inspection) {
  if (inspection.through_joints) return {};
  const std::string plain =
      " There is no joint-wise solution (no joints, or no robot model), so the absolute one is an "
      "RBF on the paths themselves";
  const learning::InspectedQuery& query = *inspection.query;
  const bool same = (query.absolute - query.objective).cwiseAbs().maxCoeff() < 1e-6;
  return plain + (same
                      ? ", which the objective one repeats: the paper's blend changes nothing."
                      : "; it differs from the objective one only because the objects' places lie "
                        "in a plane or a line, so that their trend does not cover all directions.");
}

Eigen::Vector3d MeanStart(const Inspection& inspection) {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  for (const Eigen::MatrixXd& path : inspection.base_paths) {
    start += RowOf(path, 0) / static_cast<double>(inspection.base_paths.size());
  }
  return start;
}

}  // namespace

Figure ContactErrors(const Subject& subject) {
  constexpr const char* kTitle = "Distance to the object at contact, over the object's place";
  const Inspection& inspection = subject.inspection;
  if (!inspection.map.has_value()) return CannotDraw(10, kTitle, inspection.obstacle);
  const learning::ContactErrorMap& map = *inspection.map;
  struct Side {
    std::string title;
    const Eigen::MatrixXd* values;
  };
  std::vector<Side> sides{{AbsoluteName(inspection), &map.absolute}};
  if (inspection.through_joints) sides.push_back({"blended by objectivity", &map.blended});
  if (!IsPaper(subject)) {
    sides.push_back({"this skill's answer (" + subject.report.method + ")", &map.answer});
  }
  if (sides.size() == 1) sides.push_back({"blended by objectivity", &map.blended});
  double most = 0;
  for (const Side& side : sides) most = std::max(most, side.values->maxCoeff());
  const bool small = most < 0.02;
  const double unit = small ? 1000 : 100;
  const double full = RoundUp(std::max(most, 1e-6) * unit);

  Page page(Heading(10, kTitle));
  const auto n = static_cast<double>(sides.size());
  constexpr double kLeft = 76, kBetween = 66, kBar = 110;
  const double width = (1000 - kLeft - kBar - kBetween * (n - 1)) / n;
  const double aspect =
      (map.y_m.back() - map.y_m.front()) / std::max(1e-9, map.x_m.back() - map.x_m.front());
  const double height = std::clamp(width * aspect, 140.0, 560.0);
  std::string figures;
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const Rect box{kLeft + static_cast<double>(k) * (width + kBetween), Page::kTop, width, height};
    Panel& panel = page.Add<Panel>(box, PanelText{.title = sides[k].title,
                                                  .x = "object x in m",
                                                  .y = k == 0 ? "object y in m" : ""});
    panel.Heat(map.x_m, map.y_m, *sides[k].values * unit, full);
    std::vector<Point> places;
    for (const geometry::Pose& target : inspection.base_T_target) {
      places.push_back({target.translation.x(), target.translation.y()});
    }
    panel.Marks(places, Symbol::kCross, 10, "white", "trials (white)");
    figures += (k > 0 ? "; " : "") + sides[k].title + " at most " +
               Millimetres(sides[k].values->maxCoeff());
  }
  page.Add<ColourBar>(Rect{1000 - kBar + 20, Page::kTop, 16, height}, full,
                      small ? "distance in mm" : "distance in cm");
  std::string caption =
      "Distance of the end effector from the mean point at which the trials touch "
      "the object, " +
      ContactWords(inspection) + ", for objects at z = " + FormatFixed(map.z_m, 3) +
      " m turned as on average. Over this map: " + figures + ".";
  if (!inspection.through_joints) {
    caption +=
        " There is no joint-wise solution (no joints, or no robot model): the plain RBF on "
        "paths stands in its place.";
  }
  caption +=
      " What remains at the trials themselves is how differently people touched the object, "
      "and how they turned it.";
  return {.number = 10, .title = kTitle, .svg = page.ToSvg(), .caption = caption};
}

Figure TwoFrames(const Subject& subject) {
  constexpr const char* kTitle = "All trials, seen from the robot and from the object";
  const Inspection& inspection = subject.inspection;
  if (inspection.object_paths.empty()) return CannotDraw(11, kTitle, inspection.obstacle);
  Page page(Heading(11, kTitle));
  Panel3& base = page.Add<Panel3>(Rect{24, Page::kTop, 475, 400}, "absolute coordinates", "m");
  Panel3& object =
      page.Add<Panel3>(Rect{515, Page::kTop, 475, 400}, "object coordinates (x - O)", "m");
  for (std::size_t j = 0; j < inspection.base_paths.size(); ++j) {
    const Stroke stroke{.colour = TrialColour(j), .width = 1.6, .opacity = 0.85};
    base.Path(inspection.base_paths[j], stroke);
    object.Path(inspection.object_paths[j], stroke);
    base.Mark(RowOf(inspection.base_paths[j], 0), Symbol::kDisc, 8, kGreen, "start");
    object.Mark(RowOf(inspection.object_paths[j], 0), Symbol::kDisc, 8, kGreen);
    base.Mark(inspection.base_T_target[j].translation, Symbol::kSquare, 9, kInk, "object");
    base.Mark(RowOf(inspection.base_paths[j], inspection.contact_frame), Symbol::kCross, 10, kRed,
              inspection.contact_found ? "contact" : "where the paths agree most");
    object.Mark(RowOf(inspection.object_paths[j], inspection.contact_frame), Symbol::kCross, 10,
                kRed);
  }
  object.Mark(Eigen::Vector3d::Zero(), Symbol::kSquare, 9, kInk);
  return {.number = 11,
          .title = kTitle,
          .svg = page.ToSvg(),
          .caption =
              "The end effector's paths, aligned in time; shadows lie on the floor. In the "
              "robot's coordinates they diverge towards the objects' places; in the object's "
              "coordinates (shifted, not turned) they converge."};
}

Figure ObjectivityOverTime(const Subject& subject) {
  constexpr const char* kTitle = "Whose motion it is: variances and objectivity";
  const Inspection& inspection = subject.inspection;
  if (inspection.objectivity.upsilon.size() == 0) {
    return CannotDraw(12, kTitle, inspection.obstacle);
  }
  Page page(Heading(12, kTitle));
  const std::vector<double>& time_s = subject.alignment.time_s;
  const Rect above = page.Row(1, Page::kTop, 260)[0];
  Panel& variances = page.Add<Panel>(above, PanelText{.title = "variance over the trials",
                                                      .x = "common time in s",
                                                      .y = "variance in cm²"});
  variances.TightX();
  variances.ReachY(0);
  ShadeContacts(subject, variances);
  constexpr double kSquareCentimetres = 1e4;
  variances.Line(time_s, inspection.objectivity.absolute_variance * kSquareCentimetres,
                 {.colour = kVermilion, .width = 2.2}, "σ absolute (robot's frame)");
  variances.Line(time_s, inspection.objectivity.object_variance * kSquareCentimetres,
                 {.colour = kBlue, .width = 2.2}, "σ object (object's frame)");
  Panel& upsilon = page.Add<Panel>(
      page.Row(1, above.bottom() + 84, 190)[0],
      PanelText{.title = "objectivity", .x = "common time in s", .y = "objectivity Υ"});
  upsilon.TightX();
  upsilon.ReachY(0);
  upsilon.ReachY(1);
  ShadeContacts(subject, upsilon);
  upsilon.Line(time_s, inspection.objectivity.upsilon, {.colour = kInk, .width = 2.4},
               "Υ = σ absolute / (σ absolute + σ object)");
  std::string caption =
      "Variances of the end effector's position over the trials, and objectivity: 0 where the "
      "motion belongs to the robot, 1 where it belongs to the object. ";
  caption += inspection.objectivity.undefined
                 ? "Where it is not defined (one trial, or no variance at all) it is taken as 0 "
                   "before the first contact and 1 after it."
                 : "At the contact it is " +
                       FormatFixed(inspection.objectivity.upsilon[inspection.contact_frame], 3) +
                       ".";
  return {.number = 12, .title = kTitle, .svg = page.ToSvg(), .caption = caption};
}

Figure TwoSolutions(const Subject& subject) {
  constexpr const char* kTitle = "The absolute and the objective solution";
  const Inspection& inspection = subject.inspection;
  if (!inspection.query.has_value()) return CannotDraw(13, kTitle, inspection.obstacle);
  const learning::InspectedQuery& query = *inspection.query;
  Page page(Heading(13, kTitle));
  Panel3& panel =
      page.Add<Panel3>(Rect{110, Page::kTop, 780, 540}, "object at " + PlaceText(query), "m");
  for (const Eigen::MatrixXd& path : inspection.base_paths) {
    panel.Path(path, {.colour = kPale, .width = 1}, "trials");
  }
  panel.Path(query.absolute, {.colour = kVermilion, .width = 2.4},
             "absolute (" + AbsoluteName(inspection) + ")");
  panel.Path(query.objective, {.colour = kBlue, .width = 2.4, .dash = "7 4"},
             "objective (RBF in the object's frame)");
  panel.Mark(RowOf(query.absolute, 0), Symbol::kDisc, 9, kGreen, "start of each");
  panel.Mark(RowOf(query.objective, 0), Symbol::kDisc, 9, kGreen);
  DrawObject(query, panel);
  return {.number = 13,
          .title = kTitle,
          .svg = page.ToSvg(),
          .caption = "Answers for an object at " + PlaceText(query) +
                     ", by the paper's two solutions. At contact the absolute one is " +
                     Centimetres(Miss(subject, query.absolute)) + " off, the objective one " +
                     Centimetres(Miss(subject, query.objective)) + "; the one starts " +
                     Centimetres((RowOf(query.absolute, 0) - MeanStart(inspection)).norm()) +
                     " from the trials' mean start, the other " +
                     Centimetres((RowOf(query.objective, 0) - MeanStart(inspection)).norm()) + "." +
                     SameSolutionsNote(inspection)};
}

Figure BlendedSolution(const Subject& subject) {
  constexpr const char* kTitle = "The blended solution";
  const Inspection& inspection = subject.inspection;
  if (!inspection.query.has_value()) return CannotDraw(14, kTitle, inspection.obstacle);
  const learning::InspectedQuery& query = *inspection.query;
  Page page(Heading(14, kTitle));
  Panel3& panel =
      page.Add<Panel3>(Rect{110, Page::kTop, 780, 540}, "object at " + PlaceText(query), "m");
  panel.Path(query.absolute, {.colour = kVermilion, .width = 1.8, .opacity = 0.9}, "absolute");
  panel.Path(query.objective, {.colour = kBlue, .width = 1.8, .dash = "7 4"}, "objective");
  panel.Path(query.blended, {.colour = kInk, .width = 3}, "blended by objectivity (the paper's)");
  const bool paper = IsPaper(subject);
  if (!paper) {
    panel.Path(query.answer, {.colour = kGreen, .width = 2.2},
               "this skill's answer (" + subject.report.method + ")");
  }
  DrawObject(query, panel);
  return {.number = 14,
          .title = kTitle,
          .svg = page.ToSvg(),
          .caption =
              "The blended path leaves the absolute solution and joins the objective one as "
              "objectivity rises. At contact it is " +
              Centimetres(Miss(subject, query.blended)) + " from where the trials touch." +
              (paper ? std::string(" This is what the skill answers, since its method is "
                                   "\"paper\".")
                     : std::string(" Learning chose method \"") + subject.report.method +
                           "\" for this skill; its answer is drawn beside.") +
              SameSolutionsNote(inspection)};
}

}  // namespace exemplar::figures

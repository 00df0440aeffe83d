#include "contact.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/learning/objectivity.hpp"
#include "exemplar/learning/touch.hpp"

namespace exemplar::learning {
namespace {

// A stretch is in contact while its spread is below this multiple of the least spread ...
constexpr double kNoiseFactor = 1.5;
// ... or within this part of the paths' extent of it ...
constexpr double kNoisePart = 0.002;
// ... and it is contact at all only if the paths converge to less than this part of their widest.
constexpr double kConvergence = 0.35;
// Objectivity that shows that the object, not the room, draws the paths together.
constexpr double kLeastObjectivity = 0.75;

std::vector<Eigen::MatrixXd> TurnedPaths(const Exemplars& exemplars, int object) {
  std::vector<Eigen::MatrixXd> paths;
  for (const ExemplarTrial& trial : exemplars.trials) {
    Eigen::MatrixXd path(exemplars.frames, 3);
    for (int i = 0; i < exemplars.frames; ++i) {
      path.row(i) = (trial.ObjectAt(object, i).Inverse() *
                     trial.tool[static_cast<std::size_t>(i)].translation)
                        .transpose();
    }
    paths.push_back(std::move(path));
  }
  return paths;
}

std::vector<Eigen::MatrixXd> ShiftedPaths(const Exemplars& exemplars, int object) {
  std::vector<Eigen::MatrixXd> paths;
  for (int j = 0; j < exemplars.size(); ++j) paths.push_back(exemplars.ShiftedPath(j, object));
  return paths;
}

// Variance over the trials in the frame, shifted or turned, that brings them nearer.
Eigen::VectorXd ObjectVariance(const Exemplars& exemplars, int object) {
  Eigen::VectorXd variance = PathVariance(ShiftedPaths(exemplars, object));
  if (exemplars.object_has_orientation[static_cast<std::size_t>(object)]) {
    variance = variance.cwiseMin(PathVariance(TurnedPaths(exemplars, object)));
  }
  return variance;
}

double ObjectSpread(const Exemplars& exemplars, int object) {
  double spread = 0;
  const auto o = static_cast<std::size_t>(object);
  for (const ExemplarTrial& trial : exemplars.trials) {
    spread = std::max(spread, (trial.situation.base_T_object[o].translation -
                               exemplars.trials[0].situation.base_T_object[o].translation)
                                  .norm());
  }
  return spread;
}

std::vector<ContactSpan> ContactsFromTouch(const Exemplars& exemplars) {
  Eigen::VectorXd votes = Eigen::VectorXd::Zero(exemplars.frames);
  int voters = 0;
  for (const ExemplarTrial& trial : exemplars.trials) {
    if (trial.touch_n.size() == 0) continue;
    const std::vector<Touch> touches = FindTouches(trial.touch_n);
    if (!touches.empty()) ++voters;
    for (const Touch& touch : touches) {
      votes.segment(touch.first, touch.last - touch.first + 1).array() += 1;
    }
  }
  std::vector<ContactSpan> contacts;
  if (voters == 0) return contacts;
  std::vector<Eigen::VectorXd> variances;
  for (int o = 0; o < exemplars.objects(); ++o) {
    variances.push_back(exemplars.has_tool ? ObjectVariance(exemplars, o)
                                           : Eigen::VectorXd::Zero(exemplars.frames).eval());
  }
  for (int i = 0; i < exemplars.frames; ++i) {
    if (2 * votes[i] <= voters) continue;
    ContactSpan contact{.object = 0, .first = i, .last = i, .touch_measured = true};
    while (contact.last + 1 < exemplars.frames && 2 * votes[contact.last + 1] > voters) {
      ++contact.last;
    }
    i = contact.last;
    for (int o = 1; o < exemplars.objects(); ++o) {
      const auto other = static_cast<std::size_t>(o);
      const auto best = static_cast<std::size_t>(contact.object);
      if (variances[other][contact.first] < variances[best][contact.first]) contact.object = o;
    }
    contacts.push_back(contact);
  }
  return contacts;
}

std::optional<ContactSpan> ContactFromSpread(const Exemplars& exemplars, int object) {
  std::vector<Eigen::MatrixXd> base;
  for (int j = 0; j < exemplars.size(); ++j) base.push_back(exemplars.BasePath(j));
  const Eigen::VectorXd absolute = PathVariance(base);
  const Eigen::VectorXd relative = ObjectVariance(exemplars, object);
  Eigen::Index nearest = 0;
  const double least = std::sqrt(relative.minCoeff(&nearest));
  const double widest = std::sqrt(relative.maxCoeff());
  if (!(least < kConvergence * widest)) return std::nullopt;
  double extent = 0;
  for (const Eigen::MatrixXd& path : base) {
    extent = std::max(extent, (path.colwise().maxCoeff() - path.colwise().minCoeff()).norm());
  }
  const bool object_moved = ObjectSpread(exemplars, object) > 1e-3 * extent;
  const double upsilon = absolute[nearest] / (absolute[nearest] + relative[nearest] + 1e-300);
  if (object_moved && upsilon < kLeastObjectivity) return std::nullopt;
  const double bound = std::max(kNoiseFactor * least, least + kNoisePart * extent);
  ContactSpan contact{.object = object,
                      .first = static_cast<int>(nearest),
                      .last = static_cast<int>(nearest),
                      .touch_measured = false};
  while (contact.first > 0 && std::sqrt(relative[contact.first - 1]) <= bound) --contact.first;
  while (contact.last + 1 < exemplars.frames && std::sqrt(relative[contact.last + 1]) <= bound) {
    ++contact.last;
  }
  // The start is where the hand rested, not where it met something.
  if (contact.first == 0) return std::nullopt;
  return contact;
}

}  // namespace

std::vector<ContactSpan> FindContacts(const Exemplars& exemplars) {
  if (exemplars.objects() == 0) return {};
  std::vector<ContactSpan> contacts = ContactsFromTouch(exemplars);
  if (!contacts.empty() || !exemplars.has_tool || exemplars.size() < 2) return contacts;
  for (int o = 0; o < exemplars.objects(); ++o) {
    if (const std::optional<ContactSpan> contact = ContactFromSpread(exemplars, o)) {
      contacts.push_back(*contact);
    }
  }
  std::sort(contacts.begin(), contacts.end(),
            [](const ContactSpan& a, const ContactSpan& b) { return a.first < b.first; });
  return contacts;
}

ContactPoint MeanContactPoint(const Exemplars& exemplars, const ContactSpan& contact) {
  const auto variance_at = [&](const std::vector<Eigen::MatrixXd>& paths) {
    return PathVariance(paths)[contact.first];
  };
  std::vector<Eigen::MatrixXd> paths = ShiftedPaths(exemplars, contact.object);
  ContactPoint point;
  double variance = variance_at(paths);
  if (exemplars.object_has_orientation[static_cast<std::size_t>(contact.object)]) {
    std::vector<Eigen::MatrixXd> turned = TurnedPaths(exemplars, contact.object);
    const double turned_variance = variance_at(turned);
    // Equal when the object was never turned: then the whole frame is the safer reading.
    if (turned_variance <= variance * (1 + 1e-9) + 1e-18) {
      point.turns = true;
      variance = turned_variance;
      paths = std::move(turned);
    }
  }
  for (const Eigen::MatrixXd& path : paths) {
    point.object_p_contact += path.row(contact.first).transpose() / exemplars.size();
  }
  point.spread_m = std::sqrt(variance);
  return point;
}

}  // namespace exemplar::learning

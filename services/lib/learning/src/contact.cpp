#include "contact.hpp"

#include <algorithm>
#include <cmath>

#include "exemplar/learning/objectivity.hpp"
#include "exemplar/learning/touch.hpp"
#include "meetings.hpp"

namespace exemplar::learning {
namespace {

// Meetings count as contact only if the places are closer together than this part of the paths'
// widest spread, or of their extent.
constexpr double kConvergence = 0.35;
constexpr double kNoisePart = 0.05;
// An object that moved by more than this part of the extent between trials shows whether the
// object, not the room, draws the paths together: by this objectivity.
constexpr double kMovedPart = 0.05;
constexpr double kLeastObjectivity = 0.5;

// The offset of the touching point is looked for in at least this many trials, and taken when it
// predicts left-out places clearly better.
constexpr std::size_t kLeastForOffset = 4;
constexpr double kClearlyCloser = 0.9;
constexpr double kOffsetRidge = 1e-3;
constexpr std::size_t kMostRefits = 15;

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
    contact.meets = contact.first;
    contact.at_one_time = true;
    contacts.push_back(contact);
  }
  return contacts;
}

std::vector<MeetingTrial> MeetingTrials(const Alignment& alignment, const Exemplars& exemplars,
                                        int object) {
  const std::string& name = exemplars.object_names[static_cast<std::size_t>(object)];
  const bool turns = exemplars.object_has_orientation[static_cast<std::size_t>(object)];
  std::vector<MeetingTrial> trials;
  for (const AlignedTrial& aligned : alignment.trials) {
    const UniformTrial& own = aligned.own;
    const auto at = std::find(own.object_names.begin(), own.object_names.end(), name);
    const std::vector<geometry::Pose>& base_T_object =
        own.base_T_object[static_cast<std::size_t>(at - own.object_names.begin())];
    const std::size_t n = own.base_T_tool.size();
    MeetingTrial trial;
    trial.shifted.resize(static_cast<Eigen::Index>(n), 3);
    if (turns) trial.turned.resize(static_cast<Eigen::Index>(n), 3);
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d from_object =
          own.base_T_tool[i].translation - base_T_object[i].translation;
      const auto row = static_cast<Eigen::Index>(i);
      trial.shifted.row(row) = from_object.transpose();
      if (turns) {
        trial.turned.row(row) = (base_T_object[i].rotation.conjugate() * from_object).transpose();
      }
    }
    trials.push_back(std::move(trial));
  }
  return trials;
}

// The frame of the common time base at a moment of the trial's own.
double CommonFrame(const ExemplarTrial& trial, double part) {
  const Eigen::VectorXd& own = trial.own_time;
  const auto* after = std::upper_bound(own.data(), own.data() + own.size(), part);
  if (after == own.data()) return 0;
  if (after == own.data() + own.size()) return static_cast<double>(own.size() - 1);
  const auto k = after - own.data();
  return static_cast<double>(k - 1) + (part - own[k - 1]) / (own[k] - own[k - 1]);
}

struct FoundContact {
  ContactSpan span;
  std::vector<ContactWindow> windows;  // one a trial
  double spread_m = 0;
};

// The object, rather than the room, draws the paths to this place, and closely.
bool Converges(const Exemplars& exemplars, const std::vector<MeetingTrial>& trials,
               const Meeting& meeting, int object, double widest_m, double extent_m) {
  if (exemplars.size() < 2) return true;
  if (meeting.spread_m > std::max(kConvergence * widest_m, kNoisePart * extent_m)) return false;
  if (ObjectSpread(exemplars, object) <= kMovedPart * extent_m) return true;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> places;
  for (std::size_t j = 0; j < trials.size(); ++j) {
    const geometry::Pose& base_T_object = exemplars.trials[j].ObjectAt(object, 0);
    places.push_back(trials[j].shifted.row(meeting.stays[j].still).transpose() +
                     base_T_object.translation);
    mean += places.back() / exemplars.size();
  }
  double absolute = 0;
  for (const Eigen::Vector3d& place : places) {
    absolute += (place - mean).squaredNorm() / exemplars.size();
  }
  const double relative = meeting.spread_m * meeting.spread_m;
  return absolute > kLeastObjectivity * (absolute + relative);
}

std::vector<FoundContact> ContactsFromMotion(const Alignment& alignment, const Exemplars& exemplars,
                                             int object) {
  const std::vector<MeetingTrial> trials = MeetingTrials(alignment, exemplars, object);
  const double widest_m = std::sqrt(ObjectVariance(exemplars, object).maxCoeff());
  double extent_m = 0;
  for (const MeetingTrial& trial : trials) {
    extent_m = std::max(
        extent_m, (trial.shifted.colwise().maxCoeff() - trial.shifted.colwise().minCoeff()).norm());
  }
  std::vector<FoundContact> found;
  for (const Meeting& meeting : FindMeetings(trials)) {
    if (!Converges(exemplars, trials, meeting, object, widest_m, extent_m)) continue;
    FoundContact contact{.span = {.object = object}, .windows = {}, .spread_m = meeting.spread_m};
    ContactWindow mean;
    for (std::size_t j = 0; j < trials.size(); ++j) {
      const double last = static_cast<double>(trials[j].shifted.rows() - 1);
      const Stay& stay = meeting.stays[j];
      const ExemplarTrial& trial = exemplars.trials[j];
      contact.windows.push_back({CommonFrame(trial, stay.first / last),
                                 CommonFrame(trial, stay.still / last),
                                 CommonFrame(trial, stay.last / last)});
      mean.first += contact.windows.back().first / exemplars.size();
      mean.still += contact.windows.back().still / exemplars.size();
      mean.last += contact.windows.back().last / exemplars.size();
    }
    contact.span.first = static_cast<int>(std::lround(mean.first));
    contact.span.meets = static_cast<int>(std::lround(mean.still));
    contact.span.last = static_cast<int>(std::lround(mean.last));
    found.push_back(std::move(contact));
  }
  return found;
}

enum class PointModel { kShifted, kTurned, kTurnedWithOffset };

// Least squares; the offset is held small where the objects' turns do not tell it from the point.
ContactPoint FitPoint(const std::vector<Eigen::Vector3d>& places,
                      const std::vector<geometry::Pose>& objects, PointModel model) {
  const auto n = static_cast<Eigen::Index>(places.size());
  ContactPoint point;
  point.turns = model != PointModel::kShifted;
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(3 * n, 6);
  Eigen::VectorXd values(3 * n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const geometry::Pose& object = objects[static_cast<std::size_t>(j)];
    design.block<3, 3>(3 * j, 0) =
        point.turns ? object.rotation.toRotationMatrix() : Eigen::Matrix3d::Identity().eval();
    if (model == PointModel::kTurnedWithOffset) {
      design.block<3, 3>(3 * j, 3).setIdentity();
    }
    values.segment<3>(3 * j) = places[static_cast<std::size_t>(j)] - object.translation;
  }
  Eigen::MatrixXd normal = design.transpose() * design;
  normal.bottomRightCorner<3, 3>().diagonal().array() += kOffsetRidge * static_cast<double>(n);
  const Eigen::VectorXd solved = normal.ldlt().solve(design.transpose() * values);
  point.object_p_contact = solved.head<3>();
  point.base_offset = solved.tail<3>();
  double squared = 0;
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto k = static_cast<std::size_t>(j);
    squared += (point.At(objects[k]) - places[k]).squaredNorm();
  }
  point.spread_m = std::sqrt(squared / static_cast<double>(n));
  return point;
}

double LeftOutError(const std::vector<Eigen::Vector3d>& places,
                    const std::vector<geometry::Pose>& objects, PointModel model) {
  const std::size_t count = std::min<std::size_t>(places.size(), kMostRefits);
  double squared = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t out = k * places.size() / count;
    std::vector<Eigen::Vector3d> other_places = places;
    std::vector<geometry::Pose> other_objects = objects;
    other_places.erase(other_places.begin() + static_cast<std::ptrdiff_t>(out));
    other_objects.erase(other_objects.begin() + static_cast<std::ptrdiff_t>(out));
    squared +=
        (FitPoint(other_places, other_objects, model).At(objects[out]) - places[out]).squaredNorm();
  }
  return std::sqrt(squared / static_cast<double>(count));
}

// Where each trial's tool was, base frame.
std::vector<Eigen::Vector3d> ContactPlaces(const Exemplars& exemplars, const ContactSpan& contact) {
  // The contact's place in the list, by which trials know their own window.
  const auto at = std::find_if(exemplars.contacts.begin(), exemplars.contacts.end(),
                               [&](const ContactSpan& other) {
                                 return other.object == contact.object &&
                                        other.first == contact.first && other.last == contact.last;
                               });
  const auto index = static_cast<std::size_t>(at - exemplars.contacts.begin());
  std::vector<Eigen::Vector3d> places;
  for (const ExemplarTrial& trial : exemplars.trials) {
    double frame = contact.meets;
    if (index < trial.own_contacts.size()) frame = trial.own_contacts[index].still;
    const auto whole = std::min(static_cast<std::size_t>(frame), trial.tool.size() - 1);
    const std::size_t next = std::min(whole + 1, trial.tool.size() - 1);
    const double s = frame - static_cast<double>(whole);
    places.push_back((1 - s) * trial.tool[whole].translation + s * trial.tool[next].translation);
  }
  return places;
}

}  // namespace

void FindContacts(const Alignment& alignment, Exemplars& exemplars) {
  exemplars.contacts.clear();
  for (std::size_t j = 0; j < exemplars.trials.size(); ++j)
    exemplars.trials.Edit(j).own_contacts.clear();
  if (exemplars.objects() == 0) return;
  exemplars.contacts = ContactsFromTouch(exemplars);
  if (!exemplars.contacts.empty() || !exemplars.has_tool) return;
  std::vector<FoundContact> found;
  for (int o = 0; o < exemplars.objects(); ++o) {
    for (FoundContact& contact : ContactsFromMotion(alignment, exemplars, o)) {
      found.push_back(std::move(contact));
    }
  }
  // The tool is at one object at a time: of those that it seems to meet at once, the one that the
  // trials agree on most.
  std::stable_sort(found.begin(), found.end(), [](const FoundContact& a, const FoundContact& b) {
    return a.spread_m < b.spread_m;
  });
  std::vector<FoundContact> kept;
  for (FoundContact& contact : found) {
    const bool apart = std::all_of(kept.begin(), kept.end(), [&](const FoundContact& other) {
      for (std::size_t j = 0; j < contact.windows.size(); ++j) {
        if (contact.windows[j].first <= other.windows[j].last &&
            contact.windows[j].last >= other.windows[j].first) {
          return false;
        }
      }
      return contact.span.first > other.span.last || contact.span.last < other.span.first;
    });
    if (apart) kept.push_back(std::move(contact));
  }
  std::sort(kept.begin(), kept.end(), [](const FoundContact& a, const FoundContact& b) {
    return a.span.first < b.span.first;
  });
  for (const FoundContact& contact : kept) {
    exemplars.contacts.push_back(contact.span);
    for (std::size_t j = 0; j < exemplars.trials.size(); ++j) {
      exemplars.trials.Edit(j).own_contacts.push_back(contact.windows[j]);
    }
  }
}

ContactPoint MeanContactPoint(const Exemplars& exemplars, const ContactSpan& contact) {
  const std::vector<Eigen::Vector3d> places = ContactPlaces(exemplars, contact);
  std::vector<geometry::Pose> objects;
  for (const ExemplarTrial& trial : exemplars.trials) {
    objects.push_back(trial.ObjectAt(contact.object, contact.meets));
  }
  const double slack_m = 1e-9;
  PointModel model = PointModel::kShifted;
  if (exemplars.object_has_orientation[static_cast<std::size_t>(contact.object)]) {
    // Equal when the object was never turned: then the whole frame is the safer reading.
    const double shifted = FitPoint(places, objects, PointModel::kShifted).spread_m;
    const double turned = FitPoint(places, objects, PointModel::kTurned).spread_m;
    if (turned <= shifted * (1 + 1e-9) + slack_m) model = PointModel::kTurned;
    if (!contact.touch_measured && places.size() >= kLeastForOffset &&
        LeftOutError(places, objects, PointModel::kTurnedWithOffset) <
            kClearlyCloser * LeftOutError(places, objects, model) - slack_m) {
      model = PointModel::kTurnedWithOffset;
    }
  }
  ContactPoint point = FitPoint(places, objects, model);
  if (places.size() > 1) point.left_out_m = LeftOutError(places, objects, model);
  return point;
}

}  // namespace exemplar::learning

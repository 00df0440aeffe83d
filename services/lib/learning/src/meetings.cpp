#include "meetings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "exemplar/signal/derivative.hpp"

namespace exemplar::learning {
namespace {

// How far a path is followed from a stay to see where it came from and went, as part of its extent.
constexpr double kReach = 0.06;
// A rest is slower than this part of the peaks of speed around it; it lasts while the speed is
// within this part of the way up to them.
constexpr double kRestSpeed = 0.5;
constexpr double kLeaveSpeed = 0.15;
// A rest goes on through faster moments within this part of the reach.
constexpr double kWobble = 0.15;
// The way in and the way out are on one side: the cosine between them is above this.
constexpr double kTurnsBack = 0.3;
// A path that moves less than this part of the reach after a stay has ended there.
constexpr double kEndsThere = 0.1;
// Places of one meeting in two trials, as part of the paths' extent.
constexpr double kSamePlace = 0.15;
// A stay is near the object if this part of the furthest distance from it, or less, is left.
constexpr double kNear = 0.6;
// The same for a path that ends without coming to rest.
constexpr double kArrives = 0.3;
// Meetings one after the other at places within this part of the paths' extent are strokes of one
// long meeting if there are this many.
constexpr double kStrokeApart = 0.06;
constexpr std::size_t kStrokes = 4;
// Part of the trials that must show a meeting; the others get their nearest approach.
constexpr double kShownBy = 0.65;
// Trials tried as the one that the others are matched to.
constexpr int kMostReferences = 15;

double Extent(const RelativePath& path) {
  return (path.colwise().maxCoeff() - path.colwise().minCoeff()).norm();
}

class StayFinder {
 public:
  explicit StayFinder(const RelativePath& path)
      : path_(path),
        n_(static_cast<int>(path.rows())),
        speed_(signal::Derivative(path, 1.0).rowwise().norm()),
        reach_(kReach * Extent(path)) {}

  std::optional<Stay> From(int minimum) const {
    int deepest = minimum;
    // The deepest point lies along the way in and out, which are seen from the deepest point.
    for (int round = 0; round < 3; ++round) {
      const std::optional<Surroundings> around = Look(deepest);
      if (!around) return std::nullopt;
      int best = deepest;
      for (int i = around->before; i <= around->after; ++i) {
        if ((path_.row(i) - path_.row(best)).dot(around->inward) > 0) best = i;
      }
      if (best == deepest) break;
      deepest = best;
    }
    int still = deepest;
    while (still > 0 && speed_[still - 1] < speed_[still]) --still;
    while (still + 1 < n_ && speed_[still + 1] < speed_[still]) ++still;
    const std::optional<Surroundings> around = Look(still);
    if (!around || !around->comes_nearer) return std::nullopt;
    const double peak_before =
        speed_.segment(around->before, still - around->before + 1).maxCoeff();
    double peak = peak_before;
    if (!around->ends) {
      peak = std::min(peak, speed_.segment(still, around->after - still + 1).maxCoeff());
    }
    if (speed_[still] > kRestSpeed * peak) return std::nullopt;
    const double bound = speed_[still] + kLeaveSpeed * (peak - speed_[still]);
    const auto stays = [&](int i) {
      return speed_[i] <= bound || (path_.row(i) - path_.row(still)).norm() < kWobble * reach_;
    };
    Stay stay{still, still, still};
    for (int i = still - 1; i >= 0 && stays(i); --i) {
      if (speed_[i] <= bound) stay.first = i;
    }
    for (int i = still + 1; i < n_ && stays(i); ++i) {
      if (speed_[i] <= bound) stay.last = i;
    }
    if (stay.first == 0) return std::nullopt;
    return stay;
  }

  // A trial that ends at the object while it still moves was cut there.
  std::optional<Stay> Arrival() const {
    const std::optional<Surroundings> around = Look(n_ - 1);
    if (!around || !around->comes_nearer) return std::nullopt;
    return Stay{n_ - 1, n_ - 1, n_ - 1};
  }

  bool WithinReach(int from, int to) const {
    return (path_.middleRows(from, to - from + 1).rowwise() - path_.row(from))
               .rowwise()
               .norm()
               .maxCoeff() < reach_;
  }

  bool SlowestAt(int i) const {
    return (i == 0 || speed_[i] < speed_[i - 1]) && (i + 1 == n_ || speed_[i] <= speed_[i + 1]);
  }

 private:
  struct Surroundings {
    int before = 0;
    int after = 0;
    Eigen::RowVector3d inward;
    bool ends = false;  // the path does not leave again
    bool comes_nearer = false;
  };

  // Nothing where the path did not come from anywhere, or goes on rather than back.
  std::optional<Surroundings> Look(int at) const {
    Surroundings around{.before = at, .after = at, .inward = {}, .ends = false};
    const auto away = [&](int i) { return (path_.row(i) - path_.row(at)).norm(); };
    while (around.before > 0 && away(around.before) < reach_) --around.before;
    if (away(around.before) < reach_) return std::nullopt;
    int furthest = at;
    while (around.after + 1 < n_ && away(around.after) < reach_) {
      ++around.after;
      if (away(around.after) > away(furthest)) furthest = around.after;
    }
    const Eigen::RowVector3d back = (path_.row(around.before) - path_.row(at)).normalized();
    around.inward = -back;
    around.ends = away(around.after) < reach_;
    if (away(furthest) > kEndsThere * reach_) {
      const Eigen::RowVector3d out = (path_.row(furthest) - path_.row(at)).normalized();
      const bool turns = back.dot(out) > kTurnsBack;
      if (!around.ends && !turns) return std::nullopt;
      if (turns) around.inward = -(back + out).normalized();
    }
    // The object's origin may lie beside the way in, and the start on any side of it: both are
    // asked.
    const double nearer = (path_.row(around.before).norm() - path_.row(at).norm()) / reach_;
    const double from_start = -around.inward.dot((path_.row(0) - path_.row(at)).normalized());
    around.comes_nearer = nearer + from_start > 0;
    return around;
  }

  const RelativePath& path_;
  int n_;
  Eigen::VectorXd speed_;  // m a frame
  double reach_;
};

Eigen::RowVector3d PlaceOf(const RelativePath& path, const Stay& stay) {
  return path.row(stay.still);
}

struct Matching {
  double score = 0;
  std::vector<int> of_reference;  // index of the other's stay, or -1
};

// The matching in time order of greatest summed nearness.
Matching Match(const RelativePath& reference_path, const std::vector<Stay>& reference,
               const RelativePath& other_path, const std::vector<Stay>& other, double gate_m) {
  const auto rows = static_cast<Eigen::Index>(reference.size());
  const auto columns = static_cast<Eigen::Index>(other.size());
  Eigen::MatrixXd best = Eigen::MatrixXd::Zero(rows + 1, columns + 1);
  Eigen::MatrixXd gain(rows, columns);
  for (Eigen::Index r = 0; r < rows; ++r) {
    for (Eigen::Index c = 0; c < columns; ++c) {
      gain(r, c) = gate_m - (PlaceOf(reference_path, reference[static_cast<std::size_t>(r)]) -
                             PlaceOf(other_path, other[static_cast<std::size_t>(c)]))
                                .norm();
      best(r + 1, c + 1) = std::max({best(r, c + 1), best(r + 1, c), best(r, c) + gain(r, c)});
    }
  }
  Matching matching{best(rows, columns), std::vector<int>(reference.size(), -1)};
  for (Eigen::Index r = rows, c = columns; r > 0 && c > 0;) {
    if (best(r, c) == best(r - 1, c)) {
      --r;
    } else if (best(r, c) == best(r, c - 1)) {
      --c;
    } else {
      matching.of_reference[static_cast<std::size_t>(--r)] = static_cast<int>(--c);
    }
  }
  return matching;
}

struct Matched {
  double score = -1;
  std::size_t reference = 0;
  std::vector<Matching> of_trial;
};

const RelativePath& PathOf(const MeetingTrial& trial, bool turned) {
  return turned ? trial.turned : trial.shifted;
}

Matched MatchAll(std::span<const MeetingTrial> trials, const std::vector<std::vector<Stay>>& stays,
                 bool turned, double gate_m) {
  Matched best;
  const std::size_t count = std::min<std::size_t>(trials.size(), kMostReferences);
  for (std::size_t k = 0; k < count; ++k) {
    Matched matched{0, k * trials.size() / count, {}};
    for (std::size_t j = 0; j < trials.size(); ++j) {
      matched.of_trial.push_back(Match(PathOf(trials[matched.reference], turned),
                                       stays[matched.reference], PathOf(trials[j], turned),
                                       stays[j], gate_m));
      matched.score += matched.of_trial.back().score;
    }
    if (matched.score > best.score) best = std::move(matched);
  }
  return best;
}

double Spread(const std::vector<Eigen::RowVector3d>& places, Eigen::RowVector3d& mean) {
  mean.setZero();
  for (const Eigen::RowVector3d& place : places) mean += place / static_cast<double>(places.size());
  double squared = 0;
  for (const Eigen::RowVector3d& place : places) squared += (place - mean).squaredNorm();
  return std::sqrt(squared / static_cast<double>(places.size()));
}

// A stay for the trials that have none, where they come nearest to the others' place between the
// meetings before and after. False where there is no room.
bool FillIn(std::span<const MeetingTrial> trials, bool turned, const Eigen::RowVector3d& mean,
            const std::vector<std::optional<Stay>>& before,
            const std::vector<std::optional<Stay>>& after,
            std::vector<std::optional<Stay>>& meeting) {
  for (std::size_t j = 0; j < trials.size(); ++j) {
    if (meeting[j].has_value()) continue;
    const RelativePath& path = PathOf(trials[j], turned);
    const int begin = before.empty() || !before[j] ? 1 : before[j]->last + 1;
    const int end = after.empty() || !after[j] ? static_cast<int>(path.rows()) : after[j]->first;
    if (begin >= end) return false;
    Eigen::Index nearest = 0;
    (path.middleRows(begin, end - begin).rowwise() - mean).rowwise().norm().minCoeff(&nearest);
    const int frame = begin + static_cast<int>(nearest);
    meeting[j] = Stay{frame, frame, frame};
  }
  return true;
}

// Rhythm: a run of meetings at one place becomes one.
void JoinRhythm(double apart_m, std::vector<Meeting>& meetings) {
  for (std::size_t k = 0; k < meetings.size(); ++k) {
    std::size_t end = k + 1;
    while (end < meetings.size() &&
           (meetings[end].place - meetings[end - 1].place).norm() < apart_m) {
      ++end;
    }
    if (end - k < kStrokes) continue;
    for (std::size_t j = 0; j < meetings[k].stays.size(); ++j) {
      meetings[k].stays[j].last = meetings[end - 1].stays[j].last;
    }
    meetings.erase(meetings.begin() + static_cast<std::ptrdiff_t>(k) + 1,
                   meetings.begin() + static_cast<std::ptrdiff_t>(end));
  }
}

// Meetings between which most trials have stays that are matched to nothing become one.
void JoinStrokes(const std::vector<std::vector<Stay>>& stays, std::vector<Meeting>& meetings) {
  for (std::size_t k = 0; k + 1 < meetings.size();) {
    std::size_t with_more = 0;
    for (std::size_t j = 0; j < stays.size(); ++j) {
      with_more += std::any_of(stays[j].begin(), stays[j].end(), [&](const Stay& stay) {
        return stay.first > meetings[k].stays[j].last && stay.last < meetings[k + 1].stays[j].first;
      });
    }
    if (2 * with_more <= stays.size()) {
      ++k;
      continue;
    }
    for (std::size_t j = 0; j < stays.size(); ++j) {
      meetings[k].stays[j].last = meetings[k + 1].stays[j].last;
    }
    meetings.erase(meetings.begin() + static_cast<std::ptrdiff_t>(k) + 1);
  }
}

}  // namespace

std::vector<Stay> FindStays(const RelativePath& path) {
  std::vector<Stay> stays;
  if (path.rows() < 5 || !(Extent(path) > 0)) return stays;
  const StayFinder finder(path);
  const double furthest = path.rowwise().norm().maxCoeff();
  for (int i = 1; i < static_cast<int>(path.rows()); ++i) {
    if (!finder.SlowestAt(i)) continue;
    const std::optional<Stay> stay = finder.From(i);
    if (!stay || path.row(stay->still).norm() > kNear * furthest) continue;
    if (!stays.empty() && stay->first <= stays.back().last) continue;
    if (!stays.empty() && finder.WithinReach(stays.back().still, stay->still)) {
      stays.back().last = stay->last;
      continue;
    }
    stays.push_back(*stay);
  }
  const int end = static_cast<int>(path.rows()) - 1;
  if (path.row(end).norm() <= kArrives * furthest &&
      (stays.empty() || !finder.WithinReach(stays.back().still, end))) {
    if (const std::optional<Stay> arrival = finder.Arrival()) stays.push_back(*arrival);
  }
  return stays;
}

std::vector<Meeting> FindMeetings(std::span<const MeetingTrial> trials) {
  std::vector<std::vector<Stay>> stays;
  double extent = 0;
  for (const MeetingTrial& trial : trials) {
    stays.push_back(FindStays(trial.shifted));
    extent += Extent(trial.shifted) / static_cast<double>(trials.size());
  }
  const double gate_m = kSamePlace * extent;
  const bool can_turn = trials.front().turned.rows() > 0;
  Matched matched = MatchAll(trials, stays, false, gate_m);
  bool turned = false;
  if (can_turn) {
    Matched by_turning = MatchAll(trials, stays, true, gate_m);
    // Equal when the object was never turned: then the whole frame is the safer reading.
    if (by_turning.score >= matched.score * (1 - 1e-9)) {
      matched = std::move(by_turning);
      turned = true;
    }
  }

  const std::size_t n = trials.size();
  std::vector<std::vector<std::optional<Stay>>> found;
  for (std::size_t k = 0; k < stays[matched.reference].size(); ++k) {
    std::vector<std::optional<Stay>> meeting(n);
    std::size_t shown = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const int index = matched.of_trial[j].of_reference[k];
      if (index < 0) continue;
      meeting[j] = stays[j][static_cast<std::size_t>(index)];
      ++shown;
    }
    if (static_cast<double>(shown) >= kShownBy * static_cast<double>(n)) {
      found.push_back(std::move(meeting));
    }
  }

  std::vector<Meeting> meetings;
  for (std::size_t k = 0; k < found.size(); ++k) {
    std::vector<Eigen::RowVector3d> places;
    for (std::size_t j = 0; j < n; ++j) {
      if (found[k][j]) places.push_back(PlaceOf(PathOf(trials[j], turned), *found[k][j]));
    }
    Meeting meeting;
    Eigen::RowVector3d mean;
    meeting.spread_m = Spread(places, mean);
    meeting.place = mean.transpose();
    meeting.turns = turned;
    const std::vector<std::optional<Stay>> none;
    if (!FillIn(trials, turned, mean, k > 0 ? found[k - 1] : none,
                k + 1 < found.size() ? found[k + 1] : none, found[k])) {
      continue;
    }
    for (const std::optional<Stay>& stay : found[k]) meeting.stays.push_back(*stay);
    meetings.push_back(std::move(meeting));
  }
  JoinRhythm(kStrokeApart * extent, meetings);
  JoinStrokes(stays, meetings);
  return meetings;
}

}  // namespace exemplar::learning

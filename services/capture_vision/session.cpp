#include "capture_vision/session.hpp"

#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "exemplar/ircp/control.hpp"
#include "exemplar/ircp/simulated_time.hpp"
#include "exemplar/perception/picture.hpp"

namespace exemplar::capture_vision {
namespace {

constexpr const char* kProgram = "capture_vision";
constexpr const char* kSource = "vision";
constexpr const char* kFrame = "base";

class RunningSession final : public Session {
 public:
  RunningSession(const Clock& clock, Log& log,
                 std::map<std::string, perception::ObjectFinder> finders,
                 std::function<void()> on_settled)
      : clock_(clock),
        log_(log),
        finders_(std::move(finders)),
        on_settled_(std::move(on_settled)) {}

  Status Connect(ircp::Bus& bus, const Clock& clock) {
    auto writer = bus.MakeWriter<ircp::ObjectSample>(kSource);
    if (!writer) return writer.error();
    writer_ = std::move(writer).value();
    auto control = ircp::ControlServer::Create(
        bus, clock, kProgram, [](const ircp::CommandSample& command) -> ircp::Answer {
          return {false, "\"" + command.action + "\": there is nothing to command here", {}};
        });
    if (!control) return control.error();
    control_ = std::move(control).value();
    control_->SetSentCounts([this] { return sent(); });
    control_->SetValues([this] { return Values(); });
    control_->SetState("waiting", "no pictures yet");
    auto reader = bus.MakeReader<ircp::CameraSample>(
        [this](const ircp::CameraSample& sample, const ircp::Reception&) { Receive(sample); });
    if (!reader) return reader.error();
    reader_ = std::move(reader).value();
    return {};
  }

  void Run(std::stop_token stop) override {
    log_.Info("running", {{"cameras", finders_.size()}});
    std::unique_lock lock(mutex_);
    while (arrived_.wait(lock, stop, [this] { return !newest_.empty(); })) {
      const auto node = newest_.extract(newest_.begin());
      is_searching_ = true;
      lock.unlock();
      const Clock& real = ircp::RealTimeOf(clock_);
      const Duration begin = real.Steady();
      Search(node.mapped());
      const Duration end = real.Steady();
      lock.lock();
      searching_ += end - begin;
      is_searching_ = false;
      lock.unlock();
      on_settled_();
      lock.lock();
    }
    lock.unlock();
    control_->SetState("stopped", "asked to stop");
    log_.Info("stopped");
  }

  bool is_settled() const override {
    const std::lock_guard lock(mutex_);
    return newest_.empty() && !is_searching_;
  }
  Counts counts() const override {
    const std::lock_guard lock(mutex_);
    return counts_;
  }
  double search_seconds() const override {
    const std::lock_guard lock(mutex_);
    return ToSeconds(searching_);
  }
  std::vector<ircp::TopicCount> sent() const override {
    return {{ircp::ObjectSample::kTopic, kSource, writer_->sent()}};
  }
  const ircp::Reader& reader() const override { return *reader_; }

 private:
  /// On a thread of the network.
  void Receive(const ircp::CameraSample& sample) {
    {
      const std::lock_guard lock(mutex_);
      ++counts_.pictures;
      if (!newest_.insert_or_assign(sample.calibration_id, sample).second) ++counts_.skipped;
    }
    arrived_.notify_one();
  }

  void Search(const ircp::CameraSample& sample) {
    if (!seeing_) {
      seeing_ = true;
      control_->SetState("seeing", "pictures from " + sample.header.source);
    }
    const auto finder = finders_.find(sample.calibration_id);
    if (finder == finders_.end()) {
      Count(&Counts::unknown_camera, 1);
      if (complained_.insert(sample.calibration_id).second) {
        log_.Warning("the scene has no such camera",
                     {{"calibration", sample.calibration_id}, {"source", sample.header.source}});
      }
      return;
    }
    const Result<perception::Findings> findings = Find(finder->second, sample);
    if (!findings) {
      Count(&Counts::unreadable, 1);
      if (complained_.insert(findings.error().message).second) {
        log_.Warning("picture cannot be used", {{"cause", findings.error().message}});
      }
      return;
    }
    Count(&Counts::one_eyed, static_cast<std::uint64_t>(findings->one_eyed));
    Count(&Counts::implausible, static_cast<std::uint64_t>(findings->implausible));
    Count(&Counts::found, findings->objects.size());
    for (const perception::FoundObject& object : findings->objects) {
      ircp::ObjectSample out;
      out.header.stamp = sample.header.stamp;
      out.name = object.name;
      out.frame = kFrame;
      out.base_T_object = object.base_T_object;
      for (std::size_t i = 0; i < 3; ++i) {
        out.position_variance_m2[i] = object.position_variance_m2[static_cast<Eigen::Index>(i)];
      }
      out.rotation_variance_rad2 = object.rotation_variance_rad2;
      if (Status status = writer_->Write(std::move(out)); !status) {
        log_.Warning("object not sent", {{"cause", status.error().message}});
      } else if (seen_.insert(object.name).second) {
        log_.Info("object seen", {{"object", object.name},
                                  {"x_m", object.base_T_object.translation.x()},
                                  {"y_m", object.base_T_object.translation.y()},
                                  {"z_m", object.base_T_object.translation.z()},
                                  {"residual_px", object.residual_px}});
      }
    }
  }

  static Result<perception::Findings> Find(const perception::ObjectFinder& finder,
                                           const ircp::CameraSample& sample) {
    const Result<perception::Picture> left = perception::Decode(sample.left);
    if (!left) return WithPlace(left.error(), "left");
    const Result<perception::Picture> right = perception::Decode(sample.right);
    if (!right) return WithPlace(right.error(), "right");
    return finder.Find(*left, *right);
  }

  void Count(std::uint64_t Counts::*which, std::uint64_t more) {
    const std::lock_guard lock(mutex_);
    counts_.*which += more;
  }

  std::map<std::string, std::string> Values() const {
    const std::lock_guard lock(mutex_);
    return {{"pictures", std::to_string(counts_.pictures)},
            {"skipped", std::to_string(counts_.skipped)},
            {"unreadable", std::to_string(counts_.unreadable)},
            {"unknown_camera", std::to_string(counts_.unknown_camera)},
            {"found", std::to_string(counts_.found)},
            {"one_eyed", std::to_string(counts_.one_eyed)},
            {"implausible", std::to_string(counts_.implausible)}};
  }

  const Clock& clock_;
  Log& log_;
  const std::map<std::string, perception::ObjectFinder> finders_;  ///< by calibration id

  const std::function<void()> on_settled_;

  mutable std::mutex mutex_;  ///< guards what follows, up to searching_
  std::condition_variable_any arrived_;
  std::map<std::string, ircp::CameraSample> newest_;  ///< by calibration id
  Counts counts_;
  bool is_searching_ = false;
  Duration searching_{0};

  // Of the thread that runs.
  bool seeing_ = false;
  std::set<std::string> complained_;
  std::set<std::string> seen_;

  std::unique_ptr<ircp::Writer<ircp::ObjectSample>> writer_;
  // Last: their threads call into what stands above.
  std::unique_ptr<ircp::ControlServer> control_;
  std::unique_ptr<ircp::Reader> reader_;
};

}  // namespace

Result<std::unique_ptr<Session>> Session::Create(ircp::Bus& bus, const Clock& clock, Log& log,
                                                 const scene::Description& scene,
                                                 const SessionOptions& options) {
  if (scene.cameras.empty()) {
    return InvalidArgument("the scene has no camera: there is nothing to see with", "cameras");
  }
  std::map<std::string, perception::ObjectFinder> finders;
  for (const scene::StereoCamera& camera : scene.cameras) {
    Result<perception::ObjectFinder> finder =
        perception::ObjectFinder::Create(camera, scene::MarkedThings(scene), options.finder);
    if (!finder) return finder.error();
    finders.emplace(camera.name, std::move(finder).value());
  }
  auto session =
      std::make_unique<RunningSession>(clock, log, std::move(finders), options.on_settled);
  if (Status status = session->Connect(bus, clock); !status) return status.error();
  return std::unique_ptr<Session>(std::move(session));
}

}  // namespace exemplar::capture_vision

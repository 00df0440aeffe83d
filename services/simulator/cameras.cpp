#include "simulator/cameras.hpp"

#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <stop_token>
#include <thread>

#include "exemplar/perception/picture.hpp"
#include "simulator/renderer.hpp"

namespace exemplar::simulator {
namespace {

struct Camera {
  scene::StereoCamera geometry;
  std::unique_ptr<ircp::Writer<ircp::CameraSample>> writer;
  std::int64_t looks = 0;  ///< pictures taken or skipped since the world began
};

struct Order {
  std::size_t camera = 0;
  Snapshot snapshot;
  Stamp stamp;
};

class DrawnCameras final : public Cameras {
 public:
  DrawnCameras(Log& log, std::vector<Camera> cameras, const CameraOptions& options)
      : log_(log), cameras_(std::move(cameras)), options_(options) {}

  /// Starts the drawing thread and waits until it can draw or knows that it cannot.
  Status Start(const World& world) {
    std::promise<Status> ready;
    std::future<Status> started = ready.get_future();
    // OpenGL's context belongs to the thread that makes it.
    thread_ = std::jthread([this, &world, &ready](std::stop_token stop) {
      Result<Renderer> renderer = Renderer::Create(world);
      if (!renderer) {
        ready.set_value(renderer.error());
        return;
      }
      ready.set_value({});
      Draw(*renderer, stop);
    });
    return started.get();
  }

  void Look(const World& world, Stamp stamp) override {
    const double now_s = ToSeconds(world.time());
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      Camera& camera = cameras_[i];
      if (now_s < static_cast<double>(camera.looks) / camera.geometry.rate_hz) continue;
      ++camera.looks;
      {
        const std::lock_guard lock(mutex_);
        if (orders_.size() >= cameras_.size()) {
          ++skipped_;
          continue;
        }
        orders_.push_back({i, world.snapshot(), stamp});
      }
      changed_.notify_one();
    }
  }

  void Flush() override {
    std::unique_lock lock(mutex_);
    drawn_.wait(lock, [this] { return orders_.empty() && !drawing_; });
  }

  std::uint64_t skipped() const override {
    const std::lock_guard lock(mutex_);
    return skipped_;
  }

  std::vector<ircp::TopicCount> sent() const override {
    std::vector<ircp::TopicCount> counts;
    for (const Camera& camera : cameras_) {
      counts.push_back({ircp::CameraSample::kTopic, camera.geometry.name, camera.writer->sent()});
    }
    return counts;
  }

 private:
  void Draw(Renderer& renderer, const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return !orders_.empty(); })) {
      const Order order = std::move(orders_.front());
      orders_.pop_front();
      drawing_ = true;
      lock.unlock();
      Publish(renderer, order);
      lock.lock();
      drawing_ = false;
      drawn_.notify_all();
    }
  }

  void Publish(Renderer& renderer, const Order& order) {
    Camera& camera = cameras_[order.camera];
    const auto pictures = renderer.Draw(order.snapshot, camera.geometry);
    Result<std::vector<std::uint8_t>> left =
        perception::Encode(pictures.first, options_.encoding, options_.quality);
    Result<std::vector<std::uint8_t>> right =
        perception::Encode(pictures.second, options_.encoding, options_.quality);
    if (!left || !right) {
      log_.Error("picture lost", {{"cause", (left ? right : left).error().message}});
      return;
    }
    ircp::CameraSample sample;
    sample.header.stamp = order.stamp;
    sample.calibration_id = camera.geometry.name;
    sample.encoding = options_.encoding;
    sample.left = std::move(left).value();
    sample.right = std::move(right).value();
    if (Status status = camera.writer->Write(std::move(sample)); !status) {
      log_.Warning("picture not sent", {{"cause", status.error().message}});
    }
  }

  Log& log_;
  std::vector<Camera> cameras_;
  const CameraOptions options_;
  mutable std::mutex mutex_;  ///< guards the orders and what is counted
  std::condition_variable_any changed_;
  std::condition_variable drawn_;
  std::deque<Order> orders_;
  bool drawing_ = false;
  std::uint64_t skipped_ = 0;
  std::jthread thread_;  ///< last: ends before what it uses goes
};

}  // namespace

Result<std::unique_ptr<Cameras>> Cameras::Create(ircp::Bus& bus, Log& log, const World& world,
                                                 const scene::Description& scene,
                                                 const CameraOptions& options) {
  std::vector<Camera> cameras;
  for (const scene::StereoCamera& geometry : scene.cameras) {
    auto writer = bus.MakeWriter<ircp::CameraSample>(geometry.name);
    if (!writer) return writer.error();
    cameras.push_back({geometry, std::move(writer).value()});
  }
  auto made = std::make_unique<DrawnCameras>(log, std::move(cameras), options);
  if (Status status = made->Start(world); !status) return status.error();
  return std::unique_ptr<Cameras>(std::move(made));
}

}  // namespace exemplar::simulator

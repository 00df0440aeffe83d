#include "gateway/foxglove/bridge.hpp"

#include <algorithm>
#include <utility>

#include "exemplar/base/text.hpp"
#include "gateway/foxglove/bridge_core.hpp"

namespace exemplar::gateway::foxglove {
namespace {

constexpr std::size_t kTakenAtOnce = 256;
constexpr auto kDropPeriod = std::chrono::seconds(1);
constexpr auto kTimePeriod = std::chrono::milliseconds(50);

std::span<const std::byte> BytesOf(const std::string& text) {
  return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}

class HubBridge final : public Bridge {
 public:
  HubBridge(TopicHub& hub, const Clock& clock, Log& log, std::vector<Service> services,
            BridgeOptions options)
      : core_(hub, clock, log, std::move(services), std::move(options)) {
    listening_ = hub.OnTopic([this](const api::TopicInfo& topic) { OnTopic(topic); });
    for (const api::TopicInfo& topic : hub.topics()) OnTopic(topic);
    pump_ = std::jthread([this](const std::stop_token& stop) { Pump(stop); });
  }

  ~HubBridge() override { listening_.reset(); }

  http::WebSocketEndpoint Endpoint() override {
    http::WebSocketEndpoint endpoint = core_.options.endpoint;
    endpoint.subprotocols = {kSdkV1, kWebSocketV1};
    endpoint.open =
        [this](std::shared_ptr<http::WebSocket> socket) -> std::unique_ptr<http::WebSocketSession> {
      Permission permission;
      if (core_.options.permit) permission = core_.options.permit(socket->request());
      if (permission.observe) return OpenLiveSession(core_, std::move(socket), permission);
      ++core_.refused_clients;
      socket->SendText(StatusText(StatusLevel::kError, kNotLetIn));
      return nullptr;
    };
    return endpoint;
  }

  std::uint32_t AddChannel(ChannelInfo channel) override {
    const std::lock_guard lock(core_.mutex);
    channel.id = core_.catalogue.AddOwn(channel);
    const std::string text = AdvertiseText({&channel, 1});
    for (const auto& link : Links()) link->SendText(text);
    return channel.id;
  }

  void Publish(std::uint32_t channel, Stamp time, std::string bytes, bool keep) override {
    const auto shared = std::make_shared<const std::string>(std::move(bytes));
    const std::lock_guard lock(core_.mutex);
    if (keep) core_.kept[channel] = {time, shared};
    for (const auto& link : Links()) link->Deliver(channel, time, BytesOf(*shared), shared);
  }

  Figures figures() const override {
    return {core_.clients,      core_.dropped,   core_.bad_messages, core_.calls,
            core_.failed_calls, core_.published, core_.refused,      core_.refused_clients};
  }

 private:
  /// Those that are there; forgets the others. With core_.mutex.
  std::vector<std::shared_ptr<ClientLink>> Links() {
    std::vector<std::shared_ptr<ClientLink>> open;
    std::erase_if(core_.links, [&](const std::weak_ptr<ClientLink>& link) {
      auto there = link.lock();
      if (there == nullptr) return true;
      open.push_back(std::move(there));
      return false;
    });
    return open;
  }

  void OnTopic(const api::TopicInfo& topic) {
    const std::lock_guard lock(core_.mutex);
    const Catalogue::Change change = core_.catalogue.Update(topic);
    for (const auto& link : Links()) {
      if (change.gone) {
        link->Forget(*change.gone);
        link->SendText(UnadvertiseText({&*change.gone, 1}));
      }
      if (change.come) link->SendText(AdvertiseText({&*change.come, 1}));
    }
  }

  void Pump(const std::stop_token& stop) {
    const auto period = core_.options.simulated_time
                            ? std::chrono::duration_cast<std::chrono::nanoseconds>(kTimePeriod)
                            : std::chrono::duration_cast<std::chrono::nanoseconds>(kDropPeriod);
    auto next_tick = std::chrono::steady_clock::now() + period;
    auto next_drops = next_tick;
    while (!stop.stop_requested()) {
      std::weak_ptr<Feed> ready;
      {
        std::unique_lock lock(core_.ready_mutex);
        if (core_.ready_there.wait_until(lock, stop, next_tick,
                                         [this] { return !core_.ready.empty(); })) {
          ready = std::move(core_.ready.front());
          core_.ready.pop_front();
        }
      }
      if (const auto feed = ready.lock()) Serve(feed);
      const auto now = std::chrono::steady_clock::now();
      if (now < next_tick) continue;
      next_tick = now + period;
      if (core_.options.simulated_time) TellTime();
      if (now < next_drops) continue;
      next_drops = now + kDropPeriod;
      TellDrops();
    }
  }

  void Serve(const std::shared_ptr<Feed>& feed) {
    const auto link = feed->link.lock();
    if (link == nullptr) return;
    const std::lock_guard lock(feed->mutex);
    if (feed->subscription == nullptr) return;
    taken_.clear();
    feed->subscription->Take(taken_, kTakenAtOnce);
    for (const SamplePtr& sample : taken_) {
      if (!sample->valid) continue;
      link->Deliver(feed->channel, sample->received, std::as_bytes(std::span(sample->cdr)), sample);
    }
    if (taken_.size() == kTakenAtOnce) MarkReady(core_, feed);
    taken_.clear();
  }

  void TellTime() {
    const std::string now = TimeBytes(core_.clock.Now());
    const std::lock_guard lock(core_.mutex);
    for (const auto& link : Links()) {
      link->socket().Send({.binary = true, .head = now, .droppable = true});
    }
  }

  void TellDrops() {
    const std::lock_guard lock(core_.mutex);
    for (const auto& link : Links()) {
      std::vector<std::string> parts;
      std::uint64_t all = 0;
      for (const auto& [channel, count] : link->TakeDrops()) {
        const ChannelInfo* info = core_.catalogue.Find(channel);
        all += count;
        if (info != nullptr) parts.push_back(info->topic + ": " + std::to_string(count));
      }
      if (all == 0) continue;
      core_.dropped += all;
      link->Say(StatusLevel::kWarning,
                "this client is too slow: " + std::to_string(link->socket().dropped()) +
                    " messages were dropped for it, just now " + Join(parts, ", "),
                "slow");
    }
  }

  BridgeCore core_;
  std::shared_ptr<void> listening_;
  std::vector<SamplePtr> taken_;  ///< of the pump
  std::jthread pump_;
};

}  // namespace

void MarkReady(BridgeCore& core, std::weak_ptr<Feed> feed) {
  {
    const std::lock_guard lock(core.ready_mutex);
    core.ready.push_back(std::move(feed));
  }
  core.ready_there.notify_one();
}

std::unique_ptr<Bridge> Bridge::Create(TopicHub& hub, const Clock& clock, Log& log,
                                       std::vector<Service> services, BridgeOptions options) {
  return std::make_unique<HubBridge>(hub, clock, log, std::move(services), std::move(options));
}

std::vector<Metric> MetricsOf(const Bridge& bridge) {
  using Figures = Bridge::Figures;
  const auto counter = [&](const char* name, const char* help, std::uint64_t Figures::*figure) {
    return CounterOf(std::string("exemplar_gateway_foxglove_") + name + "_total", help,
                     [&bridge, figure] { return bridge.figures().*figure; });
  };
  return {GaugeOf("exemplar_gateway_foxglove_clients", "Foxglove clients there are now.",
                  [&bridge] { return bridge.figures().clients; }),
          counter("dropped", "Messages dropped for slow Foxglove clients.", &Figures::dropped),
          counter("bad_messages", "Messages of Foxglove clients that were refused.",
                  &Figures::bad_messages),
          counter("calls", "Service calls of Foxglove clients.", &Figures::calls),
          counter("failed_calls", "Service calls that failed.", &Figures::failed_calls),
          counter("published", "Samples published by Foxglove clients.", &Figures::published),
          counter("refused_clients", "Foxglove clients without the role to observe.",
                  &Figures::refused_clients),
          counter("refused", "Samples of Foxglove clients that were refused.", &Figures::refused)};
}

}  // namespace exemplar::gateway::foxglove

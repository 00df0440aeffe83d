#include <map>
#include <utility>

#include "gateway/foxglove/bridge_core.hpp"

namespace exemplar::gateway::foxglove {
namespace {

constexpr std::size_t kMostClientChannels = 200;

/// On the HTTP server's network thread.
class LiveSession final : public http::WebSocketSession {
 public:
  LiveSession(BridgeCore& core, std::shared_ptr<http::WebSocket> socket, Permission permission)
      : core_(core),
        link_(std::make_shared<ClientLink>(std::move(socket))),
        may_publish_(permission.publish) {
    ++core_.clients;
    std::vector<std::string> capabilities = {"services"};
    if (may_publish_) capabilities.emplace_back("clientPublish");
    if (core_.options.simulated_time) capabilities.emplace_back("time");
    link_->SendText(ServerInfoText({.name = core_.options.name,
                                    .capabilities = std::move(capabilities),
                                    .encodings = {"json", "cdr"},
                                    .session = core_.options.session}));
    std::vector<ServiceInfo> services;
    for (const Service& service : core_.services) services.push_back(service.info);
    const std::lock_guard lock(core_.mutex);
    link_->SendText(AdvertiseText(core_.catalogue.channels()));
    link_->SendText(AdvertiseServicesText(services));
    core_.links.push_back(link_);
  }

  void OnText(std::string_view text) override { Handle(ParseText(text)); }
  void OnBinary(std::span<const std::byte> bytes) override { Handle(ParseBinary(bytes)); }

  void OnClose() override {
    feeds_.clear();
    --core_.clients;
  }

 private:
  void Handle(const Result<ClientMessage>& message) {
    if (!message.ok()) {
      Refuse(message.error().message);
      return;
    }
    std::visit([this](const auto& op) { Do(op); }, *message);
  }

  void Refuse(const std::string& why) {
    ++core_.bad_messages;
    link_->Say(StatusLevel::kError, why);
  }

  void Do(const SubscribeOp& op) {
    for (const SubscribeOp::One& one : op.subscriptions) {
      if (const Status done = Subscribe(one); !done.ok()) Refuse(done.error().message);
    }
  }

  Status Subscribe(SubscribeOp::One one) {
    std::string topic;
    std::optional<Kept> kept;
    {
      const std::lock_guard lock(core_.mutex);
      const ChannelInfo* channel = core_.catalogue.Find(one.channel);
      if (channel == nullptr) {
        return NotFound("there is no channel of id " + std::to_string(one.channel));
      }
      if (core_.catalogue.IsTopic(one.channel)) topic = channel->topic;
      if (const auto found = core_.kept.find(one.channel); found != core_.kept.end()) {
        kept = found->second;
      }
    }
    if (Status done = link_->Subscribe(one); !done.ok()) return done;
    if (kept) {
      link_->Deliver(one.channel, kept->time,
                     {reinterpret_cast<const std::byte*>(kept->bytes->data()), kept->bytes->size()},
                     kept->bytes);
    }
    if (topic.empty()) return {};
    const auto feed = std::make_shared<Feed>();
    feed->link = link_;
    feed->channel = one.channel;
    const std::lock_guard lock(feed->mutex);
    auto subscription = core_.hub.Subscribe(
        {.topics = {topic},
         .on_ready = [&core = core_, ready = std::weak_ptr(feed)] { MarkReady(core, ready); }});
    if (!subscription.ok()) {
      (void)link_->Unsubscribe(one.id);
      return subscription.error();
    }
    feed->subscription = std::move(*subscription);
    feeds_[one.channel] = feed;
    return {};
  }

  void Do(const UnsubscribeOp& op) {
    for (const std::uint32_t id : op.ids) {
      const Result<std::uint32_t> channel = link_->Unsubscribe(id);
      if (channel.ok()) {
        feeds_.erase(*channel);
      } else {
        Refuse(channel.error().message);
      }
    }
  }

  void Do(const AdvertiseOp& op) {
    if (!may_publish_) {
      Refuse("you may not publish");
      return;
    }
    for (const AdvertiseOp::Channel& channel : op.channels) {
      if (channel.encoding != "cdr" && channel.encoding != "json") {
        Refuse("encoding \"" + channel.encoding + "\" is not one of cdr, json");
      } else if (advertised_.size() >= kMostClientChannels) {
        Refuse("no more than " + std::to_string(kMostClientChannels) + " channels");
      } else if (!advertised_.emplace(channel.id, channel).second) {
        Refuse("channel id " + std::to_string(channel.id) + " is in use");
      }
    }
  }

  void Do(const UnadvertiseOp& op) {
    for (const std::uint32_t id : op.ids) {
      if (advertised_.erase(id) == 0) Refuse("you have no channel of id " + std::to_string(id));
    }
  }

  void Do(const UnofferedOp& op) { Refuse(op.op + " is not offered here"); }
  void Do(const PlaybackControl&) { Refuse("these are live data: there is no playback"); }

  void Do(const ClientData& data) {
    const auto found = advertised_.find(data.channel);
    if (found == advertised_.end()) {
      Refuse("you have no channel of id " + std::to_string(data.channel));
      return;
    }
    const AdvertiseOp::Channel& channel = found->second;
    api::TopicPublication publication{
        .topic = channel.topic, .type = channel.schema_name, .schema = channel.schema};
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(data.payload.data());
    if (channel.encoding == "cdr") {
      publication.cdr.assign(bytes, bytes + data.payload.size());
    } else {
      publication.json.assign(bytes, bytes + data.payload.size());
    }
    const bool queued =
        core_.publisher.Run([&core = core_, link = link_,
                             publication = std::move(publication)](const std::stop_token&) {
          Status done = publication.json.empty() ? Status() : CheckJson(publication.json);
          if (done.ok()) done = core.hub.Publish(publication);
          if (done.ok()) {
            ++core.published;
            return;
          }
          ++core.refused;
          link->Say(StatusLevel::kError, publication.topic + ": " + done.error().message,
                    "publish " + publication.topic);
        });
    if (queued) return;
    ++core_.refused;
    link_->Say(StatusLevel::kWarning, "too many messages are published at once", "publish");
  }

  void Do(const ServiceCall& call) {
    ++core_.calls;
    const Service* service = nullptr;
    for (const Service& known : core_.services) {
      if (known.info.id == call.service) service = &known;
    }
    const auto refuse = [&](const std::string& why) {
      ++core_.failed_calls;
      link_->SendText(ServiceFailureText(call.service, call.call, why));
    };
    if (service == nullptr) {
      refuse("there is no service of id " + std::to_string(call.service));
      return;
    }
    if (call.encoding != "json") {
      refuse("encoding \"" + call.encoding + "\" is not json");
      return;
    }
    std::string request(reinterpret_cast<const char*>(call.payload.data()), call.payload.size());
    const bool queued =
        core_.callers.Run([&core = core_, link = link_, service, id = call.call,
                           request = std::move(request)](const std::stop_token& stop) {
          Status json = request.empty() ? Status() : CheckJson(request);
          const Result<std::string> answer =
              json.ok() ? service->call(request, link->socket().request(), stop)
                        : Result<std::string>(json.error());
          if (answer.ok()) {
            link->SendBytes(ServiceResponseBytes(service->info.id, id, "json", *answer));
          } else {
            ++core.failed_calls;
            link->SendText(ServiceFailureText(service->info.id, id, answer.error().message));
          }
        });
    if (!queued) refuse("too many calls at once");
  }

  BridgeCore& core_;
  const std::shared_ptr<ClientLink> link_;
  const bool may_publish_;
  std::map<std::uint32_t, std::shared_ptr<Feed>> feeds_;  ///< by channel
  std::map<std::uint32_t, AdvertiseOp::Channel> advertised_;
};

}  // namespace

std::unique_ptr<http::WebSocketSession> OpenLiveSession(BridgeCore& core,
                                                        std::shared_ptr<http::WebSocket> socket,
                                                        Permission permission) {
  return std::make_unique<LiveSession>(core, std::move(socket), permission);
}

}  // namespace exemplar::gateway::foxglove

#include "gateway/foxglove/playback.hpp"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "exemplar/recording/file.hpp"
#include "exemplar/recording/reader.hpp"
#include "exemplar/replay/player.hpp"
#include "gateway/foxglove/catalogue.hpp"
#include "gateway/foxglove/client_link.hpp"
#include "gateway/foxglove/workers.hpp"

namespace exemplar::gateway::foxglove {
namespace {

constexpr Duration kTimePeriod = std::chrono::milliseconds(20);

/// One client's show: the file, where it stands, what was asked for.
class Show final : public ircp::RawOutlet {
 public:
  Show(const Clock& clock, std::shared_ptr<ClientLink> link)
      : clock_(clock), link_(std::move(link)) {}

  /// Opens the file, tells the client what is in it, and plays until `stop`.
  void Run(const std::filesystem::path& path, const std::stop_token& stop) {
    const Status ended = Play(path, stop);
    if (ended.ok()) return;
    link_->Say(StatusLevel::kError, ended.error().message);
    link_->socket().Close(1011, ended.error().message);
  }

  void Subscribe(SubscribeOp::One one) {
    const std::lock_guard lock(mutex_);
    if (channels_.Find(one.channel) == nullptr) {
      link_->Say(StatusLevel::kError, "there is no channel of id " + std::to_string(one.channel));
    } else if (const Status done = link_->Subscribe(one); !done.ok()) {
      link_->Say(StatusLevel::kError, done.error().message);
    } else if (!steered_ && paused_) {
      paused_ = false;
      if (player_ != nullptr) player_->Resume();
    }
  }

  void Control(const PlaybackControl& control) {
    const std::lock_guard lock(mutex_);
    if (!opened_) {
      link_->Say(StatusLevel::kError, "the recording is not open yet");
      return;
    }
    paused_ = !control.play;
    if (control.seek) {
      position_ = std::clamp(*control.seek - begin_, Duration(0), length_);
      told_ = Duration(-1);
    }
    if (player_ != nullptr) {
      SteerPlayer(control);
    } else {
      if (control.speed > 0) rate_ = control.speed;
      if (!paused_ && !control.seek && position_ >= length_) position_ = Duration(0);
      restart_ = control.play || control.seek;
      changed_.notify_all();
    }
    TellState(control.seek.has_value(), control.request_id);
  }

  // ircp::RawOutlet: what the player plays comes here.
  Result<std::unique_ptr<ircp::RawWriter>> MakeRawWriter(const ircp::RawTopic& topic) override {
    class Channel final : public ircp::RawWriter {
     public:
      Channel(Show& show, std::uint32_t id) : show_(show), id_(id) {}
      Status Write(std::span<const std::uint8_t> cdr, Stamp) override {
        show_.Send(id_, cdr);
        return {};
      }
      int matched_readers() const override { return 1; }
      bool WaitForAcknowledgments(Duration) override { return true; }

     private:
      Show& show_;
      const std::uint32_t id_;
    };
    const auto known = ids_.find(topic.topic);
    return std::unique_ptr<ircp::RawWriter>(
        std::make_unique<Channel>(*this, known == ids_.end() ? 0 : known->second));
  }

 private:
  Status Play(const std::filesystem::path& path, const std::stop_token& stop) {
    auto file = recording::FileSource::Open(path);
    if (!file.ok()) return file.error();
    if (const Status read = ReadContents(**file); !read.ok()) return read.error();
    while (!stop.stop_requested()) {
      auto player = replay::Player::Create(**file, *this, clock_, Options());
      if (!player.ok()) return player.error();
      {
        const std::lock_guard lock(mutex_);
        player_ = player->get();
        if (!std::exchange(opened_, true)) Introduce();
        TellState(false, "");
      }
      const Status played = (*player)->Run(stop);
      std::unique_lock lock(mutex_);
      player_ = nullptr;
      if (!played.ok()) return played.error();
      if (stop.stop_requested()) return {};
      position_ = length_;
      restart_ = false;
      TellState(false, "");
      TellDrops();
      changed_.wait(lock, stop, [this] { return restart_; });
    }
    return {};
  }

  /// One channel a topic with schema.
  Status ReadContents(recording::ByteSource& file) {
    auto reader = recording::IndexedReader::Open(file);
    if (!reader.ok()) return reader.error();
    const auto& statistics = (*reader)->statistics();
    if (!statistics) {
      return Error{ErrorCode::kDataLoss,
                   "the recording has no index (exemplar record recover makes one)"};
    }
    const std::lock_guard lock(mutex_);
    begin_ = statistics->message_start_time;
    length_ = statistics->message_end_time - begin_;
    for (const auto& entry : (*reader)->channels()) {
      const auto schema = (*reader)->schemas().find(entry.second.schema_id);
      if (schema == (*reader)->schemas().end() || schema->second.encoding != "omgidl") continue;
      const auto change = channels_.Update(
          {.topic = entry.second.topic,
           .type = schema->second.name,
           .schema = std::string(schema->second.data.begin(), schema->second.data.end())});
      if (change.come) ids_[entry.second.topic] = change.come->id;
    }
    steered_ = link_->socket().subprotocol() == kSdkV1;
    paused_ = true;
    return {};
  }

  replay::PlayOptions Options() {
    const std::lock_guard lock(mutex_);
    replay::PlayOptions options;
    options.rate = rate_;
    options.start = position_;
    options.paused = paused_;
    options.wanted = [](const std::string&) { return true; };
    return options;
  }

  // With mutex_ held, from here on.

  void Introduce() {
    std::vector<std::string> capabilities = {"time"};
    if (steered_) capabilities.emplace_back("playbackControl");
    link_->SendText(ServerInfoText({.name = "exemplar recording",
                                    .capabilities = std::move(capabilities),
                                    .range = std::pair(begin_, begin_ + length_)}));
    link_->SendText(AdvertiseText(channels_.channels()));
  }

  void SteerPlayer(const PlaybackControl& control) {
    if (control.speed > 0 && control.speed != rate_) {
      if (const Status set = player_->SetRate(control.speed); set.ok()) {
        rate_ = control.speed;
      } else {
        link_->Say(StatusLevel::kWarning, set.error().message, "speed");
      }
    }
    if (control.seek) player_->Seek(position_);
    if (paused_) {
      player_->Pause();
    } else {
      player_->Resume();
    }
  }

  void TellState(bool sought, const std::string& request_id) {
    if (!steered_) return;
    const bool ended = player_ == nullptr && !restart_;
    const PlaybackStatus status = ended     ? PlaybackStatus::kEnded
                                  : paused_ ? PlaybackStatus::kPaused
                                            : PlaybackStatus::kPlaying;
    link_->SendBytes(PlaybackStateBytes(status, begin_ + position_, rate_, sought, request_id));
  }

  void TellDrops() {
    std::uint64_t all = 0;
    for (const auto& entry : link_->TakeDrops()) all += entry.second;
    if (all == 0) return;
    link_->Say(StatusLevel::kWarning,
               "this client is too slow: " + std::to_string(all) + " messages were dropped",
               "slow");
  }

  /// On the player's thread, without mutex_.
  void Send(std::uint32_t channel, std::span<const std::uint8_t> cdr) {
    if (channel == 0) return;  // its type is not told
    const std::lock_guard lock(mutex_);
    position_ = std::min(length_, player_->status().position);
    if (position_ - told_ >= kTimePeriod || told_ > position_) {
      told_ = position_;
      link_->SendBytes(TimeBytes(begin_ + position_));
      TellDrops();
    }
    if (!link_->IsSubscribed(channel)) return;
    const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(cdr.begin(), cdr.end());
    link_->Deliver(channel, begin_ + position_, std::as_bytes(std::span(*bytes)), bytes);
  }

  const Clock& clock_;
  const std::shared_ptr<ClientLink> link_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  Catalogue channels_;
  std::map<std::string, std::uint32_t> ids_;
  Stamp begin_;
  Duration length_{0};
  Duration position_{0};
  Duration told_{-1};  ///< the last time that the client was told
  double rate_ = 1;
  bool steered_ = false;
  bool paused_ = false;
  bool opened_ = false;
  bool restart_ = false;
  replay::Player* player_ = nullptr;  ///< while it runs
};

class PlaybackSession final : public http::WebSocketSession {
 public:
  PlaybackSession(std::shared_ptr<ClientLink> link, std::shared_ptr<Show> show,
                  std::stop_source stop)
      : link_(std::move(link)), show_(std::move(show)), stop_(std::move(stop)) {}

  void OnText(std::string_view text) override { Handle(ParseText(text)); }
  void OnBinary(std::span<const std::byte> bytes) override { Handle(ParseBinary(bytes)); }
  void OnClose() override { stop_.request_stop(); }

 private:
  void Handle(const Result<ClientMessage>& message) {
    if (!message.ok()) {
      link_->Say(StatusLevel::kError, message.error().message);
    } else if (const auto* subscribe = std::get_if<SubscribeOp>(&*message)) {
      for (const SubscribeOp::One& one : subscribe->subscriptions) show_->Subscribe(one);
    } else if (const auto* unsubscribe = std::get_if<UnsubscribeOp>(&*message)) {
      for (const std::uint32_t id : unsubscribe->ids) Unsubscribe(id);
    } else if (const auto* control = std::get_if<PlaybackControl>(&*message)) {
      show_->Control(*control);
    } else {
      link_->Say(StatusLevel::kError, "a recording can only be watched");
    }
  }

  void Unsubscribe(std::uint32_t id) {
    if (const auto done = link_->Unsubscribe(id); !done.ok()) {
      link_->Say(StatusLevel::kError, done.error().message);
    }
  }

  const std::shared_ptr<ClientLink> link_;
  const std::shared_ptr<Show> show_;
  std::stop_source stop_;
};

class FolderPlayback final : public Playback {
 public:
  FolderPlayback(const Clock& clock, Log& log, PlaybackOptions options)
      : clock_(clock), log_(log), options_(std::move(options)), players_(options_.players, 1) {}

  http::WebSocketEndpoint Endpoint() override {
    http::WebSocketEndpoint endpoint = options_.endpoint;
    endpoint.subprotocols = {kSdkV1, kWebSocketV1};
    endpoint.clients = options_.players;
    endpoint.open = [this](std::shared_ptr<http::WebSocket> socket) {
      return Open(std::move(socket));
    };
    return endpoint;
  }

 private:
  std::unique_ptr<http::WebSocketSession> Open(std::shared_ptr<http::WebSocket> socket) {
    const auto& variables = socket->request().variables;
    const auto name = variables.find("file");
    const auto link = std::make_shared<ClientLink>(std::move(socket));
    if (options_.permit && !options_.permit(link->socket().request()).observe) {
      link->Say(StatusLevel::kError, kNotLetIn);
      return nullptr;
    }
    if (name == variables.end() || !IsRecordingName(name->second)) {
      link->Say(StatusLevel::kError, "this is no recording's name");
      return nullptr;
    }
    const auto show = std::make_shared<Show>(clock_, link);
    const std::stop_source stop;
    log_.Info("plays", {{"recording", name->second}, {"client", link->socket().request().peer}});
    const bool queued = players_.Run(
        [show, stop, path = options_.folder / name->second](std::stop_token workers) mutable {
          const std::stop_callback both(std::move(workers), [&stop] { stop.request_stop(); });
          show->Run(path, stop.get_token());
        });
    if (!queued) return nullptr;
    return std::make_unique<PlaybackSession>(link, show, stop);
  }

  const Clock& clock_;
  Log& log_;
  const PlaybackOptions options_;
  Workers players_;
};

}  // namespace

bool IsRecordingName(std::string_view name) {
  return name.ends_with(".mcap") && !name.starts_with('.') &&
         name.find('/') == std::string_view::npos && name.find('\\') == std::string_view::npos;
}

std::unique_ptr<Playback> Playback::Create(const Clock& clock, Log& log, PlaybackOptions options) {
  return std::make_unique<FolderPlayback>(clock, log, std::move(options));
}

}  // namespace exemplar::gateway::foxglove

// The recorder's load, in parts that tests/bench/recording.py puts together: see --help of each.
//   codec    the codec's messages a second beside a raw write of the same bytes: a JSON list of
//   rows publish  a suit, touch sensors, two cameras and many small topics onto the network drain
//   a bare raw reader that throws samples away: the least that any recorder must do

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "exemplar/base/rng.hpp"
#include "exemplar/bus/participant.hpp"
#include "exemplar/ircp/control.hpp"
#include "exemplar/program/options.hpp"
#include "exemplar/program/runtime.hpp"
#include "exemplar/recording/file.hpp"
#include "exemplar/recording/writer.hpp"

namespace exemplar {
namespace {

constexpr const char* kName = "bench_recording";
constexpr int kSmallTopics = 200;
constexpr int kSmallRateHz = 100;
constexpr int kCameraRateHz = 30;
constexpr std::size_t kPictureBytes = 60'000;  // a JPEG of 640 x 480
constexpr const char* kSmallType = "bench::Small";
constexpr const char* kSmallIdl =
    "module bench { @final struct Small { @key string source; unsigned long long seq; long long "
    "stamp_ns; double values[8]; }; };";

double Seconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

recording::Bytes RandomBytes(std::size_t size, Rng& rng) {
  recording::Bytes bytes(size);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(256 * rng.Uniform());
  return bytes;
}

/// Plain CDR of a Small: slowly moving values, as sensors have them.
recording::Bytes SmallSample(std::uint64_t seq, double phase) {
  recording::Bytes cdr = {0, 1, 0, 0, 6, 0, 0, 0, 'b', 'e', 'n', 'c', 'h', 0, 0, 0, 0, 0, 0, 0};
  const auto put = [&](const auto& value) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
    cdr.insert(cdr.end(), bytes, bytes + sizeof value);
  };
  put(seq);
  put(static_cast<std::int64_t>(seq) * 1'000'000);
  for (int i = 0; i < 8; ++i) put(phase + 0.1 * i);
  return cdr;
}

// ---- codec

struct Variant {
  const char* name;
  recording::WriterOptions options;
};

double WriteRecording(const std::filesystem::path& file, const recording::WriterOptions& options,
                      const std::vector<recording::Bytes>& messages) {
  std::filesystem::remove(file);
  return Seconds([&] {
    const auto sink = recording::FileSink::Create(file);
    auto writer = recording::Writer::Create(**sink, options);
    (void)(*writer)->AddChannel({1, 0, "ircp/suit", "cdr", {}});
    std::uint32_t number = 0;
    for (const recording::Bytes& data : messages) {
      const Stamp stamp = Stamp::FromNanoseconds(1000LL * ++number);
      if (!(*writer)->Write({1, number, stamp, stamp, data})) std::abort();
    }
    if (!(*writer)->Close()) std::abort();
  });
}

/// The same payloads, gathered into blocks as long as the codec's.
double WriteRaw(const std::filesystem::path& file, const std::vector<recording::Bytes>& messages) {
  std::filesystem::remove(file);
  return Seconds([&] {
    const auto sink = recording::FileSink::Create(file);
    recording::Bytes block;
    const auto put = [&] {
      if (!(*sink)->Write(block)) std::abort();
      block.clear();
    };
    for (const recording::Bytes& data : messages) {
      block.insert(block.end(), data.begin(), data.end());
      if (block.size() >= recording::WriterOptions().chunk_bytes) put();
    }
    put();
    if (!(*sink)->Sync()) std::abort();
  });
}

int Codec(const std::string& folder) {
  constexpr int kRounds = 5;
  constexpr int kMessages = 100'000;
  using recording::Compression;
  const auto options = [](Compression compression, bool crcs) {
    recording::WriterOptions o;
    o.compression = compression;
    o.chunk_crc = o.data_crc = o.summary_crc = crcs;
    return o;
  };
  const std::vector<Variant> variants = {{"plain", options(Compression::kNone, false)},
                                         {"crc", options(Compression::kNone, true)},
                                         {"lz4", options(Compression::kLz4, false)},
                                         {"lz4_crc", options(Compression::kLz4, true)},
                                         {"zstd", options(Compression::kZstd, false)},
                                         {"zstd_crc", options(Compression::kZstd, true)}};
  std::vector<recording::Bytes> messages;
  for (int i = 0; i < kMessages; ++i) {
    messages.push_back(SmallSample(static_cast<std::uint64_t>(i), 1e-3 * i));
    recording::Bytes& data = messages.back();
    while (data.size() < 400) data.insert(data.end(), data.begin() + 36, data.begin() + 100);
  }
  const std::filesystem::path file = std::filesystem::path(folder) / "codec.mcap";
  std::map<std::string, double> best;
  double raw = 1e300;
  for (int round = 0; round < kRounds; ++round) {  // in turn, so that all meet the same noise
    raw = std::min(raw, WriteRaw(file, messages));
    for (const Variant& variant : variants) {
      const double took = WriteRecording(file, variant.options, messages);
      const auto known = best.try_emplace(variant.name, took).first;
      known->second = std::min(known->second, took);
    }
  }
  std::filesystem::remove(file);
  nlohmann::json rows = nlohmann::json::array();
  for (const Variant& variant : variants) {
    const double took = best[variant.name];
    rows.push_back({{"name", std::string("codec_") + variant.name},
                    {"value", kMessages / took},
                    {"unit", "messages/s"},
                    {"peer", "raw write of the same bytes"},
                    {"peer_value", kMessages / raw},
                    {"ratio", took / raw}});
  }
  std::cout << rows.dump() << '\n';
  return 0;
}

// ---- publish

/// Everything that is sent, one call a millisecond.
class Load {
 public:
  static Result<std::unique_ptr<Load>> Create(bus::Participant& network) {
    auto load = std::make_unique<Load>();
    auto suit = network.MakeWriter<ircp::SuitSample>("suit");
    if (!suit) return suit.error();
    load->suit_ = std::move(*suit);
    auto touch = network.MakeWriter<ircp::TactileSample>("touch");
    if (!touch) return touch.error();
    load->touch_ = std::move(*touch);
    for (const char* name : {"left", "right"}) {
      auto camera = network.MakeWriter<ircp::CameraSample>(name);
      if (!camera) return camera.error();
      load->cameras_.push_back(std::move(*camera));
    }
    for (int i = 0; i < kSmallTopics; ++i) {
      ircp::RawTopic topic;
      topic.topic = "ircp/bench/" + std::to_string(i);
      topic.type = kSmallType;
      topic.schema = kSmallIdl;
      topic.keyed = true;
      topic.reliable = true;
      auto small = network.MakeRawWriter(topic);
      if (!small) return small.error();
      load->small_.push_back(std::move(*small));
      load->small_topics_.push_back(topic.topic);
    }
    return load;
  }

  bool AllRead() const {
    const auto read = [](const auto& writer) { return writer->matched_readers() > 0; };
    return read(suit_) && read(touch_) && std::all_of(cameras_.begin(), cameras_.end(), read) &&
           std::all_of(small_.begin(), small_.end(), read);
  }

  void Tick(std::int64_t ms) {
    ircp::SuitSample suit = suit_sample_;
    for (double& angle : suit.positions) angle = 1e-3 * static_cast<double>(ms);
    Note(suit_->Write(std::move(suit)));
    ircp::TactileSample touch = touch_sample_;
    for (double& force : touch.forces_n) force = 1e-2 * static_cast<double>(ms % 1000);
    Note(touch_->Write(std::move(touch)));
    if (ms * kCameraRateHz / 1000 != (ms + 1) * kCameraRateHz / 1000) {
      for (const auto& camera : cameras_) {
        Note(camera->Write(pictures_[next_picture_]));
        next_picture_ = (next_picture_ + 1) % pictures_.size();
      }
    }
    // Spread over the interval.
    constexpr int kEvery = 1000 / kSmallRateHz;
    for (std::size_t i = 0; i < small_.size(); ++i) {
      if (static_cast<std::int64_t>(i) % kEvery != ms % kEvery) continue;
      const auto seq = static_cast<std::uint64_t>(ms / kEvery + 1);
      Note(small_[i]->Write(SmallSample(seq, 1e-3 * static_cast<double>(ms)),
                            Stamp::FromNanoseconds(ms * 1'000'000)));
      ++small_sent_;
    }
  }

  bool WaitForAcknowledgments() {
    constexpr Duration kLimit = std::chrono::seconds(20);
    bool all = suit_->WaitForAcknowledgments(kLimit) && touch_->WaitForAcknowledgments(kLimit);
    for (const auto& writer : small_) all = writer->WaitForAcknowledgments(kLimit) && all;
    return all;
  }

  nlohmann::json Sent() const {
    std::uint64_t pictures = 0;
    for (const auto& camera : cameras_) pictures += camera->sent();
    return {{"ircp/suit", suit_->sent()},
            {"ircp/tactile", touch_->sent()},
            {"ircp/camera", pictures},
            {"small", small_sent_},
            {"refused", refused_}};
  }

  Load() {
    for (int i = 0; i < 42; ++i) suit_sample_.names.push_back("joint_" + std::to_string(i));
    suit_sample_.positions.resize(42);
    for (int i = 0; i < 50; ++i) touch_sample_.sensors.push_back("sensor_" + std::to_string(i));
    touch_sample_.forces_n.resize(50);
    Rng rng(7);
    constexpr int kPictures = 32;  // none is in one chunk twice, where it would cost nothing
    for (int i = 0; i < kPictures; ++i) {
      ircp::CameraSample& picture = pictures_.emplace_back();
      picture.calibration_id = "bench";
      picture.encoding = "jpeg";
      picture.left = RandomBytes(kPictureBytes, rng);
      picture.right = RandomBytes(1, rng);
    }
  }

 private:
  void Note(const Status& written) { refused_ += written.ok() ? 0 : 1; }

  ircp::SuitSample suit_sample_;
  ircp::TactileSample touch_sample_;
  std::vector<ircp::CameraSample> pictures_;
  std::size_t next_picture_ = 0;
  std::unique_ptr<ircp::Writer<ircp::SuitSample>> suit_;
  std::unique_ptr<ircp::Writer<ircp::TactileSample>> touch_;
  std::vector<std::unique_ptr<ircp::Writer<ircp::CameraSample>>> cameras_;
  std::vector<std::unique_ptr<ircp::RawWriter>> small_;
  std::vector<std::string> small_topics_;
  std::uint64_t small_sent_ = 0;
  std::uint64_t refused_ = 0;
};

int Publish(bus::Participant& network, const program::Signals& signals, double seconds) {
  const SystemClock clock;
  const auto load = Load::Create(network);
  if (!load) return program::Fail(kName, load.error());
  constexpr Duration kMatchLimit = std::chrono::seconds(30);
  const Duration give_up = clock.Steady() + kMatchLimit;
  while (!(*load)->AllRead()) {
    if (clock.Steady() > give_up || !clock.SleepFor(std::chrono::milliseconds(50), signals.token()))
      return program::Fail(kName, Unavailable("nobody reads"));
  }
  const auto ticks = static_cast<std::int64_t>(1000 * seconds);
  const Duration begin = clock.Steady();
  Duration latest{0};
  for (std::int64_t ms = 0; ms < ticks; ++ms) {
    const Duration due = begin + std::chrono::milliseconds(ms);
    if (!clock.SleepUntil(due, signals.token())) break;
    latest = std::max(latest, clock.Steady() - due);
    (*load)->Tick(ms);
  }
  const bool acknowledged = (*load)->WaitForAcknowledgments();
  nlohmann::json said = {{"sent", (*load)->Sent()},
                         {"acknowledged", acknowledged},
                         {"seconds", ToSeconds(clock.Steady() - begin)},
                         {"latest_ms", 1e3 * ToSeconds(latest)}};
  std::cout << said.dump() << std::endl;
  return 0;
}

// ---- drain

int Drain(bus::Participant& network, const program::Signals& signals,
          const std::string& ready_file) {
  std::atomic<std::uint64_t> received = 0;
  std::atomic<std::uint64_t> bytes = 0;
  ircp::RawTapOptions options;
  options.on_sample = [&](ircp::RawSample&& sample) {
    ++received;
    bytes += sample.cdr.size();
  };
  const auto tap = network.MakeTap(std::move(options));
  if (!tap) return program::Fail(kName, tap.error());
  std::ofstream(ready_file) << "ready\n";
  signals.Wait();
  std::cout << nlohmann::json{{"received", received.load()}, {"bytes", bytes.load()}}.dump()
            << std::endl;
  return 0;
}

}  // namespace
}  // namespace exemplar

int main(int argc, char** argv) {
  using namespace exemplar;
  std::string part;
  std::string folder = ".";
  std::string ready_file = "ready";
  double seconds = 10;
  program::Options options(kName, "Parts of the recorder's load test",
                           "bench_recording --part codec --folder /tmp", {.bus = true});
  options.Add("--part", part, "what to do").Required().OneOf({"codec", "publish", "drain"});
  options.Add("--folder", folder, "for the codec's files");
  options.Add("--seconds", seconds, "to publish").MinMax(0.1, 3600);
  options.Add("--ready-file", ready_file, "made once the bare reader listens");
  if (const std::optional<int> code = options.Parse(argc, argv)) return *code;
  if (part == "codec") return Codec(folder);
  const program::Signals signals;  // before anything that starts threads
  const auto network =
      bus::Participant::Create({.domain = options.common().domain,
                                .station = options.common().station,
                                .name = kName,
                                .shared_memory_bytes = bus::kPictureSharedMemoryBytes});
  if (!network) return program::Fail(kName, network.error());
  return part == "publish" ? Publish(**network, signals, seconds)
                           : Drain(**network, signals, ready_file);
}

#include "exemplar/program/runtime.hpp"

#include <pthread.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <condition_variable>
#include <csignal>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "exemplar/base/clock.hpp"
#include "service_manager.hpp"

namespace exemplar::program {
namespace {

spdlog::level::level_enum ToSpdlog(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

const char* Name(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return "debug";
    case LogLevel::kInfo:
      return "info";
    case LogLevel::kWarning:
      return "warning";
    case LogLevel::kError:
      return "error";
  }
  return "info";
}

class SpdLog final : public Log {
 public:
  SpdLog(const CommonOptions& options, std::string program)
      : json_(options.log_format == "json"),
        program_(std::move(program)),
        logger_(program_, std::make_shared<spdlog::sinks::stderr_sink_mt>()) {
    logger_.set_pattern("%v");
    logger_.set_level(spdlog::level::from_str(options.log_level));
    logger_.flush_on(spdlog::level::debug);
  }

  void Write(LogLevel level, std::string_view event, Fields fields) override {
    const spdlog::level::level_enum rank = ToSpdlog(level);
    if (!logger_.should_log(rank)) return;
    const std::string time = ToIso8601(SystemClock().Now());
    if (json_) {
      nlohmann::ordered_json line{
          {"time", time}, {"level", Name(level)}, {"program", program_}, {"event", event}};
      for (const LogField& field : fields) line[field.name] = field.value;
      using Handler = nlohmann::ordered_json::error_handler_t;
      logger_.log(rank, line.dump(-1, ' ', false, Handler::replace));
      return;
    }
    std::string line = time + ' ' + Name(level) + ' ' + program_ + ": " + std::string(event);
    for (const LogField& field : fields) {
      const bool quoted = field.value.empty() || field.value.find(' ') != std::string::npos;
      line += ' ' + field.name + '=' + (quoted ? '"' + field.value + '"' : field.value);
    }
    logger_.log(rank, line);
  }

 private:
  bool json_;
  std::string program_;
  spdlog::logger logger_;
};

}  // namespace

std::unique_ptr<Log> MakeLog(const CommonOptions& options, const std::string& program) {
  return std::make_unique<SpdLog>(options, program);
}

struct Signals::Impl {
  std::stop_source stop;
  std::once_flag ready;
  std::jthread waiter;
};

Signals::Signals() : impl_(std::make_unique<Impl>()) {
  std::signal(SIGPIPE, SIG_IGN);
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  impl_->waiter = std::jthread([stop = impl_->stop, set](const std::stop_token& quit) mutable {
    const timespec moment{0, 50'000'000};
    const std::chrono::microseconds period = WatchdogPeriod();
    auto next = std::chrono::steady_clock::now();
    while (!quit.stop_requested()) {
      if (sigtimedwait(&set, nullptr, &moment) > 0) {
        NotifyServiceManager("STOPPING=1");
        stop.request_stop();
      }
      if (period.count() > 0 && std::chrono::steady_clock::now() >= next) {
        NotifyServiceManager("WATCHDOG=1");
        next += period;
      }
    }
  });
}

Signals::~Signals() = default;

std::stop_token Signals::token() const {
  // Programs ask for it when all else is made.
  std::call_once(impl_->ready, NotifyServiceManager, "READY=1");
  return impl_->stop.get_token();
}

void Signals::Wait() const {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  never.wait(lock, token(), [] { return false; });
}

void Signals::Stop() { impl_->stop.request_stop(); }

int ExitCode(ErrorCode code) {
  switch (code) {
    case ErrorCode::kNotFound:
      return 3;
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kFailedPrecondition:
    case ErrorCode::kAlreadyExists:
    case ErrorCode::kDataLoss:
    case ErrorCode::kUnimplemented:
    case ErrorCode::kUnauthenticated:
    case ErrorCode::kPermissionDenied:
      return 4;
    case ErrorCode::kUnavailable:
    case ErrorCode::kDeadlineExceeded:
      return 5;
    case ErrorCode::kResourceExhausted:
    case ErrorCode::kCancelled:
    case ErrorCode::kInternal:
      return 1;
  }
  return 1;
}

int Fail(const std::string& program, const Error& error) {
  std::cerr << program << ": " << error.message << '\n';
  return ExitCode(error.code);
}

const char* Version() { return EXEMPLAR_VERSION; }

}  // namespace exemplar::program

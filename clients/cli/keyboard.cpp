#include "keyboard.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <termios.h>
#include <unistd.h>

#include <string_view>
#include <thread>

namespace exemplar::cli {
namespace {

/// The keys of what one read gave.
void TellKeys(std::string_view typed, const std::function<void(const std::string&)>& on_key) {
  constexpr std::string_view kEscape = "\033[";
  while (!typed.empty()) {
    if (typed.starts_with(kEscape) && typed.size() > kEscape.size()) {
      switch (typed[kEscape.size()]) {
        case 'A':
          on_key("up");
          break;
        case 'B':
          on_key("down");
          break;
        case 'C':
          on_key("right");
          break;
        case 'D':
          on_key("left");
          break;
        default:
          break;
      }
      typed.remove_prefix(kEscape.size() + 1);
    } else {
      on_key(std::string(1, typed.front()));
      typed.remove_prefix(1);
    }
  }
}

class TerminalKeyboard final : public Keyboard {
 public:
  TerminalKeyboard(const termios& before, int wake, std::function<void(const std::string&)> on_key)
      : before_(before),
        wake_(wake),
        reader_([this, on_key = std::move(on_key)] { Read(on_key); }) {}
  ~TerminalKeyboard() override {
    const std::uint64_t one = 1;
    if (::write(wake_, &one, sizeof one) == sizeof one) reader_.join();
    ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
    ::close(wake_);
  }

 private:
  void Read(const std::function<void(const std::string&)>& on_key) {
    while (true) {
      pollfd watched[] = {{STDIN_FILENO, POLLIN, 0}, {wake_, POLLIN, 0}};
      if (::poll(watched, 2, -1) < 0) continue;
      if (watched[1].revents != 0) return;
      char typed[64];
      const ssize_t count = ::read(STDIN_FILENO, typed, sizeof typed);
      if (count <= 0) return;
      TellKeys(std::string_view(typed, static_cast<std::size_t>(count)), on_key);
    }
  }

  const termios before_;
  const int wake_;
  std::thread reader_;
};

}  // namespace

std::unique_ptr<Keyboard> Keyboard::Open(std::function<void(const std::string&)> on_key) {
  termios before{};
  // In the background, changing the terminal would stop the program.
  if (::isatty(STDIN_FILENO) != 1 || ::tcgetpgrp(STDIN_FILENO) != ::getpgrp() ||
      ::tcgetattr(STDIN_FILENO, &before) != 0) {
    return nullptr;
  }
  const int wake = ::eventfd(0, EFD_CLOEXEC);
  if (wake < 0) return nullptr;
  termios raw = before;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  ::tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  return std::make_unique<TerminalKeyboard>(before, wake, std::move(on_key));
}

}  // namespace exemplar::cli

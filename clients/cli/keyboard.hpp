#pragma once
#include <functional>
#include <memory>
#include <string>

namespace exemplar::cli {

/// Single keys of a terminal while it lives; the terminal is then as it was. Keys are their
/// character, arrows "left", "right", "up", "down".
class Keyboard {
 public:
  /// null where there is no terminal, or this program does not stand in front.
  static std::unique_ptr<Keyboard> Open(std::function<void(const std::string& key)> on_key);
  virtual ~Keyboard() = default;
};

}  // namespace exemplar::cli

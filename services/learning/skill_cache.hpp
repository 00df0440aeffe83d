#pragma once
#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <optional>
#include <string>

#include "exemplar/learning/skill.hpp"

namespace exemplar::learning_service {

/// The versions of skills that were asked for last, so that asking again does not read the store.
/// Thread-safe.
class SkillCache {
 public:
  explicit SkillCache(std::size_t capacity) : capacity_(capacity) {}

  std::optional<learning::Skill> Find(const std::string& name, int version);
  /// What was forgotten so far: Insert takes nothing that was read before the last Forget.
  std::uint64_t epoch() const;
  void Insert(const std::string& name, const learning::Skill& skill, std::uint64_t epoch);
  /// All versions of a skill.
  void Forget(const std::string& name);

 private:
  struct Entry {
    std::string name;
    learning::Skill skill;
  };
  std::list<Entry>::iterator Locate(const std::string& name, int version);

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::uint64_t epoch_ = 0;
  std::list<Entry> entries_;  // the last used first
};

}  // namespace exemplar::learning_service

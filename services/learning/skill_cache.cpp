#include "learning/skill_cache.hpp"

#include <algorithm>

namespace exemplar::learning_service {

std::list<SkillCache::Entry>::iterator SkillCache::Locate(const std::string& name, int version) {
  return std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return entry.skill.report().version == version && entry.name == name;
  });
}

std::optional<learning::Skill> SkillCache::Find(const std::string& name, int version) {
  const std::lock_guard lock(mutex_);
  const auto found = Locate(name, version);
  if (found == entries_.end()) return std::nullopt;
  entries_.splice(entries_.begin(), entries_, found);
  return found->skill;
}

std::uint64_t SkillCache::epoch() const {
  const std::lock_guard lock(mutex_);
  return epoch_;
}

void SkillCache::Insert(const std::string& name, const learning::Skill& skill,
                        std::uint64_t epoch) {
  const std::lock_guard lock(mutex_);
  if (epoch != epoch_ || Locate(name, skill.report().version) != entries_.end()) return;
  entries_.push_front({name, skill});
  if (entries_.size() > capacity_) entries_.pop_back();
}

void SkillCache::Forget(const std::string& name) {
  const std::lock_guard lock(mutex_);
  ++epoch_;
  entries_.remove_if([&](const Entry& entry) { return entry.name == name; });
}

}  // namespace exemplar::learning_service

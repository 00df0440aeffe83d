#pragma once
#include <string>
#include <utility>

#include "learning/skills.hpp"

namespace exemplar::learning_service {

/// One holder a skill; the others are refused.
class Skills::Claim {
 public:
  static Result<Claim> Take(Skills& skills, const std::string& name) {
    const std::lock_guard lock(skills.claims_mutex_);
    if (skills.claims_.contains("")) {
      return FailedPrecondition("a backup is being restored: no skill can be changed now", "name");
    }
    if (!skills.claims_.insert(name).second) {
      return FailedPrecondition("skill \"" + name + "\" is being learned or changed already",
                                "name");
    }
    return Claim(skills, name);
  }
  static Result<Claim> TakeAll(Skills& skills) {
    const std::lock_guard lock(skills.claims_mutex_);
    if (!skills.claims_.empty()) {
      return FailedPrecondition("skill \"" + *skills.claims_.begin() +
                                "\" is being learned or changed");
    }
    skills.claims_.insert("");
    return Claim(skills, "");
  }
  Claim(Claim&& other) noexcept
      : skills_(std::exchange(other.skills_, nullptr)), name_(std::move(other.name_)) {}
  Claim& operator=(Claim&&) = delete;
  ~Claim() {
    if (!skills_) return;
    const std::lock_guard lock(skills_->claims_mutex_);
    skills_->claims_.erase(name_);
  }

 private:
  Claim(Skills& skills, std::string name) : skills_(&skills), name_(std::move(name)) {}
  Skills* skills_;
  std::string name_;
};

}  // namespace exemplar::learning_service

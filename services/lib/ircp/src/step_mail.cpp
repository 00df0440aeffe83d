#include "step_mail.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace exemplar::ircp {

int StepMail::AddWriter(std::string topic, std::string source,
                        std::function<std::uint64_t()> sent) {
  const std::lock_guard lock(mutex_);
  const int id = ++last_id_;
  // One that was made again takes the place of the one before.
  std::erase_if(writers_, [&](const auto& entry) {
    return entry.second.sent == nullptr && entry.second.count.topic == topic &&
           entry.second.count.source == source;
  });
  const auto question = std::make_shared<Question<std::uint64_t>>();
  question->ask = std::move(sent);
  writers_[id] = {{std::move(topic), std::move(source), 0}, question};
  return id;
}

void StepMail::RemoveWriter(int writer) {
  std::shared_ptr<Question<std::uint64_t>> sent;
  {
    const std::lock_guard lock(mutex_);
    sent = writers_.at(writer).sent;
  }
  const std::uint64_t last = sent->Answer(0);
  {
    const std::lock_guard lock(mutex_);
    WriterEntry& entry = writers_.at(writer);
    entry.count.sent = last;
    entry.sent = nullptr;
  }
  sent->Set(nullptr);
}

std::vector<TopicCount> StepMail::Sent() const {
  std::vector<WriterEntry> entries;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, entry] : writers_) entries.push_back(entry);
  }
  std::vector<TopicCount> counts;
  for (WriterEntry& entry : entries) {
    if (entry.sent) entry.count.sent = entry.sent->Answer(entry.count.sent);
    counts.push_back(std::move(entry.count));
  }
  return counts;
}

int StepMail::AddReader(std::string topic) {
  const std::lock_guard lock(mutex_);
  const int id = ++last_id_;
  readers_[id] = {std::move(topic),
                  std::make_shared<Question<int>>(),
                  {},
                  std::make_shared<std::recursive_mutex>()};
  return id;
}

void StepMail::SetMatched(int reader, std::function<int()> matched_writers) {
  std::shared_ptr<Question<int>> question;
  {
    const std::lock_guard lock(mutex_);
    question = readers_.at(reader).matched_writers;
  }
  question->Set(std::move(matched_writers));
}

void StepMail::RemoveReader(int reader) {
  std::shared_ptr<std::recursive_mutex> turn;
  {
    const std::lock_guard lock(mutex_);
    turn = readers_.at(reader).turn;
  }
  const std::lock_guard delivery(*turn);
  const std::lock_guard lock(mutex_);
  readers_.erase(reader);
}

void StepMail::Take(int reader, Kind kind, const Header& header, Deliver deliver) {
  {
    const std::lock_guard lock(mutex_);
    const auto it = readers_.find(reader);
    if (it == readers_.end()) return;
    Box& box = it->second.boxes[header.source];
    if (header.seq <= box.last) {
      // Another writer of that name: what is left of the one before is due.
      for (Letter& letter : box.held) letter.seq = 0;
      box.is_anothers = true;
    }
    box.last = header.seq;
    if (in_step_.count({it->second.topic, header.source}) != 0) {
      if (kind == Kind::kSample) {
        box.held.push_back({header.seq, std::move(deliver)});
        return;
      }
      if (kind == Kind::kCommand && !(open_ && header.stamp <= *open_)) {
        commands_.push_back({reader, header.stamp, std::move(deliver)});
        return;
      }
    }
  }
  DeliverTo(reader, deliver);
}

void StepMail::DeliverTo(int reader, const Deliver& deliver) {
  std::shared_ptr<std::recursive_mutex> turn;
  {
    const std::lock_guard lock(mutex_);
    const auto it = readers_.find(reader);
    if (it == readers_.end()) return;
    turn = it->second.turn;
  }
  const std::lock_guard delivery(*turn);
  {
    const std::lock_guard lock(mutex_);
    if (readers_.count(reader) == 0) return;
  }
  deliver();
}

void StepMail::Learn(const std::vector<TopicCount>& counts) {
  const std::lock_guard lock(mutex_);
  for (const TopicCount& count : counts) {
    const auto [it, is_new] = in_step_.try_emplace({count.topic, count.source}, count.sent);
    const bool is_another = !is_new && count.sent < it->second;
    it->second = count.sent;
    if (!is_new && !is_another) continue;
    for (auto& [id, reader] : readers_) {
      if (reader.topic != count.topic) continue;
      Box& box = reader.boxes[count.source];
      box.baseline = count.sent;
      box.is_matched = false;
      if (is_another && !std::exchange(box.is_anothers, false)) box.last = 0;
    }
  }
}

void StepMail::NoteMatched(const std::vector<TopicCount>& counts) {
  std::map<int, std::shared_ptr<Question<int>>> unheard;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, reader] : readers_) {
      for (const TopicCount& count : counts) {
        if (count.topic != reader.topic) continue;
        const Box& box = reader.boxes[count.source];
        if (box.last == 0 && !box.is_matched) unheard[id] = reader.matched_writers;
      }
    }
  }
  for (const auto& [id, matched_writers] : unheard) {
    if (matched_writers->Answer(0) == 0) continue;
    const std::lock_guard lock(mutex_);
    const auto reader = readers_.find(id);
    if (reader == readers_.end()) continue;
    for (const TopicCount& count : counts) {
      if (count.topic != reader->second.topic) continue;
      Box& box = reader->second.boxes[count.source];
      if (!box.is_matched) box.baseline = std::max(box.baseline, count.sent);
      box.is_matched = true;
    }
  }
}

bool StepMail::HasCome(const std::vector<TopicCount>& counts) {
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, reader] : readers_) {
      for (const TopicCount& count : counts) {
        if (count.topic != reader.topic) continue;
        const Box& box = reader.boxes[count.source];
        const bool is_awaited = box.last > 0 || box.is_matched;
        if (is_awaited && count.sent > std::max(box.last, box.baseline)) return false;
      }
    }
  }
  NoteMatched(counts);
  return true;
}

void StepMail::GiveUp(const std::vector<TopicCount>& counts) {
  const std::lock_guard lock(mutex_);
  for (auto& [id, reader] : readers_) {
    for (const TopicCount& count : counts) {
      if (count.topic == reader.topic) reader.boxes[count.source].baseline = count.sent;
    }
  }
}

void StepMail::DeliverUpTo(const std::vector<TopicCount>& counts,
                           const std::function<void()>& then) {
  struct Due {
    std::tuple<bool, std::string, std::string, int> order;
    std::deque<Letter> letters;
  };
  std::vector<Due> due;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, reader] : readers_) {
      for (const TopicCount& count : counts) {
        if (count.topic != reader.topic) continue;
        const auto box = reader.boxes.find(count.source);
        if (box == reader.boxes.end() || box->second.held.empty()) continue;
        Due& batch = due.emplace_back();
        batch.order = {count.topic == JointStateSample::kTopic, count.topic, count.source, id};
        std::deque<Letter>& held = box->second.held;
        while (!held.empty() && held.front().seq <= count.sent) {
          batch.letters.push_back(std::move(held.front()));
          held.pop_front();
        }
      }
    }
  }
  std::sort(due.begin(), due.end(), [](const Due& a, const Due& b) { return a.order < b.order; });
  for (const Due& batch : due) {
    for (const Letter& letter : batch.letters) {
      DeliverTo(std::get<int>(batch.order), letter.deliver);
      then();
    }
  }
}

void StepMail::Close() {
  const std::lock_guard lock(mutex_);
  open_.reset();
}

void StepMail::Open(Stamp now) {
  std::deque<Command> due;
  {
    const std::lock_guard lock(mutex_);
    open_ = now;
    std::deque<Command> later;
    for (Command& command : commands_) {
      (command.stamp <= now ? due : later).push_back(std::move(command));
    }
    commands_ = std::move(later);
  }
  for (const Command& command : due) DeliverTo(command.reader, command.deliver);
}

}  // namespace exemplar::ircp

#include "frame_queue.hpp"

#include <gtest/gtest.h>

#include "exemplar/base/rng.hpp"

namespace exemplar::http {
namespace {

Frame Droppable(std::uint64_t tag, std::size_t size) {
  return {.head = std::string(size, 'x'), .droppable = true, .tag = tag};
}
Frame Firm(std::uint64_t tag, std::size_t size) {
  return {.head = std::string(size, 'x'), .tag = tag};
}

std::vector<std::uint64_t> Tags(FrameQueue& queue) {
  std::vector<std::uint64_t> tags;
  while (const auto frame = queue.Pop()) tags.push_back(frame->tag);
  return tags;
}

TEST(FrameQueue, DropsTheOldestDroppableAndKeepsTheOrder) {
  FrameQueue queue({100, 3, 1000});
  queue.Push(Firm(1, 10));
  queue.Push(Droppable(2, 10));
  queue.Push(Droppable(3, 10));
  queue.Push(Firm(4, 10));
  queue.Push(Droppable(5, 10));
  EXPECT_EQ(queue.Push(Droppable(6, 10)).value(), std::vector<std::uint64_t>{2});
  EXPECT_EQ(queue.Push(Droppable(7, 90)).value(), (std::vector<std::uint64_t>{3, 5}));
  EXPECT_EQ(Tags(queue), (std::vector<std::uint64_t>{1, 4, 6, 7}));
}

TEST(FrameQueue, DropsAFrameThatIsLongerThanAllRoom) {
  FrameQueue queue({100, 3, 1000});
  queue.Push(Droppable(1, 50));
  EXPECT_EQ(queue.Push(Droppable(2, 101)).value(), std::vector<std::uint64_t>{2});
  EXPECT_EQ(Tags(queue), std::vector<std::uint64_t>{1});
}

TEST(FrameQueue, HasNoRoomForTooManyFirmFrames) {
  FrameQueue queue({100, 3, 30});
  EXPECT_TRUE(queue.Push(Firm(1, 30)));
  EXPECT_FALSE(queue.Push(Firm(2, 1)));
  queue.Pop();
  EXPECT_TRUE(queue.Push(Firm(3, 1)));
}

TEST(FrameQueue, KeepsItsBoundsAndLosesNoFirmFrameWhateverComes) {
  Rng rng(5);
  FrameQueue queue({500, 8, 1 << 20});
  std::vector<std::uint64_t> firm;
  std::vector<std::uint64_t> popped_firm;
  std::uint64_t pushed = 0;
  std::uint64_t dropped = 0;
  std::uint64_t popped = 0;
  const auto pop = [&] {
    const auto frame = queue.Pop();
    if (!frame) return;
    ++popped;
    if (!frame->droppable) popped_firm.push_back(frame->tag);
  };
  for (std::uint64_t i = 0; i < 5000; ++i) {
    const auto size = static_cast<std::size_t>(rng.Uniform(0, 200));
    const bool is_firm = rng.Uniform(0, 1) < 0.3;
    if (is_firm) firm.push_back(i);
    dropped += queue.Push(is_firm ? Firm(i, size) : Droppable(i, size))->size();
    ++pushed;
    if (rng.Uniform(0, 1) < 0.6) pop();
    ASSERT_LE(queue.frames(), 8 + firm.size() - popped_firm.size());
  }
  while (!queue.empty()) pop();
  EXPECT_EQ(pushed, dropped + popped);
  EXPECT_EQ(firm, popped_firm);
  EXPECT_EQ(queue.bytes(), 0U);
  EXPECT_GT(dropped, 100U);
}

TEST(FrameQueue, KeepsFirmFramesWhenItCloses) {
  FrameQueue queue({100, 3, 1000});
  queue.Push(Droppable(1, 10));
  queue.Push(Firm(2, 10));
  queue.Push(Droppable(3, 10));
  queue.KeepFirm();
  EXPECT_EQ(queue.bytes(), 10U);
  EXPECT_EQ(Tags(queue), std::vector<std::uint64_t>{2});
}

}  // namespace
}  // namespace exemplar::http

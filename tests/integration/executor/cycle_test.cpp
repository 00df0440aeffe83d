// What one cycle of the control loop does beside the path: sleeping, and handing commands over.

#include <gtest/gtest.h>

#include "allocation_count.hpp"
#include "executor/command_stream.hpp"
#include "exemplar/base/clock.hpp"
#include "exemplar/ircp/memory_bus.hpp"

namespace exemplar::executor {
namespace {

TEST(ControlCycle, SleepsAndHandsOverWithoutAllocation) {
  if (!test::AllocationCount::Works()) GTEST_SKIP() << "a sanitizer owns malloc";
  const SystemClock clock;
  ircp::MemoryBus bus(clock);
  auto writer = bus.MakeWriter<ircp::JointCommandSample>("executor");
  ASSERT_TRUE(writer.ok());
  CommandStream commands(*std::move(writer), {"shoulder", "elbow"}, std::chrono::seconds(1), false);
  const std::stop_source stop;
  const Setpoint setpoint;
  Duration deadline = clock.Steady();
  bool slept = true;
  int allocated = 0;
  {
    const test::AllocationCount allocations;
    for (int cycle = 0; cycle < 100; ++cycle) {
      deadline += std::chrono::microseconds(500);
      slept = clock.SleepUntil(deadline, stop.get_token()) && slept;
      slept = clock.SleepUntil(deadline, {}) && slept;
      commands.Put(setpoint);
    }
    allocated = allocations.count();
  }
  EXPECT_TRUE(slept);
  EXPECT_EQ(allocated, 0);
  EXPECT_GE(clock.Steady(), deadline);
  commands.Flush();
  EXPECT_EQ(commands.sent() + commands.dropped(), 100);
}

}  // namespace
}  // namespace exemplar::executor

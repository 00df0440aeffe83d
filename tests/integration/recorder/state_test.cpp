#include "recorder/state.hpp"

#include <gmock/gmock.h>

namespace exemplar::recorder {
namespace {

constexpr State kStates[] = {State::kClosed, State::kReady, State::kRecording, State::kPaused,
                             State::kStopped};

TEST(RecorderState, FollowsATrialFromStartToStop) {
  State state = State::kClosed;
  const std::pair<Event, State> steps[] = {
      {Event::kOpen, State::kReady},       {Event::kStart, State::kRecording},
      {Event::kPause, State::kPaused},     {Event::kPause, State::kPaused},
      {Event::kResume, State::kRecording}, {Event::kStop, State::kStopped},
      {Event::kStop, State::kStopped},     {Event::kStart, State::kRecording},
      {Event::kFail, State::kStopped},     {Event::kClose, State::kClosed}};
  for (const auto& [event, expected] : steps) {
    const Result<State> next = Next(state, event);
    ASSERT_TRUE(next.ok()) << next.error().message;
    EXPECT_EQ(*next, expected);
    state = *next;
  }
}

TEST(RecorderState, AMarkBeginsARecordingOnlyWhereThereIsNone) {
  EXPECT_EQ(*Next(State::kReady, Event::kMark), State::kRecording);
  EXPECT_EQ(*Next(State::kStopped, Event::kMark), State::kRecording);
  EXPECT_EQ(*Next(State::kRecording, Event::kMark), State::kRecording);
  EXPECT_EQ(*Next(State::kPaused, Event::kMark), State::kPaused);
  EXPECT_FALSE(Next(State::kClosed, Event::kMark).ok());
}

TEST(RecorderState, RefusesWhatDoesNotFollowByName) {
  EXPECT_EQ(Next(State::kReady, Event::kStop).error().message,
            "the recorder is ready, it cannot stop");
  EXPECT_FALSE(Next(State::kRecording, Event::kStart).ok());
  EXPECT_FALSE(Next(State::kPaused, Event::kStart).ok());
  EXPECT_FALSE(Next(State::kReady, Event::kPause).ok());
  EXPECT_FALSE(Next(State::kStopped, Event::kResume).ok());
  for (const State state : kStates) {
    EXPECT_EQ(Next(state, Event::kOpen).ok(), state == State::kClosed);
  }
}

TEST(RecorderState, CanBeClosedFromAnyStateAndTakesNothingThen) {
  for (const State state : kStates) EXPECT_EQ(*Next(state, Event::kClose), State::kClosed);
  for (const Event event : {Event::kStart, Event::kStop, Event::kPause, Event::kResume}) {
    EXPECT_FALSE(Next(State::kClosed, event).ok()) << ToString(event);
  }
}

}  // namespace
}  // namespace exemplar::recorder

#include "odometry/inertial/silence.h"

#include <gtest/gtest.h>

namespace arex {
namespace {

/// Asks every 5 ms while corrections of every 0.1 s come `late_s` late, and none between two times.
/// @returns how often the answer changed, and the last one
struct Answers {
  int changes = 0;
  bool last = false;
};
Answers ask(double late_s, double until_s, double from_silent_s = 1e9, double to_silent_s = 1e9) {
  constexpr double kPeriod_s = 0.1, kStep_s = 0.005;
  Silence silence(0.35);
  Answers answers;
  double newest = 0;
  int next = 1;
  for (int i = 0; i * kStep_s < until_s; ++i) {
    const double now = i * kStep_s, stamp = next * kPeriod_s;
    if (now >= stamp + late_s) {
      ++next;
      if (stamp < from_silent_s || stamp >= to_silent_s) {
        newest = stamp;
        silence.end_interval();
      }
    }
    const bool silent = silence.wait(now - newest);
    answers.changes += silent != answers.last;
    answers.last = silent;
  }
  return answers;
}

TEST(Silence, CorrectionsOnTimeAreNone) {
  EXPECT_EQ(ask(0.03, 5).changes, 0);
  EXPECT_EQ(ask(0.2, 5).changes, 0);  // 0.3 s old at most
}

TEST(Silence, OneThatEndsChangesTwice) {
  const Answers answers = ask(0.03, 5, 2, 3);
  EXPECT_EQ(answers.changes, 2);
  EXPECT_FALSE(answers.last);
}

// 0.27 s old as they come, 0.37 s before the next: an answer for each moment changes twenty times a
// second, and whoever slows down by it never gets anywhere.
TEST(Silence, CorrectionsThatAllComeTooLateAreOneSilence) {
  const Answers answers = ask(0.27, 5);
  EXPECT_EQ(answers.changes, 1);
  EXPECT_TRUE(answers.last);
}

}  // namespace
}  // namespace arex

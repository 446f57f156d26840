#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <vector>

#include "config/config.h"
#include "worlds/file_contained.h"

namespace arex::worlds {
namespace {

std::string complaint(const std::function<std::string()>& job, const ContainedLimits& limits = {}) {
  try {
    run_contained(job, limits);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "none";
}

TEST(Contained, HandsOverWhatTheJobSays) {
  const std::string long_answer(3'000'000, 'x');
  EXPECT_EQ(run_contained([&] { return long_answer; }), long_answer);
  EXPECT_EQ(run_contained([] { return std::string(); }), "");
}

TEST(Contained, ThrowsWhatTheJobThrows) {
  EXPECT_EQ(complaint([]() -> std::string { throw std::runtime_error("is no mesh"); }),
            "is no mesh");
  EXPECT_NE(complaint([]() -> std::string { throw 7; }), "none");
}

TEST(Contained, CrashesStayInside) {
  EXPECT_NE(complaint([]() -> std::string {
              std::signal(SIGSEGV, SIG_DFL);  // sanitizers catch it and exit
              std::raise(SIGSEGV);
              return "";
            }).find("crashed"),
            std::string::npos);
  EXPECT_NE(complaint([]() -> std::string { std::abort(); }).find("crashed"), std::string::npos);
  EXPECT_NE(complaint([]() -> std::string { _exit(3); }), "none");
}

TEST(Contained, WhatHangsComesToAnEnd) {
  EXPECT_NE(complaint(
                []() -> std::string {
                  for (volatile bool on = true; on;) {
                  }
                  return "";
                },
                {.cpu_s = 0.2})
                .find("did not come to an end"),
            std::string::npos);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(Contained, HungerForMemoryIsRefused) {
  const ContainedLimits limits{.memory_bytes = std::size_t{2} << 30};
  EXPECT_NE(complaint(
                []() -> std::string {
                  std::vector<char> much(std::size_t{4} << 30, 'x');
                  return {much.back()};
                },
                limits)
                .find("memory"),
            std::string::npos);
}
#endif

}  // namespace
}  // namespace arex::worlds

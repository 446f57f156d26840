#include "jobs/job_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "math/random.h"

namespace arex {
namespace {

constexpr Stamp kMs = kNanosecondsPerTick;

TEST(JobQueue, ResultsBecomeVisibleAtTheModelledTimeForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 4}) {
    JobQueue jobs(threads);
    const auto lane = jobs.add_lane("a");
    bool visible = false;
    jobs.start(lane, 0, 20 * kMs, [&] { return [&] { visible = true; }; });
    jobs.advance(19 * kMs);
    EXPECT_FALSE(visible);
    jobs.advance(20 * kMs);
    EXPECT_TRUE(visible);
  }
}

TEST(JobQueue, ALaneRunsOneJobAfterTheOther) {
  JobQueue jobs(4);
  const auto lane = jobs.add_lane("a");
  std::atomic<int> inside{0};
  std::vector<Stamp> visible_at;
  for (int i = 0; i < 20; ++i) {
    visible_at.push_back(jobs.start(lane, 0, 5 * kMs, [&inside] {
      EXPECT_EQ(++inside, 1);
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      --inside;
      return JobQueue::Delivery{};
    }));
  }
  for (int i = 0; i < 20; ++i)
    EXPECT_EQ(visible_at[static_cast<std::size_t>(i)], (i + 1) * 5 * kMs);
  EXPECT_FALSE(jobs.is_free(lane, 99 * kMs));
  EXPECT_TRUE(jobs.is_free(lane, 100 * kMs));
  jobs.advance(100 * kMs);
  EXPECT_EQ(jobs.timings().at(0).seconds.size(), 20u);
}

TEST(JobQueue, JobsSideBySideShareTheThreadsAndDeliverInOrder) {
  // Each job ends when all three have begun.
  JobQueue jobs(3);
  const auto lane = jobs.add_lane("a", JobQueue::Order::kSideBySide);
  std::atomic<int> begun{0};
  std::vector<int> seen;
  std::vector<int> together(3, 0);
  for (int i = 0; i < 3; ++i) {
    jobs.schedule(lane, kMs, [&, i]() -> JobQueue::Delivery {
      ++begun;
      for (int n = 0; n < 5000 && begun < 3; ++n) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      together[static_cast<std::size_t>(i)] = begun;
      std::this_thread::sleep_for(std::chrono::milliseconds(20 * (2 - i)));  // the last ends first
      return [&seen, i] { seen.push_back(i); };
    });
  }
  jobs.advance(kMs);
  EXPECT_EQ(together, (std::vector<int>{3, 3, 3}));
  EXPECT_EQ(seen, (std::vector<int>{0, 1, 2}));
}

// The whole point: random jobs on several lanes, whose deliveries start new jobs, give one and the
// same sequence of deliveries with 1, 2 and 4 threads.
TEST(JobQueue, DeliveriesAreTheSameForAnyNumberOfThreads) {
  auto run = [](int threads, std::uint64_t seed) {
    JobQueue jobs(threads);
    std::vector<JobQueue::Lane> lanes;
    for (int i = 0; i < 3; ++i) {
      lanes.push_back(jobs.add_lane(
          "lane", i == 1 ? JobQueue::Order::kSideBySide : JobQueue::Order::kOneByOne));
    }
    std::vector<std::uint64_t> log;
    RandomStream random(seed, "jobs");
    for (Stamp now = 0; now < 300 * kMs; now += kMs) {
      jobs.advance(now);
      if (random.uniform() < 0.2) {
        const auto lane = lanes[static_cast<std::size_t>(random.uniform_int(0, 2))];
        const Stamp latency = random.uniform_int(0, 30) * kMs;
        const std::uint64_t value = random.bits();
        const auto spin = std::chrono::microseconds(random.uniform_int(0, 300));
        jobs.start(lane, now, latency, [&, value, now, spin]() -> JobQueue::Delivery {
          std::this_thread::sleep_for(spin);
          return [&, value, now] {
            log.push_back(value);
            if (value % 3 == 0) {
              jobs.start(lanes[0], now + 40 * kMs, 2 * kMs, [&, value]() -> JobQueue::Delivery {
                return [&, value] { log.push_back(value + 1); };
              });
            }
          };
        });
      }
    }
    jobs.advance(1000 * kMs);
    return log;
  };
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const auto alone = run(1, seed);
    EXPECT_GT(alone.size(), 30u);
    EXPECT_EQ(alone, run(2, seed));
    EXPECT_EQ(alone, run(4, seed));
  }
}

TEST(JobQueue, ScheduledDeviceWorkKeepsTheCallersTime) {
  for (const int threads : {1, 3}) {
    JobQueue jobs(threads);
    const auto lane = jobs.add_lane("lidar");
    std::vector<int> seen;
    for (int part = 0; part < 5; ++part) {
      jobs.schedule(lane, 100 * kMs,
                    [&seen, part] { return [&seen, part] { seen.push_back(part); }; });
    }
    EXPECT_TRUE(jobs.is_free(lane, 0));
    jobs.advance(99 * kMs);
    EXPECT_TRUE(seen.empty());
    jobs.advance(100 * kMs);
    EXPECT_EQ(seen, (std::vector<int>{0, 1, 2, 3, 4}));
  }
}

TEST(JobQueue, TheCallerTakesOtherLanesJobsWhileItWaits) {
  // Both threads are needed at once: the job that is waited for ends when the other one has run,
  // which is due much later.
  JobQueue jobs(2);
  const auto urgent = jobs.add_lane("urgent"), idle = jobs.add_lane("idle");
  std::atomic<bool> ran{false};
  bool seen = false;
  jobs.start(urgent, 0, kMs, [&]() -> JobQueue::Delivery {
    for (int i = 0; i < 5000 && !ran; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return [&seen, together = ran.load()] { seen = together; };
  });
  jobs.schedule(idle, 1000 * kMs, [&]() -> JobQueue::Delivery {
    ran = true;
    return nullptr;
  });
  jobs.advance(kMs);
  EXPECT_TRUE(seen);
}

TEST(JobQueue, TheCallerLeavesLongJobsToOthersWhileItWaitsForAShortOne) {
  JobQueue jobs(2);
  const auto quick = jobs.add_lane("quick"), slow = jobs.add_lane("slow");
  // What the lanes' jobs take, as the queue comes to know it: CPU time.
  jobs.schedule(quick, kMs, [] { return JobQueue::Delivery{}; });
  jobs.schedule(slow, kMs, []() -> JobQueue::Delivery {
    const std::clock_t begin = std::clock();
    while (std::clock() - begin < CLOCKS_PER_SEC / 50) {
    }
    return nullptr;
  });
  jobs.advance(kMs);
  std::atomic<bool> begun{false}, slow_begun{false}, slow_waited{false};
  jobs.schedule(quick, 2 * kMs, [&]() -> JobQueue::Delivery {
    begun = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    slow_waited = !slow_begun;
    return nullptr;
  });
  while (!begun) std::this_thread::yield();  // by the other thread
  jobs.schedule(slow, 3 * kMs, [&]() -> JobQueue::Delivery {
    slow_begun = true;
    return nullptr;
  });
  jobs.advance(2 * kMs);
  EXPECT_TRUE(slow_waited);
  jobs.advance(3 * kMs);
  EXPECT_TRUE(slow_begun);
}

TEST(JobQueue, DoesEachPieceOfASplitJobOnce) {
  for (const int threads : {1, 2, 5}) {
    JobQueue jobs(threads);
    const auto lane = jobs.add_lane("a"), other = jobs.add_lane("b");
    std::vector<int> done(100, 0), done_of_other(7, 0);
    bool delivered = false;
    jobs.schedule(lane, kMs, [&]() -> JobQueue::Delivery {
      jobs.split(done.size(), [&](std::size_t i) { ++done[i]; });
      const bool all = done == std::vector<int>(100, 1);
      jobs.split(0, [](std::size_t) { ADD_FAILURE(); });
      return [&delivered, all] { delivered = all; };
    });
    jobs.schedule(other, kMs, [&]() -> JobQueue::Delivery {
      jobs.split(done_of_other.size(), [&](std::size_t i) { ++done_of_other[i]; });
      return nullptr;
    });
    jobs.advance(kMs);
    EXPECT_TRUE(delivered);
    EXPECT_EQ(done_of_other, std::vector<int>(7, 1));
  }
}

TEST(JobQueue, ThreadsWithoutAJobHelpWithPiecesOfAnothersAndTheJobIsChargedForThem) {
  // Each piece ends when all four have begun: one on each thread, the caller's included.
  JobQueue jobs(4);
  const auto lane = jobs.add_lane("a");
  std::atomic<int> begun{0};
  std::vector<int> together(4, 0);
  jobs.schedule(lane, kMs, [&]() -> JobQueue::Delivery {
    jobs.split(4, [&](std::size_t i) {
      ++begun;
      for (int k = 0; k < 5000 && begun < 4; ++k)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      together[i] = begun;
      const auto thread_s = [] {
        timespec t{};
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
        return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
      };
      const double begin = thread_s();
      while (thread_s() - begin < 0.01) {
      }
    });
    return nullptr;
  });
  jobs.advance(kMs);
  EXPECT_EQ(together, std::vector<int>(4, 4));
  ASSERT_EQ(jobs.timings().at(lane).seconds.size(), 1u);
  EXPECT_GE(jobs.timings().at(lane).seconds[0], 0.04F);
}

TEST(JobQueue, RethrowsWhatThePieceOfTheLeastNumberThrew) {
  for (const int threads : {1, 3}) {
    JobQueue jobs(threads);
    const auto lane = jobs.add_lane("a");
    jobs.schedule(lane, kMs, [&]() -> JobQueue::Delivery {
      jobs.split(20, [](std::size_t i) {
        if (i % 7 == 3) throw std::runtime_error(std::to_string(i));
      });
      return nullptr;
    });
    try {
      jobs.advance(kMs);
      ADD_FAILURE() << "threw nothing";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "3");
    }
  }
}

TEST(JobQueue, RethrowsWhatAJobThrew) {
  for (const int threads : {1, 3}) {
    JobQueue jobs(threads);
    const auto lane = jobs.add_lane("a");
    jobs.start(lane, 0, kMs, []() -> JobQueue::Delivery { throw std::runtime_error("broken"); });
    EXPECT_THROW(jobs.advance(kMs), std::runtime_error);
  }
}

}  // namespace
}  // namespace arex

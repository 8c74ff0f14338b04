// Work shared out among threads: what is called, by whom, and what is thrown.
#include "base/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <mutex>
#include <set>
#include <stdexcept>
#include <vector>

namespace palpate::parallel_test {
namespace {

TEST(ParallelFor, CallsEveryItemOnce) {
  for (const int jobs : {1, 2, 3, 8}) {
    for (const std::int64_t count : {0, 1, 2, 7, 1000}) {
      std::vector<std::atomic<int>> calls(static_cast<std::size_t>(count));
      parallel_for(count, jobs, [&](std::int64_t item, int worker) {
        ++calls.at(static_cast<std::size_t>(item));
        EXPECT_GE(worker, 0);
        EXPECT_LT(worker, jobs);
      });
      for (const std::atomic<int>& of_item : calls) EXPECT_EQ(of_item, 1) << count << ", " << jobs;
    }
  }
}

// All of them have to be there at once for the latch to open.
TEST(ParallelFor, WorkersHaveNumbersOfTheirOwn) {
  constexpr int jobs = 4;
  std::latch all(jobs);
  std::mutex mutex;
  std::set<int> workers;
  parallel_for(jobs, jobs, [&](std::int64_t, int worker) {
    all.arrive_and_wait();
    const std::scoped_lock lock(mutex);
    EXPECT_TRUE(workers.insert(worker).second) << worker;
  });
  EXPECT_EQ(workers, (std::set<int>{0, 1, 2, 3}));
}

TEST(ParallelFor, MoreJobsThanItems) {
  std::atomic<int> calls = 0;
  parallel_for(2, 16, [&](std::int64_t, int) { ++calls; });
  EXPECT_EQ(calls, 2);
}

TEST(ParallelFor, OneJobTakesTheItemsInOrderOnTheThreadThatCalls) {
  std::vector<std::int64_t> items;
  const std::thread::id caller = std::this_thread::get_id();
  parallel_for(5, 1, [&](std::int64_t item, int) {
    items.push_back(item);
    EXPECT_EQ(std::this_thread::get_id(), caller);
  });
  EXPECT_EQ(items, (std::vector<std::int64_t>{0, 1, 2, 3, 4}));
}

TEST(ParallelFor, ThrowsWhatACallThrew) {
  for (const int jobs : {1, 2, 4}) {
    std::atomic<int> calls = 0;
    try {
      parallel_for(1000000, jobs, [&](std::int64_t item, int) {
        ++calls;
        if (item == 10) throw std::runtime_error("item 10");
      });
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "item 10");
    }
    EXPECT_GE(calls, 11);
    EXPECT_LT(calls, 1000000) << "items were begun after one threw";
  }
}

TEST(ParallelFor, ThrowsOneOfMany) {
  EXPECT_THROW(parallel_for(100, 4, [](std::int64_t, int) { throw std::logic_error("each"); }),
               std::logic_error);
}

}  // namespace
}  // namespace palpate::parallel_test

// Results as bytes, and work that threads share.
#include "precompute/numerics/sharing.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <atomic>
#include <numbers>

namespace palpate::sharing_test {
namespace {

TEST(Parcel, GivesWhatItTook) {
  int number = 7;
  std::vector<double> none, some = {1.0, -0.0, std::numbers::pi};
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(3, 5), empty(0, 4);
  std::array<float, 2> fixed = {1.5F, 2.5F};
  Parcel taking;
  taking.carry(number);
  taking.carry(none);
  taking.carry(some);
  taking.carry(matrix);
  taking.carry(empty);
  taking.carry(std::span<float>(fixed));

  int number_there = 0;
  std::vector<double> none_there = {1.0}, some_there;
  Eigen::MatrixXd matrix_there, empty_there = Eigen::MatrixXd::Ones(2, 2);
  std::array<float, 2> fixed_there = {};
  Parcel giving(taking.bytes());
  giving.carry(number_there);
  giving.carry(none_there);
  giving.carry(some_there);
  giving.carry(matrix_there);
  EXPECT_FALSE(giving.empty());
  giving.carry(empty_there);
  giving.carry(std::span<float>(fixed_there));
  EXPECT_TRUE(giving.empty());
  EXPECT_EQ(number_there, number);
  EXPECT_EQ(none_there, none);
  EXPECT_EQ(some_there, some);
  EXPECT_EQ(matrix_there, matrix);
  EXPECT_EQ(empty_there.rows(), 0);
  EXPECT_EQ(empty_there.cols(), 4);
  EXPECT_EQ(fixed_there, fixed);
}

TEST(ThreadSharing, WorksOnEachItemOnceAndTellsTheShare) {
  for (const int jobs : {1, 3}) {
    ThreadSharing threads(jobs);
    std::vector<std::atomic<int>> calls(100);
    double share = 0.0;
    SharedItems items;
    items.count = 100;
    items.work = [&](std::int64_t item, int worker) {
      ++calls.at(static_cast<std::size_t>(item));
      EXPECT_LT(worker, jobs);
    };
    items.done = [&](double now) {
      EXPECT_GT(now, share);
      share = now;
      return true;
    };
    EXPECT_TRUE(threads.for_each(items));
    EXPECT_EQ(share, 1.0);
    for (const std::atomic<int>& of_item : calls) EXPECT_EQ(of_item, 1);
  }
}

TEST(ThreadSharing, StopsWhereItIsTold) {
  ThreadSharing one(1);
  int calls = 0;
  SharedItems items;
  items.count = 10;
  items.work = [&](std::int64_t, int) { ++calls; };
  items.done = [&](double share) { return share < 0.4; };
  EXPECT_FALSE(one.for_each(items));
  EXPECT_EQ(calls, 4);
}

}  // namespace
}  // namespace palpate::sharing_test

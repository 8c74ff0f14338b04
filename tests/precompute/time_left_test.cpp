// The time that is left of a precomputation, without a clock: `now` is told.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "precompute/progress.h"

namespace palpate::time_left_test {
namespace {

/// A stage as it really is: seconds, and whether it says how far it is.
struct Real {
  double seconds;
  bool says;
};

struct Moment {
  double now, left, truth;
  bool measured;
};

/// Every tenth of a second of a run: what is said to be left, and what is.
std::vector<Moment> follow(const std::vector<Stage>& planned, const std::vector<Real>& real) {
  TimeLeft time_left;
  time_left.plan(planned);
  double whole = 0.0;
  for (const Real& stage : real) whole += stage.seconds;
  std::vector<Moment> moments;
  double begun = 3.0;  // meshing took so long
  for (std::size_t k = 0; k < real.size(); ++k) {
    time_left.begin(planned[k].name, begun);
    for (double spent = 0.0; spent < real[k].seconds; spent += 0.1) {
      const double now = begun + spent;
      if (real[k].says && spent > 0.0) time_left.reach(spent / real[k].seconds, now);
      moments.push_back({now, time_left.seconds(now), whole - (now - 3.0), time_left.measured()});
    }
    begun += real[k].seconds;
  }
  return moments;
}

const std::vector<Stage> plan = {{"factor", 6.0}, {"columns", 50.0}, {"write", 4.0}};

TEST(TimeLeft, CountsAllStagesFromTheStart) {
  TimeLeft time_left;
  EXPECT_FALSE(time_left.known());
  time_left.plan(plan);
  EXPECT_TRUE(time_left.known());
  EXPECT_FALSE(time_left.measured());
  time_left.begin("factor", 3.0);
  EXPECT_DOUBLE_EQ(time_left.seconds(3.0), 60.0);
}

TEST(TimeLeft, FallsAsTimeGoesByWhenThePlanIsRight) {
  const std::vector<Moment> moments = follow(plan, {{6.0, false}, {50.0, true}, {4.0, false}});
  double before = 1e9;
  for (const Moment& moment : moments) {
    EXPECT_LE(moment.left, before + 1e-9) << "at " << moment.now;
    EXPECT_NEAR(moment.left, moment.truth, 0.1) << "at " << moment.now;
    before = moment.left;
  }
}

TEST(TimeLeft, LearnsHowSlowTheMachineIs) {
  for (const double slow : {0.2, 3.0, 8.0}) {
    const std::vector<Moment> moments =
        follow(plan, {{6.0 * slow, false}, {50.0 * slow, true}, {4.0 * slow, false}});
    for (const Moment& moment : moments) {
      if (moment.truth < 5.0 * slow) break;  // the last stage says nothing of itself
      // Never less than the plan's own error; and right once a tenth is done.
      EXPECT_GT(moment.left, 0.9 * moment.truth * std::min(1.0, 1.0 / slow));
      EXPECT_LT(moment.left, 1.1 * moment.truth * std::max(1.0, 1.0 / slow));
      if (!moment.measured) continue;
      EXPECT_GT(moment.left, 0.7 * moment.truth) << "slow " << slow << " at " << moment.now;
      EXPECT_LT(moment.left, 1.6 * moment.truth) << "slow " << slow << " at " << moment.now;
    }
  }
}

TEST(TimeLeft, CorrectsAStageThatWasMisjudgedByItsOwnShares) {
  // The columns take five times as long as planned, all else is right.
  const std::vector<Moment> moments = follow(plan, {{6.0, false}, {250.0, true}, {4.0, false}});
  for (const Moment& moment : moments) {
    if (moment.now < 3.0 + 6.0 + 25.0 || moment.truth < 4.0) continue;  // from a tenth of the stage on
    EXPECT_GT(moment.left, 0.9 * moment.truth) << "at " << moment.now;
    // The writing, 4 s, is believed to be as slow as the columns were.
    EXPECT_LT(moment.left, 1.1 * moment.truth + 4.0 * 4.0) << "at " << moment.now;
  }
}

TEST(TimeLeft, NeverSaysThatAStageIsOverWhichIsNot) {
  TimeLeft time_left;
  time_left.plan(plan);
  time_left.begin("factor", 0.0);
  for (double now = 0.0; now < 600.0; now += 1.0)  // a hundred times as long
    EXPECT_GE(time_left.seconds(now), 54.0) << "at " << now;
  EXPECT_GE(time_left.seconds(600.0), 54.0 + 60.0);
}

TEST(TimeLeft, PassesOverWhatWasKeptFromAnEarlierRun) {
  TimeLeft time_left;
  time_left.plan(plan);
  time_left.begin("factor", 0.0);
  time_left.expect("columns", 5.0);  // nine tenths were kept
  EXPECT_DOUBLE_EQ(time_left.seconds(0.0), 15.0);
  time_left.begin("columns", 6.0);
  time_left.expect("columns", 500.0);  // too late: it is under way
  EXPECT_DOUBLE_EQ(time_left.seconds(6.0), 9.0);
  time_left.begin("something else", 7.0);
  time_left.reach(1.0, 11.0);
  EXPECT_DOUBLE_EQ(time_left.seconds(11.0), 4.0);
}

TEST(Waiting, IsToldOnceItIsLong) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const int error = ::dup(STDERR_FILENO);
  ::dup2(ends[1], STDERR_FILENO);
  std::string said(200, '\0');
  { const Waiting at_once("nothing", std::chrono::hours(1)); }
  {
    const Waiting waiting("reading organ.stl", std::chrono::milliseconds(1));
    said.resize(static_cast<std::size_t>(::read(ends[0], said.data(), said.size())));
  }
  ::dup2(error, STDERR_FILENO);
  for (const int end : {ends[0], ends[1], error}) ::close(end);
  EXPECT_NE(said.find("reading organ.stl"), std::string::npos) << said;
  EXPECT_EQ(said.find("nothing"), std::string::npos) << said;
}

TEST(TimeLeft, IsWrittenInNoMoreDigitsThanAnEstimateHas) {
  EXPECT_EQ(duration_text(0.0), "0 s");
  EXPECT_EQ(duration_text(0.2), "1 s");
  EXPECT_EQ(duration_text(59.5), "1 min");
  EXPECT_EQ(duration_text(61.0), "1 min 10 s");
  EXPECT_EQ(duration_text(163.0), "2 min 50 s");
  EXPECT_EQ(duration_text(600.0), "10 min");
  EXPECT_EQ(duration_text(640.0), "11 min");
  EXPECT_EQ(duration_text(3599.0), "1 h 0 min");
  EXPECT_EQ(duration_text(7500.0), "2 h 5 min");
}

}  // namespace
}  // namespace palpate::time_left_test

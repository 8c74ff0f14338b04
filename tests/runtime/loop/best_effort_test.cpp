// What a run's report says of ticks whose force was a best effort.
#include "runtime/loop/best_effort.h"

#include <gtest/gtest.h>

#include "runtime/app/best_effort_report.h"

namespace palpate::best_effort_test {
namespace {

TEST(BestEffort, CountsWhatWasCutShortAndWhatWasLeftOut) {
  BestEffort found;
  found.add(StepStatus::ok, 1.0, 0.0, 0, 0.1);
  found.add(StepStatus::capacity_full, 1.0, 0.0, 0, 0.2);  // none of those without room was pressed
  found.add(StepStatus::not_converged | StepStatus::handing_over, 2.0, 0.02, 0, 0.3);
  found.add(StepStatus::not_converged, 2.0, 0.04, 0, 0.4);
  found.add(StepStatus::capacity_full, 1.0, 0.5, 7, 0.5);
  found.add(StepStatus::capacity_full, 0.25, 0.5, 3, 0.6);
  EXPECT_EQ(found.ticks, 4);
  EXPECT_EQ(found.not_converged_ticks, 2);
  EXPECT_EQ(found.left_out_ticks, 2);
  EXPECT_EQ(found.most_left_out, 7);
  EXPECT_EQ(found.late_ticks, 0);
  EXPECT_EQ(found.largest_error, 0.5);
  EXPECT_EQ(found.largest_error_time, 0.5) << "the first";
  EXPECT_EQ(found.largest_share, 1.0) << "more than the whole force";
  EXPECT_NEAR(found.median_error(), 0.04, 0.06 * 0.04);
  EXPECT_NEAR(found.median_share(), 0.02, 0.06 * 0.02);
}

TEST(BestEffort, CountsABodyThatStoodStill) {
  BestEffort found;
  found.add(StepStatus::late_motion, 1.0, 0.0, 0, 0.1);  // the force does not depend on it
  EXPECT_EQ(found.ticks, 0);
  found.add(StepStatus::late_motion, 2.0, 1.5, 0, 0.2);
  EXPECT_EQ(found.ticks, 1);
  EXPECT_EQ(found.late_ticks, 1);
  EXPECT_EQ(found.largest_error, 1.5);
  EXPECT_NE(in_words(found, 1000).find(": the body stood still in 1 of them"), std::string::npos);
}

TEST(BestEffort, MediansOverManyDecades) {
  for (const double middle : {1e-14, 3e-7, 0.5, 1.0, 2e8}) {
    DecadeHistogram histogram;
    for (const double value : {0.0, 1e-3 * middle, middle, 1e3 * middle, 1e4 * middle}) histogram.add(value);
    EXPECT_GE(histogram.median(), 0.999 * middle);
    EXPECT_LE(histogram.median(), 1.06 * middle);
  }
  DecadeHistogram histogram;
  EXPECT_EQ(histogram.median(), 0.0);
  histogram.add(0.0);
  EXPECT_EQ(histogram.median(), 0.0);
}

TEST(BestEffort, IsGraveByItsTicksOrItsError) {
  BestEffort found;
  EXPECT_FALSE(is_grave(found, 1000));
  EXPECT_EQ(in_words(found, 1000), "");
  found.add(StepStatus::not_converged, 1.0, 0.01, 0, 0.5);
  EXPECT_FALSE(is_grave(found, 1000));
  EXPECT_TRUE(is_grave(found, 999));
  found = {};
  found.add(StepStatus::ok, 1.0, 0.021, 1, 0.5);
  EXPECT_TRUE(is_grave(found, 1'000'000));
}

TEST(BestEffort, InWordsHasTheReasons) {
  BestEffort found;
  found.add(StepStatus::not_converged, 1.0, 0.01, 0, 0.5);
  const std::string cut = in_words(found, 1000);
  EXPECT_NE(cut.find("in 1 ticks (0.1 %)"), std::string::npos) << cut;
  EXPECT_NE(cut.find("by about 1 % of it in the median and up to 1 % (0.01 N at 0.500 s): the solver was "
                     "cut short in 1 of them"),
            std::string::npos)
      << cut;
  EXPECT_EQ(cut.find("--max-contacts"), std::string::npos) << cut;
  found.add(StepStatus::ok, 1.0, 0.2, 4, 0.75);
  const std::string both = in_words(found, 1000);
  EXPECT_NE(both.find("cut short in 1 of them, up to 4 contact points found no room in 1"), std::string::npos)
      << both;
  EXPECT_NE(both.find("--max-contacts"), std::string::npos) << both;
  found.add(StepStatus::unbalanced, 1.0, 0.1, 0, 0.8);
  const std::string deep = in_words(found, 1000);
  EXPECT_NE(deep.find("cut short in 1 of them, the balance at depth was not met in 1 of them, up to"),
            std::string::npos)
      << deep;
}

}  // namespace
}  // namespace palpate::best_effort_test

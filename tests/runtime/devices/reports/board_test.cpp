// Home-made boards: the descriptor says what the reports are, and both directions come back.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "runtime/devices/reports/palpate_board.h"
#include "tests/support/devices/board_codec.h"

namespace palpate::board_test {
namespace {

TEST(Board, DescriptorSaysTheReports) {
  for (int axes = 3; axes <= 6; ++axes) {
    const auto descriptor = parse_report_descriptor(board_report_descriptor(axes), "a board");
    EXPECT_TRUE(descriptor.numbered);
    EXPECT_EQ(descriptor.usage, board_usage);
    EXPECT_EQ(1U + descriptor.report_bytes(HidReportType::input, 1), board_input_bytes(axes));
    EXPECT_EQ(1U + descriptor.report_bytes(HidReportType::output, 2), board_force_bytes);
    EXPECT_EQ(1U + descriptor.report_bytes(HidReportType::feature, 3), board_feature_bytes);
    // Every number where the codec has it.
    BoardInput input{0x01020304, axes, {-1, 2, -3, 4, -5, 6}, 0x8001};
    const auto report = encode_board_input(input);
    const auto behind_id = std::span(report).subspan(1);
    for (int k = 0; k < axes; ++k) {
      const auto axis =
          descriptor.element(HidReportType::input, {}, {0xFF48, static_cast<std::uint16_t>(0x10 + k)});
      ASSERT_TRUE(axis);
      EXPECT_EQ(read_element(*axis, behind_id), input.values[static_cast<std::size_t>(k)]);
    }
    EXPECT_FALSE(
        descriptor.element(HidReportType::input, {}, {0xFF48, static_cast<std::uint16_t>(0x10 + axes)}));
    const auto last_button = descriptor.element(HidReportType::input, {}, {0xFF48, 0x2F});
    ASSERT_TRUE(last_button);
    EXPECT_EQ(read_element(*last_button, behind_id), 1);
    const auto force = encode_board_force({1, {-32767, 5, 6}});
    const auto x = descriptor.element(HidReportType::output, {}, {0xFF48, 0x30});
    ASSERT_TRUE(x);
    EXPECT_EQ(read_element(*x, std::span(force).subspan(1)), -32767);
    const auto feature = encode_board_feature({3, 20, 250, 5000, 1000, 8000, 100000});
    const auto radius = descriptor.element(HidReportType::feature, {}, {0xFF48, 0x47});
    ASSERT_TRUE(radius);
    EXPECT_EQ(read_element(*radius, std::span(feature).subspan(1)), 100000);
  }
}

TEST(Board, InputByHand) {
  // Report 1, sequence 258, x = 1000 um, y = -2 um, z = 0, button 1.
  const auto input = decode_board_input(bytes("01 02 01 00 00 e8 03 00 00 fe ff ff ff 00 00 00 00 02 00"));
  ASSERT_TRUE(input);
  const DeviceState state = board_state(*input);
  EXPECT_EQ(state.sequence, 258U);
  EXPECT_EQ(state.buttons, 2U);
  EXPECT_FALSE(state.pose.grab);
  EXPECT_LT((state.pose.position - Vec3(1e-3, -2e-6, 0)).norm(), 1e-15);
  EXPECT_EQ(state.pose.orientation.coeffs(), Eigen::Quaterniond::Identity().coeffs());
}

TEST(Board, RotationIsAxisTimesAngle) {
  const DeviceState state = board_state({0, 6, {0, 0, 0, 0, 0, 1570796}, 1});
  EXPECT_LT((state.pose.orientation * Vec3::UnitX() - Vec3::UnitY()).norm(), 1e-6);
  EXPECT_TRUE(state.pose.grab);
}

TEST(Board, ForceByHand) {
  const BoardFeature feature{3, 20, 250, 5000, 1000, 8000, 100000};
  const auto counts = board_counts(feature, Vec3(1.0, -0.5, 0.00025));
  EXPECT_EQ(as_bytes(encode_board_force({7, counts})), bytes("02 07 00 00 00 a0 0f 30 f8 01 00"));
  const auto much = board_counts(feature, Vec3(16.0, -8.0, 0));  // 32767 counts are 8.19175 N
  EXPECT_EQ(much, (std::array<std::int16_t, 3>{32767, -16384, 0}));
  const auto nothing = board_counts(feature, Vec3(std::numeric_limits<double>::quiet_NaN(), 1, 1));
  EXPECT_EQ(nothing, (std::array<std::int16_t, 3>{0, 0, 0}));
}

TEST(Board, FeatureByHand) {
  const Bytes report = bytes("03 01 06 14 00 fa 00 00 00 88 13 00 00 e8 03 00 00 40 1f 00 00 00 00 00 00");
  const auto feature = decode_board_feature(report);
  ASSERT_TRUE(feature);
  EXPECT_EQ(feature->axes, 6);
  EXPECT_EQ(feature->watchdog, 20);
  EXPECT_EQ(feature->force_unit, 250U);
  const DeviceLimits limits = feature->limits();
  EXPECT_DOUBLE_EQ(limits.max_force, 5.0);
  EXPECT_DOUBLE_EQ(limits.max_stiffness, 1000.0);
  EXPECT_DOUBLE_EQ(limits.max_damping, 8.0);
  EXPECT_TRUE(std::isinf(limits.workspace_radius));
  EXPECT_EQ(encode_board_feature(*feature), report);
}

TEST(Board, RefusesShortLongAndGarbage) {
  const Bytes good = bytes("03 01 06 14 00 fa 00 00 00 88 13 00 00 e8 03 00 00 40 1f 00 00 00 00 00 00");
  for (const auto& [at, value] : std::vector<std::pair<std::size_t, std::uint8_t>>{
           {0, 1}, {1, 2}, {2, 2}, {2, 7}, {3, 0}, {4, 0x10}, {5, 0}}) {
    Bytes bad = good;
    bad[at] = value;
    EXPECT_FALSE(decode_board_feature(bad)) << at;
  }
  EXPECT_FALSE(decode_board_feature(Bytes(good.begin(), good.end() - 1)));
  EXPECT_FALSE(decode_board_input({}));
  EXPECT_FALSE(decode_board_input(bytes("01 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0")));       // one byte short
  EXPECT_FALSE(decode_board_input(bytes("02 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0")));     // another id
  EXPECT_FALSE(decode_board_input(bytes("01 0 0 0 0 81 96 98 0 0 0 0 0 0 0 0 0 0 0")));  // 10.000001 m
  EXPECT_TRUE(decode_board_input(bytes("01 0 0 0 0 80 96 98 0 0 0 0 0 0 0 0 0 0 0")));   // 10 m
  EXPECT_FALSE(decode_board_force(Bytes(10, 2)));
  std::mt19937 random(3);
  for (int i = 0; i < 50000; ++i) {
    Bytes any = random_bytes(random, random() % 40);
    if (!any.empty()) any[0] = static_cast<std::uint8_t>(random() % 4);
    if (const auto input = decode_board_input(any)) {
      EXPECT_LE(board_state(*input).pose.position.norm(), 18.0);
    }
    static_cast<void>(decode_board_force(any));
    static_cast<void>(decode_board_feature(any));
  }
}

TEST(Board, WhatIsEncodedIsDecoded) {
  std::mt19937 random(4);
  std::uniform_int_distribution<std::int32_t> place(-10'000'000, 10'000'000);
  std::uniform_int_distribution<std::int32_t> angle(-6'283'185, 6'283'185);
  for (int i = 0; i < 1000; ++i) {
    BoardInput input{
        static_cast<std::uint32_t>(random()), 3 + i % 4, {}, static_cast<std::uint16_t>(random())};
    for (std::size_t k = 0; k < static_cast<std::size_t>(input.axes); ++k) {
      input.values[k] = k < 3 ? place(random) : angle(random);
    }
    const auto report = encode_board_input(input);
    const auto back = decode_board_input(report);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->sequence, input.sequence);
    EXPECT_EQ(back->axes, input.axes);
    EXPECT_EQ(back->values, input.values);
    EXPECT_EQ(back->buttons, input.buttons);
    const BoardForce force{static_cast<std::uint32_t>(random()),
                           {static_cast<std::int16_t>(random()), static_cast<std::int16_t>(random()),
                            static_cast<std::int16_t>(random())}};
    const auto force_back = decode_board_force(encode_board_force(force));
    ASSERT_TRUE(force_back);
    EXPECT_EQ(force_back->counts, force.counts);
    EXPECT_EQ(force_back->sequence, force.sequence);
  }
}

}  // namespace
}  // namespace palpate::board_test

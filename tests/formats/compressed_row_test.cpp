#include "formats/compressed_row.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <random>

#include "formats/hdf5.h"
#include "tests/support/formats_sample.h"

namespace palpate::test::compressed_row_test {
namespace {

/// Numbers of any bits, those that are no numbers among them.
std::vector<float> any_floats(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<float> values(count);
  for (float& value : values) {
    const auto bits = static_cast<std::uint32_t>(random());
    std::memcpy(&value, &bits, sizeof value);
  }
  return values;
}

bool same_bits(std::span<const float> a, std::span<const float> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

class Rows : public testing::TestWithParam<std::size_t> {};

TEST_P(Rows, AreExpandedBitByBit) {
  for (const std::vector<float>& row : {any_floats(GetParam(), 7), std::vector<float>(GetParam(), -0.0F)}) {
    const std::vector<std::byte> compressed = compress_row(std::as_bytes(std::span(row)), sizeof(float));
    std::vector<float> expanded(row.size());
    ASSERT_TRUE(expand_row(compressed, sizeof(float), std::as_writable_bytes(std::span(expanded))));
    EXPECT_TRUE(same_bits(expanded, row));
    EXPECT_LE(compressed.size(), 4 * row.size() + row.size() / 100 + 64) << "noise hardly grows";
  }
}
INSTANTIATE_TEST_SUITE_P(CompressedRow, Rows, testing::Values(1, 2, 3, 1000, 8191, 8192, 100'003));

TEST(CompressedRow, IsWhatTheLibrarysFiltersExpand) {
  const Folder folder;
  const std::size_t rows = 5, width = 3000;
  std::vector<float> values = any_floats(rows * width, 11);
  hdf5::File file = hdf5::File::create(folder / "a.h5");
  {
    auto written = file.write_compressed("/values", hdf5::element_type<float>(),
                                         std::array<std::int64_t, 3>{rows, width / 3, 3});
    for (std::size_t k = 0; k < rows; ++k)
      written.append(compress_row(std::as_bytes(std::span(values).subspan(k * width, width)), 4));
    EXPECT_EQ(written.starts().size(), rows + 1);
  }
  const hdf5::Id opened(H5Dopen2(file.id(), "/values", H5P_DEFAULT), H5Dclose);
  std::vector<float> read(values.size());
  ASSERT_GE(H5Dread(opened.get(), H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, read.data()), 0);
  EXPECT_TRUE(same_bits(read, values));
}

TEST(CompressedRow, IsRefusedUnlessItIsOneWholeRow) {
  const std::vector<float> row(500, 0.25F);
  std::vector<std::byte> compressed = compress_row(std::as_bytes(std::span(row)), sizeof(float));
  std::vector<float> expanded(501);
  const auto expands = [&](std::span<const std::byte> bytes, std::size_t count) {
    return expand_row(bytes, sizeof(float), std::as_writable_bytes(std::span(expanded).first(count)));
  };
  EXPECT_TRUE(expands(compressed, 500));
  EXPECT_FALSE(expands(compressed, 499));
  EXPECT_FALSE(expands(compressed, 501));
  EXPECT_FALSE(expands({}, 500));
  for (std::size_t length = 0; length < compressed.size(); ++length)
    EXPECT_FALSE(expands(std::span(compressed).first(length), 500)) << length;
  std::vector<std::byte> longer = compressed;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(expands(longer, 500));
  const std::vector<float> noise = any_floats(100, 3);
  EXPECT_FALSE(expands(std::as_bytes(std::span(noise)), 500));
}

}  // namespace
}  // namespace palpate::test::compressed_row_test

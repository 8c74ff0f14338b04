// Which kernels of OpenBLAS are right for a processor.
#include "precompute/machine/blas_kernels.h"

#include <gtest/gtest.h>

namespace palpate::blas_kernels_test {
namespace {

constexpr Instructions none{}, haswell{.avx2 = true}, skylake{.avx2 = true, .avx512 = true};

TEST(BlasKernels, OldOnesOfANewProcessorAreReplaced) {
  for (const char* core : {"Prescott", "Core2", "Nehalem", "Barcelona", "Sandybridge", "Unknown"}) {
    EXPECT_EQ(faster_kernels(core, haswell), "Haswell") << core;
    EXPECT_EQ(faster_kernels(core, skylake), "SkylakeX") << core;
    EXPECT_EQ(faster_kernels(core, none), "") << core;  // it is as old
  }
}

TEST(BlasKernels, OthersStay) {
  for (const char* core :
       {"Haswell", "SkylakeX", "Cooperlake", "SapphireRapids", "Zen", "Excavator", "armv8", ""})
    for (const Instructions& instructions : {none, haswell, skylake})
      EXPECT_EQ(faster_kernels(core, instructions), "") << core;
}

TEST(BlasKernels, OfThisProcessorHaveAName) {
  EXPECT_FALSE(kernels_in_use().name.empty());
}

}  // namespace
}  // namespace palpate::blas_kernels_test

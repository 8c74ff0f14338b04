#include "precompute/machine/blas_kernels.h"

#include <cblas.h>

#include <algorithm>
#include <array>
#include <cstdlib>

namespace palpate {
namespace {

// Cores without AVX2 and FMA, as named by openblas_get_corename.
constexpr std::array<std::string_view, 18> old_cores = {
    "Unknown", "Katmai",       "Coppermine", "Northwood",  "Prescott", "Banias",
    "Atom",    "Core2",        "Penryn",     "Dunnington", "Nehalem",  "Athlon",
    "Opteron", "Opteron_SSE3", "Barcelona",  "Nano",       "Bobcat",   "Sandybridge"};

std::string value_of(const char* variable) {
  const char* const value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

}  // namespace

Instructions instructions_here() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  const bool avx2 = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0;
  const bool avx512 = __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512cd") != 0 &&
                      __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
                      __builtin_cpu_supports("avx512vl") != 0;
  return {avx2, avx2 && avx512};
#else
  return {};
#endif
}

std::string faster_kernels(std::string_view core, const Instructions& instructions) {
  if (!instructions.avx2 || std::find(old_cores.begin(), old_cores.end(), core) == old_cores.end()) return {};
  return instructions.avx512 ? "SkylakeX" : "Haswell";
}

std::string kernels_to_ask_for() {
  const bool decided = !value_of(asked_kernels).empty() || !value_of(kernels_before).empty();
  return decided ? "" : faster_kernels(openblas_get_corename(), instructions_here());
}

KernelsInUse kernels_in_use() {
  const std::string before = value_of(kernels_before), asked = value_of(asked_kernels);
  KernelsInUse used{openblas_get_corename(), {}};
  const std::string better = faster_kernels(used.name, instructions_here());
  if (!before.empty()) {
    used.note = "OpenBLAS takes this processor for " + before +
                ", far older: the program was started anew with OPENBLAS_CORETYPE=" + asked;
  } else if (!better.empty()) {
    used.note = "products by OpenBLAS take twice as long or more with its kernels for " + used.name +
                (asked.empty() ? "" : ", which OPENBLAS_CORETYPE asks for") + "; this processor has " +
                better + "'s instructions";
  }
  return used;
}

}  // namespace palpate

#include "precompute/machine/blas_kernels.h"

#include <cblas.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <system_error>

namespace palpate {
namespace {

constexpr const char* asked_kernels = "OPENBLAS_CORETYPE";
constexpr const char* kernels_before = "PALPATE_KERNELS_BEFORE";  // a program that was started anew

// Without AVX2 and FMA, as openblas_get_corename has them.
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

void use_fitting_kernels(char** argv) {
  const std::string core = openblas_get_corename();
  const std::string better = faster_kernels(core, instructions_here());
  if (better.empty() || !value_of(asked_kernels).empty() || !value_of(kernels_before).empty()) return;
  std::error_code unknown;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (unknown || ::setenv(asked_kernels, better.c_str(), 1) != 0 ||
      ::setenv(kernels_before, core.c_str(), 1) != 0)
    return;
  ::execv(program.c_str(), argv);
  ::unsetenv(asked_kernels);  // goes on, if slowly
  ::unsetenv(kernels_before);
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

// Kernels of OpenBLAS that fit the processor.
#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// Instruction sets of a processor for which OpenBLAS has kernels.
struct Instructions {
  bool avx2 = false;    ///< AVX2 and FMA
  bool avx512 = false;  ///< F, CD, BW, DQ and VL, as in Skylake-X
};

/// Instruction sets of this processor.
Instructions instructions_here();

/// Kernels, by their name for OPENBLAS_CORETYPE, that take at most half the time of those of `core`,
/// OpenBLAS's name for the processor; empty if there are none. OpenBLAS mistakes processors newer than itself
/// for very old ones (its issue 4267).
std::string faster_kernels(std::string_view core, const Instructions& instructions);

constexpr const char* asked_kernels = "OPENBLAS_CORETYPE";
constexpr const char* kernels_before = "PALPATE_KERNELS_BEFORE";  ///< in a program that was restarted

/// Kernels to request if OpenBLAS has chosen those of an old processor. Empty if its choice fits, the user
/// has chosen, or the program was already restarted for them.
std::string kernels_to_ask_for();

/// Kernels in use, and a note for the user: that the program was restarted for them, or that
/// OPENBLAS_CORETYPE requests slow ones. Empty if there is nothing to report.
struct KernelsInUse {
  std::string name;
  std::string note;
};
KernelsInUse kernels_in_use();

}  // namespace palpate

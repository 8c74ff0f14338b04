// Kernels of OpenBLAS that fit the processor.
#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// Instructions of a processor that OpenBLAS has kernels for.
struct Instructions {
  bool avx2 = false;    ///< and FMA
  bool avx512 = false;  ///< F, CD, BW, DQ and VL: those of Skylake-X
};

/// Those of the processor that this runs on.
Instructions instructions_here();

/// Kernels, as OPENBLAS_CORETYPE names them, that take half the time of those of `core`, the name that
/// OpenBLAS has for the processor, or less; empty where there are none. OpenBLAS takes processors that came
/// after it for very old ones (its issue 4267).
std::string faster_kernels(std::string_view core, const Instructions& instructions);

constexpr const char* asked_kernels = "OPENBLAS_CORETYPE";
constexpr const char* kernels_before = "PALPATE_KERNELS_BEFORE";  ///< of a program that was started anew

/// Kernels to ask for where OpenBLAS has chosen those of another age. Empty: its choice fits, or somebody has
/// chosen, or the program was started anew for them already.
std::string kernels_to_ask_for();

/// The kernels in use, and what a person is to know of them: that the program was started anew for them, or
/// that OPENBLAS_CORETYPE asks for slow ones. Empty: nothing.
struct KernelsInUse {
  std::string name;
  std::string note;
};
KernelsInUse kernels_in_use();

}  // namespace palpate

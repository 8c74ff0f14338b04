// A labelled image as its voxels and as an INR file, against which readers of other formats are held.
#pragma once

#include <array>
#include <string>

#include "meshes/mesh.h"

namespace palpate::test {

inline constexpr std::array<int, 3> size = {9, 8, 7};
inline const Vec3 spacing(1.0, 1.5, 2.0), origin(10.0, -20.0, 30.0);

/// A body without symmetry: a block with an arm along each axis, of different labels and lengths.
inline int label_at(int i, int j, int k) {
  const auto within = [](int x, int low, int high) { return x >= low && x <= high; };
  if (within(i, 1, 3) && within(j, 1, 3) && within(k, 1, 3)) return 1;
  if (within(i, 4, 7) && within(j, 1, 2) && within(k, 1, 2)) return 2;
  if (within(i, 1, 2) && within(j, 4, 6) && within(k, 2, 3)) return 3;
  if (within(i, 2, 3) && within(j, 2, 3) && within(k, 4, 5)) return 4;
  return 0;
}

inline std::string inr() {
  std::string text =
      "#INRIMAGE-4#{\nXDIM=9\nYDIM=8\nZDIM=7\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 "
      "bits\nSCALE=2**0\nCPU=decm\n"
      "VX=1\nVY=1.5\nVZ=2\nTX=10\nTY=-20\nTZ=30\n";
  text.resize(252, '\n');
  text += "##}\n";
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) text += static_cast<char>(label_at(i, j, k));
  return text;
}

}  // namespace palpate::test

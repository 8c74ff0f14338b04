// A small model with made-up Green's functions, for tests of the file.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "formats/model.h"
#include "formats/model_file.h"

namespace palpate::test {

/// Box, in the plane rectangle, of `cells` cells along each axis, its lowest nodes held along some axis, all
/// other nodes stored (54 dofs for 2 cells of tet4), two materials, loads, two sources, two probes, two
/// overlays of 2 and 3 nodes, 3 and 1 on the surface.
Model sample_model(ElementType element = ElementType::tet4, int cells = 2);

/// Entry (i, j) of its Green's functions: symmetric, positive on the diagonal, no two neighbours equal.
double sample_entry(std::int64_t i, std::int64_t j);

/// Columns [first, first + count) of the lower triangle, as write_columns takes them.
std::vector<double> sample_columns(std::int64_t first, std::int64_t count, std::int64_t order);

/// A smooth part of `dofs` rows and three terms, made up; those of dofs that the sample holds are zero.
SmoothPart sample_smooth(const Model& model);

/// The sample with a smooth part and force errors, and with dynamics where `method` says so.
Model split_sample(DynamicsMethod method);

/// Writes the whole of `split_sample`.
Model write_split_sample(const std::filesystem::path& path, DynamicsMethod method = DynamicsMethod::none);

/// `sample_model` with Green's functions in nested low-rank form: two leaves that are far from each other.
Model compressed_sample();

/// Writes `compressed_sample` and returns what was written.
Model write_compressed_sample(const std::filesystem::path& path);

/// Writes the whole of `sample_model` and returns what was written.
Model write_sample(const std::filesystem::path& path, Precision precision = Precision::double_precision,
                   ElementType element = ElementType::tet4, int cells = 2);

/// The sample with its lowest nodes held whole and with made-up dynamics: M and C_d of two diagonals, or
/// `modes` modes.
Model swinging_sample(DynamicsMethod method, ElementType element = ElementType::tet4, Index modes = 5);

/// Columns of its inverse of K_bar.
std::vector<double> sample_inverse_columns(std::int64_t first, std::int64_t count, std::int64_t order);

/// Writes the whole of it and returns what was written.
Model write_swinging_sample(const std::filesystem::path& path, DynamicsMethod method,
                            Precision precision = Precision::double_precision,
                            ElementType element = ElementType::tet4);

/// An empty folder that goes when the test ends.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::string read_bytes(const std::filesystem::path& path);
void write_bytes(const std::filesystem::path& path, const std::string& bytes);

/// "WHERE | WHAT | HINT" of the Error that `run` throws; empty when it throws none.
std::string refusal(const std::function<void()>& run);

/// Which part of two models differs, empty when they are equal (entries of the Green's functions bit by bit).
std::string difference(const Model& a, const Model& b);

}  // namespace palpate::test

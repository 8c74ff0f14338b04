// Green's functions in nested low-rank form in the table of file fields.
#pragma once

#include <array>

#include "formats/field_counts.h"
#include "formats/model_fields.h"
#include "matrices/hierarchical.h"

namespace palpate {

/// Dataset whose presence means that the Green's functions are compressed.
inline constexpr const char* tree_path = "/greens/levels";
inline constexpr const char* near_path = "/greens/near";

std::vector<std::int32_t> flat_pairs(const std::vector<HierarchicalMatrix::Pair>& pairs);
void put_levels(Model& model, const std::vector<std::int32_t>& values);
void put_tolerance(Model& model, const std::vector<double>& values);
void put_near_pairs(Model& model, const std::vector<std::int32_t>& values);
void put_far_pairs(Model& model, const std::vector<std::int32_t>& values);
void put_ranks(Model& model, const std::vector<std::int32_t>& values);
void put_pair_errors(Model& model, const std::vector<double>& values);
void put_certificate(Model& model, const std::vector<double>& values);

/// Fields known before the matrix entries.
template <class Visitor>
void for_each_tree_field(Visitor&& visit) {
  using Int32s = std::vector<std::int32_t>;
  const Extent two = {Count::one, 2, 0};
  visit(Field<std::int32_t>{tree_path,
                            {{Count::one}},
                            [](const Model& m) { return Int32s{m.compressed->tree.levels}; },
                            put_levels});
  visit(Field<double>{"/greens/tolerance",
                      {{Count::one}},
                      [](const Model& m) { return std::vector<double>{m.compressed->tolerance}; },
                      put_tolerance});
  visit(Field<std::int32_t>{"/greens/near_pairs",
                            {{Count::near_pairs}, two},
                            [](const Model& m) { return flat_pairs(m.compressed->near_pair); },
                            put_near_pairs});
  visit(Field<std::int32_t>{"/greens/far_pairs",
                            {{Count::far_pairs}, two},
                            [](const Model& m) { return flat_pairs(m.compressed->far_pair); },
                            put_far_pairs});
}

/// Fields known once the matrix is computed, besides its arrays.
template <class Visitor>
void for_each_rank_field(Visitor&& visit) {
  visit(Field<std::int32_t>{"/greens/ranks",
                            {{Count::clusters}},
                            [](const Model& m) {
                              return std::vector<std::int32_t>(m.compressed->rank.begin(),
                                                               m.compressed->rank.end());
                            },
                            put_ranks,
                            {Count::one, most_rank + 1, 0}});
  visit(Field<double>{"/greens/pair_errors",
                      {{Count::far_pairs}},
                      [](const Model& m) { return m.compressed->pair_error; },
                      put_pair_errors});
  visit(Field<double>{"/greens/certificate",
                      {{Count::certified}, {Count::one, 6, 0}},
                      [](const Model& m) { return m.compressed->certificate; },
                      put_certificate});
}

/// A float array of the matrix, which is mapped and not copied.
struct CompressedArray {
  const char* path;
  std::shared_ptr<const float[]> HierarchicalMatrix::*data;
  std::vector<std::int64_t> HierarchicalMatrix::*at;  ///< offsets; the last is the array's size
};
inline constexpr std::array<CompressedArray, 4> compressed_arrays = {{
    {near_path, &HierarchicalMatrix::near, &HierarchicalMatrix::near_at},
    {"/greens/bases", &HierarchicalMatrix::basis, &HierarchicalMatrix::basis_at},
    {"/greens/transfers", &HierarchicalMatrix::transfer, &HierarchicalMatrix::transfer_at},
    {"/greens/couplings", &HierarchicalMatrix::coupling, &HierarchicalMatrix::coupling_at},
}};

/// Compressed matrix of a model that is being read.
HierarchicalMatrix& compressed_to_fill(Model& model);

void count_tree(const HierarchicalMatrix& matrix, Counts& counts);

/// Checks that levels and pairs belong to the stored nodes: each pair of leaves is near, or is in one far
/// pair of clusters above them. Throws Error (where = `where`) naming the field.
void check_tree(const Model& model, const std::string& where);

/// Checks that there is a rank for each cluster. Throws Error.
void check_ranks(const Model& model, const std::string& where);

}  // namespace palpate

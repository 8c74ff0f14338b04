#include "precompute/compressed_greens.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.h"
#include "precompute/compression/out_of_reach.h"
#include "precompute/progress.h"
#include "precompute/spread_plan.h"

namespace palpate {
namespace {

constexpr std::int64_t many_nodes = 5000;  // at least this many are compressed by default
constexpr double cut_of_tolerance = 0.2;   // at which force errors are likely half the tolerance
constexpr double accepted = 0.65;    // of the tolerance: touches beyond the measured ones have larger errors
constexpr double finer = 0.6;        // factor of the next cut if errors are larger
constexpr double bound_share = 0.5;  // largest allowed ratio of a measured error to the bound of a tick
constexpr int most_cuts = 5;
constexpr std::uint64_t certificate_seed = 41;
constexpr std::int64_t touches = 64;              // per number of nodes
constexpr std::int64_t touch_matrices = 2;        // per thread for a touch: its compliance, and the factor
constexpr double touch_steps = 4.0;               // of conjugate gradients (measured)
constexpr double typical_rank = 45.0;             // for the default tolerance (measured)
constexpr std::int64_t recompression_copies = 6;  // of the far part: skeletons are larger (measured)
constexpr std::int64_t forward_copies = 3;        // for couplings, twice for near pairs: no more than those
constexpr double near_efficiency = 1.45;          // of near pairs beside columns (measured)
constexpr double far_share = 1.2;                 // of the time of near pairs (measured)
constexpr double touch_share = 4.5;               // relative to the time of equally many columns of near
                                                  // pairs (measured)

constexpr const char* near_stage = "near pairs";
constexpr const char* sample_stage = "random loads";
constexpr const char* far_stage = "far pairs";
constexpr const char* touch_stage = "touches";

constexpr const char* name_of(CompressionStage stage) {
  return stage == CompressionStage::near      ? near_stage
         : stage == CompressionStage::samples ? sample_stage
                                              : far_stage;
}

/// Numbering of the nodes in another order.
StoredNumbering reordered(const StoredNumbering& stored, const std::vector<Index>& order) {
  const std::size_t d = stored.dofs.size() / stored.nodes.size();
  StoredNumbering result;
  for (const Index k : order) {
    const auto node = static_cast<std::size_t>(k);
    result.nodes.push_back(stored.nodes[node]);
    for (std::size_t axis = 0; axis < d; ++axis) result.dofs.push_back(stored.dofs[d * node + axis]);
  }
  return result;
}

/// True if use(leaf) is for all leaves of a tile.
template <class Use>
bool each_of(const Tile& tile, const Use& use) {
  const auto first = static_cast<Index>(tile.first), end = static_cast<Index>(tile.first + tile.count);
  for (Index leaf = first; leaf < end; ++leaf)
    if (!use(leaf)) return false;
  return true;
}

std::vector<double> table_of(const std::vector<TouchErrors>& errors) {
  std::vector<double> table;
  for (const TouchErrors& e : errors) {
    for (const double value : {static_cast<double>(e.nodes), static_cast<double>(e.errors.size()),
                               e.quantile(0.5), e.quantile(0.99), e.quantile(1.0), e.largest_bound_share()})
      table.push_back(value);
  }
  return table;
}

/// Enlarges the bound of a tick until measured errors are at most bound_share of it.
void loosen_bound(HierarchicalMatrix& matrix, std::vector<TouchErrors>& errors) {
  double largest = 0.0;
  for (const TouchErrors& e : errors) largest = std::max(largest, e.largest_bound_share());
  if (largest <= bound_share) return;
  for (double& error : matrix.pair_error) error *= largest / bound_share;
  for (TouchErrors& e : errors) {
    for (double& share : e.bound_shares) share *= bound_share / largest;
  }
}

double worst_of(const std::vector<TouchErrors>& errors) {
  double worst = 0.0;
  for (const TouchErrors& e : errors) worst = std::max(worst, e.quantile(1.0));
  return worst;
}

/// Compression of the Green's functions of a plan.
class GreensCompressor {
 public:
  GreensCompressor(const BakeRun& run, const CompressionPlan& plan, const Factor& factor, ModelWriter& writer)
      : run_(run),
        plan_(plan),
        factor_(factor),
        writer_(writer),
        sharing_(run.team, run.jobs, run.interrupted),
        compression_(factor, plan.stored.dofs, plan.frame.dimension, plan.clusters, sharing_,
                     forward_copies * plan.far_bytes,
                     [this](CompressionStage stage, double share) { return reach(name_of(stage), share); }) {}

  /// Solves for the near pairs of the leaves of `part` that the file does not have. False when interrupted.
  bool solve_near(const PieceRange& part) {
    std::vector<std::vector<float>> scratch(static_cast<std::size_t>(run_.jobs));
    stage_ = near_stage;
    return solve_pieces(
        run_, near_tiles(plan_.frame), part,
        {near_stage, "those of ", "leaves", plan_.near_seconds,
         [&](const Tile& tile) { return each_of(tile, [&](Index leaf) { return writer_.has_near(leaf); }); },
         [&](const Tile& tile, int worker) {
           std::vector<float>& entries = scratch[static_cast<std::size_t>(worker)];
           each_of(tile, [&](Index leaf) {
             if (writer_.has_near(leaf)) return true;
             compression_.solve_near(leaf, worker, entries);
             writer_.write_near(leaf, entries);
             return true;
           });
         }});
  }

  /// The matrix, with the near pairs of the file, which has all. Null when interrupted.
  std::shared_ptr<const HierarchicalMatrix> compress();

 private:
  bool reach(const char* stage, double share) {
    if (stage != stage_) run_.progress.begin(stage_ = stage);
    run_.progress.reach(share);
    return !run_.interrupted();
  }

  const BakeRun& run_;
  const CompressionPlan& plan_;
  const Factor& factor_;
  ModelWriter& writer_;
  TeamSharing sharing_;
  const char* stage_ = nullptr;  // current stage
  Compression compression_;
};

std::shared_ptr<const HierarchicalMatrix> GreensCompressor::compress() {
  if (!compression_.prepare([&](Index leaf, std::span<float> entries) { writer_.read_near(leaf, entries); }))
    return nullptr;
  double cut = cut_of_tolerance * plan_.frame.tolerance;
  for (int attempt = 1;; ++attempt, cut *= finer) {
    const std::shared_ptr<HierarchicalMatrix> matrix = compression_.compress(cut);
    if (matrix == nullptr) return nullptr;
    std::vector<TouchErrors> errors =
        certify(*matrix, factor_, plan_.stored.dofs, plan_.places.points, plan_.places.touchable, touches,
                certificate_seed, sharing_, [&](double share) { return reach(touch_stage, share); });
    if (run_.team.any(run_.interrupted())) return nullptr;
    const double worst = worst_of(errors);
    if (worst <= accepted * plan_.frame.tolerance) {
      loosen_bound(*matrix, errors);
      matrix->tolerance = plan_.frame.tolerance;
      matrix->certificate = table_of(errors);
      run_.progress.line(fmt::format("compressed to {:.1f} MB; force errors of random touches:\n{}",
                                     1e-6 * static_cast<double>(matrix->bytes()), certificate_text(*matrix)));
      return matrix;
    }
    if (attempt == most_cuts) {
      throw OutOfReach(fmt::format("compressed, forces of random touches are off by up to {:.2g} of the "
                                   "largest, the tolerance is {:.2g}",
                                   worst, plan_.frame.tolerance),
                       "[storage] tolerance", "Set a larger tolerance, or compression = \"none\"");
    }
    run_.progress.line(
        fmt::format("force errors up to {:.1e} at a cut of {:.1e}: again with more terms", worst, cut));
  }
}

/// In the leader, which the others help to solve.
std::optional<Solved> solve_compressed_alone(const BakeRun& run, const CompressionPlan& plan,
                                             const Factor& factor, SpreadNumbers& spread,
                                             ModelWriter& writer) {
  Solved solved;
  std::string refused;  // reason if it is out of reach
  const bool whole = work_while_others_serve(spread, run, [&](const BakeRun& leader) {
    try {
      GreensCompressor compressor(leader, plan, factor, writer);
      if (compressor.solve_near({0, plan.frame.tree.leaves()})) solved.compressed = compressor.compress();
      if (solved.compressed == nullptr) return false;
      solved.probes = make_probes(factor, plan.stored.dofs);
    } catch (const OutOfReach& error) {
      refused = to_text(error);
    }
    return true;
  });
  refused = run.team.share(refused);
  if (!refused.empty()) throw OutOfReach(refused, "", "");
  return whole ? std::optional(std::move(solved)) : std::nullopt;
}

}  // namespace

bool wants_compression(const Description& description, std::int64_t stored_nodes) {
  const bool packed_dynamics = description.dynamics && description.dynamics->method == DynamicsMethod::packed;
  if (description.form == StorageForm::compressed && packed_dynamics)
    throw Error("[storage] compression = \"h2\" does not go with [dynamics] method = \"packed\"",
                description.file.string(), "set method = \"modal\", or compression = \"none\"");
  if (description.form != StorageForm::automatic) return description.form == StorageForm::compressed;
  return stored_nodes >= many_nodes && !description.precision && !packed_dynamics;
}

CompressionPlan plan_compression(const Description& description, const Model& model,
                                 const StoredNumbering& stored, const Factor& factor, const Plan& dense,
                                 int jobs) {
  CompressionPlan plan;
  std::vector<Vec3> points;
  for (const Index node : stored.nodes) points.push_back(model.mesh.nodes[static_cast<std::size_t>(node)]);
  plan.clusters = cluster_nodes(points);
  plan.stored = reordered(stored, plan.clusters.order);
  plan.places = touchable_points(model, plan.stored.nodes);
  plan.frame = compression_frame(plan.clusters, model.dimension());
  plan.frame.tolerance = description.tolerance;

  const auto order = static_cast<double>(plan.frame.order());
  plan.far_bytes = static_cast<std::int64_t>(
      4.0 * typical_rank *
      (order + typical_rank * static_cast<double>(plan.frame.far_pair.size() +
                                                  std::size_t(plan.frame.tree.clusters()))));
  const std::int64_t touched = std::int64_t{model.dimension()} * certified_nodes.back();
  plan.memory_bytes = solver_bytes(factor) +
                      jobs * (compression_workspace(factor, plan.stored.dofs, plan.frame) +
                              touch_matrices * touched * touched * std::int64_t{sizeof(double)}) +
                      thread_bytes(jobs) + plan.frame.bytes() + recompression_copies * plan.far_bytes +
                      static_cast<std::int64_t>(4.0 * 8.0 * random_loads * order);
  const double seconds_per_flop = dense.flops > 0.0 ? dense.seconds / dense.flops : 0.0;
  plan.near_seconds = seconds_per_flop * near_flops(factor, plan.stored.dofs, plan.frame) / near_efficiency;
  plan.sample_seconds = seconds_per_flop * random_loads * 4.0 * static_cast<double>(factor.entries());
  plan.far_seconds = far_share * plan.near_seconds;
  const auto touch_columns =
      touch_steps * static_cast<double>(touches * std::ssize(certified_nodes) * (model.dimension() + 3));
  plan.touch_seconds = touch_share * plan.near_seconds * touch_columns / order;
  return plan;
}

std::vector<Stage> compression_stages(const CompressionPlan& plan, int ranks) {
  return {{near_stage, plan.near_seconds / ranks},
          {sample_stage, plan.sample_seconds / ranks},
          {far_stage, plan.far_seconds / ranks},
          {touch_stage, plan.touch_seconds / ranks}};
}

std::vector<Tile> near_tiles(const HierarchicalMatrix& frame) {
  std::vector<Tile> tiles;
  const Index together = clusters_together(frame.tree.levels);
  for (Index leaf = 0; leaf < frame.tree.leaves(); leaf += together) {
    const auto begin = static_cast<std::size_t>(frame.first_near_pair(leaf)),
               end = static_cast<std::size_t>(frame.first_near_pair(leaf + together));
    tiles.push_back({leaf, together, static_cast<double>(frame.near_at[end] - frame.near_at[begin])});
  }
  return tiles;
}

void see_all(Team& team, ModelWriter& writer, bool reads) {
  if (team.size() == 1) return;
  writer.flush();
  team.any(false);  // all have flushed
  if (reads) writer.look_again();
}

std::optional<Solved> solve_compressed(const BakeRun& run, const CompressionPlan& plan, const Factor& factor,
                                       const std::optional<BakePart>& part, ModelWriter& writer) {
  if (SpreadNumbers* spread = factor.spread_numbers(); spread != nullptr)
    return solve_compressed_alone(run, plan, factor, *spread, writer);
  GreensCompressor compressor(run, plan, factor, writer);
  const PieceRange leaves = part ? part->pieces.front() : PieceRange{0, plan.frame.tree.leaves()};
  if (!compressor.solve_near(leaves)) return {};
  Solved solved;
  if (part) return solved;
  see_all(run.team, writer, true);
  solved.compressed = compressor.compress();
  if (solved.compressed == nullptr) return {};
  if (run.team.leads()) solved.probes = make_probes(factor, plan.stored.dofs);
  return solved;
}

std::string certificate_text(const HierarchicalMatrix& matrix) {
  std::string text;
  for (std::size_t row = 0; row + 6 <= matrix.certificate.size(); row += 6) {
    const double* e = matrix.certificate.data() + row;
    text += fmt::format("{}    {:.0f} node{}: median {:.1e}, 99 % {:.1e}, largest {:.1e} of {:.0f}",
                        row == 0 ? "" : "\n", e[0], e[0] == 1.0 ? "" : "s", e[2], e[3], e[4], e[1]);
    if (e[5] > 0.0) text += fmt::format("; at most {:.2f} of a tick's bound", e[5]);
  }
  return text;
}

}  // namespace palpate

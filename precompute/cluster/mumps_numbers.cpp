#include "precompute/cluster/mumps_numbers.h"

#include <cblas.h>
#include <dmumps_c.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <string>
#include <vector>

#include "base/error.h"
#include "precompute/cluster/rank_messages.h"

namespace palpate {
namespace {

constexpr int most_room = 1000;  // [percent]
constexpr std::int64_t megabyte = 1'000'000;

enum class Job : MUMPS_INT { begin = -1, end = -2, analyse = 1, factorize = 2, solve = 3 };

/// What rank 0 says before ranks solve.
enum class Call : std::int64_t { solve, columns, multiply, release };

/// Entries of loads by columns, counted from 1, as MUMPS takes them.
struct SparseLoads {
  std::vector<MUMPS_INT> starts{1};
  std::vector<MUMPS_INT> rows;
  std::vector<double> values;

  void add(std::int64_t dof, double value) {
    rows.push_back(static_cast<MUMPS_INT>(dof + 1));
    values.push_back(value);
  }
  void end_column() { starts.push_back(static_cast<MUMPS_INT>(rows.size() + 1)); }
  [[nodiscard]] std::int64_t columns() const { return std::ssize(starts) - 1; }
};

/// Rows of a solution that a rank has found, or has been given: `places` [rows] in the order of the caller's,
/// `values` [rows x columns] column-major.
struct SolutionRows {
  std::vector<int> places;
  std::vector<double> values;
};

Error failure(const DMUMPS_STRUC_C& mumps, const std::string& step) {
  const int status = mumps.infog[0], detail = mumps.infog[1];
  if (status == -10 || status == -40)
    return {"K is not positive definite", step, "Hold the body with [[fixed]], and check the material"};
  if (status == -13 || status == -7)
    return {fmt::format("MUMPS ran out of memory (status {}, {})", status, detail), step,
            "Use more nodes, or a coarser mesh (mesh.edge_length) or a stronger grading"};
  return {fmt::format("MUMPS gave up (status {}, {})", status, detail), step,
          "Use another number of ranks; where that does not help, please report it"};
}

/// Columns of a block that a rank is given.
ColumnShare share_of_rank(std::int64_t first, std::int64_t count, int rank, int ranks) {
  const std::int64_t begin = count * rank / ranks, end = count * (rank + 1) / ranks;
  return {first + begin, end - begin};
}

class MumpsNumbers : public SpreadNumbers {
 public:
  MumpsNumbers(MPI_Comm ranks, const SparseMatrix& K, std::span<const std::int64_t> permutation,
               const MumpsOptions& options);
  ~MumpsNumbers() override;
  MumpsNumbers(const MumpsNumbers&) = delete;
  MumpsNumbers& operator=(const MumpsNumbers&) = delete;

  void factorize() override;
  std::vector<double> solve(std::span<const double> b, std::int64_t columns) override;
  ColumnShare columns(std::span<const std::int64_t> dofs, std::int64_t first, std::int64_t count,
                      std::vector<double>& packed) override;
  void multiply(std::span<const std::int64_t> from, std::int64_t columns, std::span<const double> f,
                std::span<const std::int64_t> to, std::span<double> u) override;
  void serve() override;
  void release() override { announce(Call::release, 0, 0); }
  [[nodiscard]] SpreadMemory memory() const override { return memory_; }

 private:
  /// A call, its columns and the rows that it wants.
  struct Announcement {
    Call call = Call::release;
    std::int64_t columns = 0, rows = 0;
  };

  void run(Job job);
  void expect_version() const;
  [[nodiscard]] MUMPS_INT& control(int number) { return mumps_.icntl[number - 1]; }
  void give_entries();
  Announcement announce(Call call, std::int64_t columns, std::int64_t rows);
  void solve_dense(std::span<double> x, std::int64_t columns);
  SolutionRows solve_sparse(SparseLoads loads, std::int64_t columns, const std::vector<int>& place_of);
  SolutionRows share_out(const SolutionRows& found, std::int64_t columns, bool all_to_leader) const;
  void take_part_in_multiply(std::int64_t columns, std::int64_t rows);
  [[nodiscard]] std::vector<int> places(std::span<const std::int64_t> dofs) const;
  [[nodiscard]] bool leads() const { return rank_ == 0; }

  const SparseMatrix& K_;
  MumpsOptions options_;
  MPI_Comm ranks_ = MPI_COMM_NULL;
  int rank_ = 0, size_ = 1;
  int unwinding_ = std::uncaught_exceptions();
  DMUMPS_STRUC_C mumps_{};
  std::vector<MUMPS_INT> order_;           // position of each dof, from 1
  std::vector<MUMPS_INT> rows_, columns_;  // of this rank's entries of K, from 1
  SpreadMemory memory_;
};

/// One rank's share of K: columns next to each other, whose values are used where they are.
void MumpsNumbers::give_entries() {
  const std::int64_t entries = K_.nonZeros();
  const std::int64_t* starts = K_.outerIndexPtr();
  const auto column_of = [&](int rank) {
    return std::lower_bound(starts, starts + K_.cols(), entries * rank / size_) - starts;
  };
  const std::int64_t first = column_of(rank_), end = rank_ + 1 == size_ ? K_.cols() : column_of(rank_ + 1);
  rows_.reserve(static_cast<std::size_t>(starts[end] - starts[first]));
  columns_.reserve(rows_.capacity());
  for (std::int64_t j = first; j < end; ++j) {
    for (std::int64_t at = starts[j]; at < starts[j + 1]; ++at) {
      rows_.push_back(static_cast<MUMPS_INT>(K_.innerIndexPtr()[at] + 1));
      columns_.push_back(static_cast<MUMPS_INT>(j + 1));
    }
  }
  mumps_.nnz_loc = std::ssize(rows_);
  mumps_.irn_loc = rows_.data();
  mumps_.jcn_loc = columns_.data();
  mumps_.a_loc = const_cast<double*>(K_.valuePtr()) + starts[first];
}

MumpsNumbers::MumpsNumbers(MPI_Comm ranks, const SparseMatrix& K, std::span<const std::int64_t> permutation,
                           const MumpsOptions& options)
    : K_(K), options_(options) {
  if (K.cols() > std::numeric_limits<MUMPS_INT>::max())
    throw Error(fmt::format("MUMPS takes no more than 2^31 unknowns, and K has {}", K.cols()),
                "--factor distributed", "Use a coarser mesh");
  MPI_Comm_dup(ranks, &ranks_);
  rank_ = rank_in(ranks_);
  size_ = size_of(ranks_);
  mumps_.comm_fortran = static_cast<MUMPS_INT>(MPI_Comm_c2f(ranks_));
  mumps_.sym = 1;  // positive definite
  mumps_.par = 1;  // rank 0 works too
  run(Job::begin);
  expect_version();
  for (const int stream : {1, 2, 3}) control(stream) = -1;
  control(4) = 0;   // no text
  control(7) = 1;   // ordered by perm_in
  control(8) = 0;   // not scaled
  control(18) = 3;  // each rank brings entries of K
  control(28) = 1;  // analysed by rank 0
  control(35) = 0;  // no low-rank blocks
  control(14) = options.room;
  mumps_.n = static_cast<MUMPS_INT>(K.cols());
  if (leads()) {
    order_.resize(permutation.size());
    for (std::size_t p = 0; p < permutation.size(); ++p)
      order_[static_cast<std::size_t>(permutation[p])] = static_cast<MUMPS_INT>(p + 1);
    mumps_.perm_in = order_.data();
  }
  give_entries();
  run(Job::analyse);
  if (mumps_.infog[0] < 0) throw failure(mumps_, "analysis of K");
  memory_.expected = mumps_.infog[15] * megabyte;
  memory_.expected_all = mumps_.infog[16] * megabyte;
  memory_.room = options.room;
}

/// Throws Error where the library is another one than the header was of.
void MumpsNumbers::expect_version() const {
  const std::string here = mumps_.version_number, built_for = MUMPS_VERSION;
  if (here == built_for) return;
  throw Error(fmt::format("MUMPS {} is here, and this program was built for {}", here, built_for),
              "--factor distributed", "Build it again on this machine");
}

MumpsNumbers::~MumpsNumbers() {
  if (std::uncaught_exceptions() > unwinding_)
    return;  // the other ranks are elsewhere: the run is at its end
  run(Job::end);
  MPI_Comm_free(&ranks_);
}

void MumpsNumbers::run(Job job) {
  mumps_.job = static_cast<MUMPS_INT>(job);
  openblas_set_num_threads(options_.threads);
  dmumps_c(&mumps_);
  openblas_set_num_threads(1);
}

void MumpsNumbers::factorize() {
  constexpr std::array too_little_room = {-8, -9, -14, -15, -17, -20};
  run(Job::factorize);
  while (std::find(too_little_room.begin(), too_little_room.end(), mumps_.infog[0]) !=
             too_little_room.end() &&
         memory_.room < most_room) {
    memory_.room = std::max(2 * memory_.room, 20);
    control(14) = memory_.room;
    run(Job::factorize);
  }
  if (mumps_.infog[0] < 0) throw failure(mumps_, "factorisation of K");
  if (mumps_.infog[11] > 0) {
    mumps_.infog[0] = -10;
    throw failure(mumps_, "factorisation of K");
  }
  memory_.used = mumps_.infog[20] * megabyte;
  memory_.used_all = mumps_.infog[21] * megabyte;
  for (auto* entries : {&rows_, &columns_, &order_}) std::vector<MUMPS_INT>().swap(*entries);
  mumps_.irn_loc = mumps_.jcn_loc = mumps_.perm_in = nullptr;
}

MumpsNumbers::Announcement MumpsNumbers::announce(Call call, std::int64_t columns, std::int64_t rows) {
  std::array<std::int64_t, 3> said = {static_cast<std::int64_t>(call), columns, rows};
  broadcast(said.data(), 3, MPI_INT64_T, ranks_);
  return {static_cast<Call>(said[0]), said[1], said[2]};
}

/// x holds the loads [n, columns] of rank 0, and then the solution.
void MumpsNumbers::solve_dense(std::span<double> x, std::int64_t columns) {
  mumps_.nrhs = static_cast<MUMPS_INT>(columns);
  mumps_.lrhs = mumps_.n;
  mumps_.rhs = leads() ? x.data() : nullptr;
  control(20) = 0;
  control(21) = 0;
  control(27) = mumps_.nrhs;
  run(Job::solve);
  if (mumps_.infog[0] < 0) throw failure(mumps_, "solution with K");
  constexpr std::int64_t at_once = std::int64_t{1} << 27;
  for (std::int64_t at = 0; at < std::ssize(x); at += at_once)
    broadcast(x.data() + at, static_cast<int>(std::min(at_once, std::ssize(x) - at)), MPI_DOUBLE, ranks_);
}

std::vector<double> MumpsNumbers::solve(std::span<const double> b, std::int64_t columns) {
  const Announcement said = announce(Call::solve, columns, 0);
  if (said.call != Call::solve || said.columns != columns)
    throw Error("ranks have come to different numbers", "--factor distributed",
                "Start the same build on all nodes, on one kind of processor");
  std::vector<double> x(b.begin(), b.end());
  solve_dense(x, columns);
  return x;
}

/// Place in `dofs` of each dof of K, or -1.
std::vector<int> MumpsNumbers::places(std::span<const std::int64_t> dofs) const {
  std::vector<int> place_of(static_cast<std::size_t>(K_.cols()), -1);
  for (std::size_t k = 0; k < dofs.size(); ++k)
    if (dofs[k] >= 0) place_of[static_cast<std::size_t>(dofs[k])] = static_cast<int>(k);
  return place_of;
}

/// The rows with a place that this rank finds; `loads` are rank 0's.
SolutionRows MumpsNumbers::solve_sparse(SparseLoads loads, std::int64_t columns,
                                        const std::vector<int>& place_of) {
  const MUMPS_INT found = mumps_.info[22];  // rows
  std::vector<double> values(static_cast<std::size_t>(std::max<MUMPS_INT>(found, 1) * columns));
  std::vector<MUMPS_INT> dofs(static_cast<std::size_t>(std::max<MUMPS_INT>(found, 1)));
  mumps_.nrhs = static_cast<MUMPS_INT>(columns);
  if (leads()) {  // MUMPS refuses loads of others
    mumps_.nz_rhs = static_cast<MUMPS_INT>(loads.rows.size());
    mumps_.irhs_ptr = loads.starts.data();
    mumps_.irhs_sparse = loads.rows.data();
    mumps_.rhs_sparse = loads.values.data();
  }
  mumps_.lsol_loc = static_cast<MUMPS_INT>(dofs.size());
  mumps_.sol_loc = values.data();
  mumps_.isol_loc = dofs.data();
  control(20) = 3;  // loads are sparse: only their paths to the root are swept
  control(21) = 1;  // solutions stay where they are found
  control(27) = mumps_.nrhs;
  run(Job::solve);
  if (mumps_.infog[0] < 0) throw failure(mumps_, "solution with K");
  SolutionRows rows;
  std::vector<std::size_t> at;
  for (std::size_t k = 0; k < static_cast<std::size_t>(found); ++k) {
    const int place = place_of[static_cast<std::size_t>(dofs[k] - 1)];
    if (place < 0) continue;
    rows.places.push_back(place);
    at.push_back(k);
  }
  rows.values.reserve(at.size() * static_cast<std::size_t>(columns));
  for (std::size_t c = 0; c < static_cast<std::size_t>(columns); ++c)
    for (const std::size_t k : at) rows.values.push_back(values[c * dofs.size() + k]);
  return rows;
}

/// All rows, of this rank's share of the columns.
SolutionRows MumpsNumbers::share_out(const SolutionRows& found, std::int64_t columns,
                                     bool all_to_leader) const {
  const auto share = [&](int rank) {
    if (all_to_leader) return rank == 0 ? columns : 0;
    return share_of_rank(0, columns, rank, size_).count;
  };
  const auto ranks = static_cast<std::size_t>(size_);
  std::vector<int> rows(ranks), first_row(ranks, 0), sent(ranks), send_at(ranks, 0), taken(ranks),
      take_at(ranks, 0);
  const int own = static_cast<int>(found.places.size());
  MPI_Allgather(&own, 1, MPI_INT, rows.data(), 1, MPI_INT, ranks_);
  for (std::size_t r = 0; r < ranks; ++r) {
    sent[r] = static_cast<int>(share(static_cast<int>(r))) * own;
    taken[r] = static_cast<int>(share(rank_)) * rows[r];
    if (r == 0) continue;
    first_row[r] = first_row[r - 1] + rows[r - 1];
    send_at[r] = send_at[r - 1] + sent[r - 1];
    take_at[r] = take_at[r - 1] + taken[r - 1];
  }
  SolutionRows all;
  all.places.resize(static_cast<std::size_t>(first_row.back()) + static_cast<std::size_t>(rows.back()));
  MPI_Allgatherv(found.places.data(), own, MPI_INT, all.places.data(), rows.data(), first_row.data(), MPI_INT,
                 ranks_);
  std::vector<double> pieces(static_cast<std::size_t>(take_at.back()) +
                             static_cast<std::size_t>(taken.back()));
  MPI_Alltoallv(found.values.data(), sent.data(), send_at.data(), MPI_DOUBLE, pieces.data(), taken.data(),
                take_at.data(), MPI_DOUBLE, ranks_);
  all.values.resize(pieces.size());
  for (std::size_t r = 0; r < ranks; ++r) {  // a rank's piece [its rows, columns] to its rows of all
    for (std::int64_t c = 0; c < share(rank_); ++c)
      std::copy_n(pieces.begin() + take_at[r] + c * rows[r], rows[r],
                  all.values.begin() + c * std::ssize(all.places) + first_row[r]);
  }
  return all;
}

ColumnShare MumpsNumbers::columns(std::span<const std::int64_t> dofs, std::int64_t first, std::int64_t count,
                                  std::vector<double>& packed) {
  SparseLoads loads;
  std::vector<std::int64_t> solved;  // columns of the block that are not held
  for (std::int64_t c = 0; c < count; ++c) {
    const std::int64_t dof = dofs[static_cast<std::size_t>(first + c)];
    if (dof < 0) continue;
    solved.push_back(first + c);
    loads.add(dof, 1.0);
    loads.end_column();
  }
  const std::int64_t width = std::ssize(solved);
  std::vector<int> place_of = places(dofs);
  for (int& place : place_of)
    if (place < first) place = -1;  // rows above the diagonal are another block's columns
  SolutionRows rows;
  if (width > 0) rows = share_out(solve_sparse(std::move(loads), width, place_of), width, false);
  const ColumnShare mine = share_of_rank(0, width, rank_, size_);
  // A held column goes with the solved one before it.
  const auto n = std::ssize(dofs);
  const auto begin_of = [&](std::int64_t k) {
    if (k == width && (width > 0 || rank_ > 0)) return first + count;
    return k == 0 ? first : solved[static_cast<std::size_t>(k)];
  };
  ColumnShare share{begin_of(mine.first), begin_of(mine.first + mine.count) - begin_of(mine.first)};
  if (width == 0 && leads()) share.count = count;
  const auto start = [&](std::int64_t j) {  // of column j in `packed`
    const std::int64_t k = j - share.first;
    return k * (n - share.first) - k * (k - 1) / 2;
  };
  packed.assign(static_cast<std::size_t>(start(share.first + share.count)), 0.0);
  for (std::int64_t c = 0; c < mine.count; ++c) {
    const std::int64_t j = solved[static_cast<std::size_t>(mine.first + c)];
    const double* values = rows.values.data() + c * std::ssize(rows.places);
    for (std::size_t k = 0; k < rows.places.size(); ++k)
      if (rows.places[k] >= j) packed[static_cast<std::size_t>(start(j) + rows.places[k] - j)] = values[k];
  }
  return share;
}

void MumpsNumbers::multiply(std::span<const std::int64_t> from, std::int64_t columns,
                            std::span<const double> f, std::span<const std::int64_t> to,
                            std::span<double> u) {
  announce(Call::multiply, columns, std::ssize(to));
  std::vector<std::int64_t> wanted(to.begin(), to.end());
  broadcast(wanted.data(), static_cast<int>(wanted.size()), MPI_INT64_T, ranks_);
  SparseLoads loads;
  for (std::int64_t c = 0; c < columns; ++c) {
    for (std::size_t k = 0; k < from.size(); ++k) {
      const double value = f[k * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c)];
      if (from[k] >= 0 && value != 0.0) loads.add(from[k], value);
    }
    if (loads.rows.size() + 1 == static_cast<std::size_t>(loads.starts.back())) {  // a column is not empty
      const auto free = std::find_if(from.begin(), from.end(), [](std::int64_t dof) { return dof >= 0; });
      loads.add(free == from.end() ? 0 : *free, 0.0);
    }
    loads.end_column();
  }
  const std::vector<int> place_of = places(to);
  const SolutionRows rows = share_out(solve_sparse(std::move(loads), columns, place_of), columns, true);
  std::fill(u.begin(), u.end(), 0.0);
  std::vector<std::size_t> row_at(to.size(), 0);
  for (std::size_t k = 0; k < rows.places.size(); ++k) row_at[static_cast<std::size_t>(rows.places[k])] = k;
  for (std::size_t k = 0; k < to.size(); ++k) {
    if (to[k] < 0) continue;
    const std::size_t row = row_at[static_cast<std::size_t>(place_of[static_cast<std::size_t>(to[k])])];
    for (std::size_t c = 0; c < static_cast<std::size_t>(columns); ++c)
      u[k * static_cast<std::size_t>(columns) + c] = rows.values[c * rows.places.size() + row];
  }
}

void MumpsNumbers::take_part_in_multiply(std::int64_t columns, std::int64_t rows) {
  std::vector<std::int64_t> wanted(static_cast<std::size_t>(rows));
  broadcast(wanted.data(), static_cast<int>(rows), MPI_INT64_T, ranks_);
  share_out(solve_sparse({}, columns, places(wanted)), columns, true);
}

void MumpsNumbers::serve() {
  while (true) {
    const Announcement said = announce({}, 0, 0);
    if (said.call == Call::release) return;
    if (said.call == Call::multiply) {
      take_part_in_multiply(said.columns, said.rows);
    } else {
      std::vector<double> x(static_cast<std::size_t>(said.columns * mumps_.n));
      solve_dense(x, said.columns);
    }
  }
}

}  // namespace

bool has_mumps() {
  return true;
}

std::unique_ptr<SpreadNumbers> make_mumps_numbers(MPI_Comm ranks, const SparseMatrix& K,
                                                  std::span<const std::int64_t> permutation,
                                                  const MumpsOptions& options) {
  return std::make_unique<MumpsNumbers>(ranks, K, permutation, options);
}

}  // namespace palpate

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
#include "precompute/cluster/rank_calls.h"

namespace palpate {
namespace {

constexpr int most_room = 1000;  // [percent]
constexpr std::int64_t megabyte = 1'000'000;

enum class Job : MUMPS_INT { begin = -1, end = -2, analyse = 1, factorize = 2, solve = 3 };

/// Command of rank 0 before ranks solve.
enum class Call : std::int64_t { solve, multiply, release };

/// Entries of loads by columns, counted from 1, in MUMPS's format.
struct SparseLoads {
  std::vector<MUMPS_INT> starts{1};
  std::vector<MUMPS_INT> rows;
  std::vector<double> values;

  void add(std::int64_t dof, double value) {
    rows.push_back(static_cast<MUMPS_INT>(dof + 1));
    values.push_back(value);
  }
  void end_column() { starts.push_back(static_cast<MUMPS_INT>(rows.size() + 1)); }
};

/// Rows of a solution that a rank computed: `places` [rows] in the order of the caller's, `values`
/// [rows x columns] column-major.
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

class MumpsNumbers : public SpreadNumbers {
 public:
  MumpsNumbers(MPI_Comm ranks, const SparseMatrix& K, std::span<const std::int64_t> permutation,
               const MumpsOptions& options);
  ~MumpsNumbers() override;
  MumpsNumbers(const MumpsNumbers&) = delete;
  MumpsNumbers& operator=(const MumpsNumbers&) = delete;

  void factorize() override;
  std::vector<double> solve(std::span<const double> b, std::int64_t columns) override;
  void multiply(std::span<const std::int64_t> from, std::int64_t columns, std::span<const double> f,
                std::span<const std::int64_t> to, std::span<double> u) override;
  void serve(const std::function<bool()>& interrupted) override;
  [[nodiscard]] bool interrupted() const override { return interrupted_; }
  void release() override { announce(Call::release, 0, 0); }
  [[nodiscard]] SpreadMemory memory() const override { return memory_; }

 private:
  /// A call, its columns and the requested rows.
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
  void gather(const SolutionRows& found, bool interrupted_here, std::int64_t columns, std::span<double> u);
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
  bool interrupted_ = false;
};

/// Passes one rank's part of K to MUMPS: adjacent columns, whose values are used in place.
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

/// Throws Error if the library's version differs from its header's.
void MumpsNumbers::expect_version() const {
  const std::string here = mumps_.version_number, built_for = MUMPS_VERSION;
  if (here == built_for) return;
  throw Error(fmt::format("MUMPS {} is here, and this program was built for {}", here, built_for),
              "--factor distributed", "Build it again on this machine");
}

MumpsNumbers::~MumpsNumbers() {
  if (std::uncaught_exceptions() > unwinding_) return;  // the other ranks are elsewhere: the run is ending
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

/// Solves with the loads [n, columns] of rank 0 in x, which become the solution.
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

/// Solves for the rows with a place that this rank computes; `loads` are rank 0's.
SolutionRows MumpsNumbers::solve_sparse(SparseLoads loads, std::int64_t columns,
                                        const std::vector<int>& place_of) {
  const MUMPS_INT found = mumps_.info[22];  // rows
  std::vector<double> values(static_cast<std::size_t>(std::max<MUMPS_INT>(found, 1) * columns));
  std::vector<MUMPS_INT> dofs(static_cast<std::size_t>(std::max<MUMPS_INT>(found, 1)));
  mumps_.nrhs = static_cast<MUMPS_INT>(columns);
  if (leads()) {  // MUMPS refuses loads of other ranks
    mumps_.nz_rhs = static_cast<MUMPS_INT>(loads.rows.size());
    mumps_.irhs_ptr = loads.starts.data();
    mumps_.irhs_sparse = loads.rows.data();
    mumps_.rhs_sparse = loads.values.data();
  }
  mumps_.lsol_loc = static_cast<MUMPS_INT>(dofs.size());
  mumps_.sol_loc = values.data();
  mumps_.isol_loc = dofs.data();
  control(20) = 3;  // loads are sparse: only their paths to the root are swept
  control(21) = 1;  // solutions stay on the rank that computes them
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

/// Gathers rows to their places in the leader's u [places, columns], row-major.
void MumpsNumbers::gather(const SolutionRows& found, bool interrupted_here, std::int64_t columns,
                          std::span<double> u) {
  const auto ranks = static_cast<std::size_t>(size_);
  std::vector<std::array<int, 2>> said(ranks);
  const std::array<int, 2> own = {static_cast<int>(found.places.size()), interrupted_here ? 1 : 0};
  MPI_Gather(own.data(), 2, MPI_INT, said.data(), 2, MPI_INT, 0, ranks_);
  std::vector<int> rows(ranks), first_row(ranks + 1, 0), entries(ranks), first_entry(ranks + 1, 0);
  for (std::size_t r = 0; r < ranks; ++r) {
    interrupted_ = interrupted_ || said[r][1] != 0;
    rows[r] = said[r][0];
    entries[r] = rows[r] * static_cast<int>(columns);
    first_row[r + 1] = first_row[r] + rows[r];
    first_entry[r + 1] = first_entry[r] + entries[r];
  }
  std::vector<int> places(static_cast<std::size_t>(first_row.back()));
  std::vector<double> values(static_cast<std::size_t>(first_entry.back()));
  MPI_Gatherv(found.places.data(), own[0], MPI_INT, places.data(), rows.data(), first_row.data(), MPI_INT, 0,
              ranks_);
  MPI_Gatherv(found.values.data(), own[0] * static_cast<int>(columns), MPI_DOUBLE, values.data(),
              entries.data(), first_entry.data(), MPI_DOUBLE, 0, ranks_);
  for (std::size_t r = 0; r < ranks; ++r) {  // a rank's piece is [its rows, columns]
    for (std::int64_t row = 0; row < rows[r]; ++row) {
      const std::int64_t place = places[static_cast<std::size_t>(first_row[r] + row)];
      for (std::int64_t c = 0; c < columns; ++c)
        u[static_cast<std::size_t>(place * columns + c)] =
            values[static_cast<std::size_t>(first_entry[r] + c * rows[r] + row)];
    }
  }
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
    if (loads.rows.size() + 1 == static_cast<std::size_t>(loads.starts.back())) {  // no column is empty
      const auto free = std::find_if(from.begin(), from.end(), [](std::int64_t dof) { return dof >= 0; });
      loads.add(free == from.end() ? 0 : *free, 0.0);
    }
    loads.end_column();
  }
  const std::vector<int> place_of = places(to);
  std::fill(u.begin(), u.end(), 0.0);
  gather(solve_sparse(std::move(loads), columns, place_of), false, columns, u);
  for (std::int64_t k = 0; k < std::ssize(to); ++k) {  // a dof that is requested twice is computed once
    const std::int64_t dof = to[static_cast<std::size_t>(k)];
    if (dof < 0) continue;
    const std::int64_t place = place_of[static_cast<std::size_t>(dof)];
    if (place != k) std::copy_n(u.begin() + place * columns, columns, u.begin() + k * columns);
  }
}

void MumpsNumbers::serve(const std::function<bool()>& interrupted) {
  while (true) {
    const Announcement said = announce({}, 0, 0);
    if (said.call == Call::release) return;
    if (said.call == Call::multiply) {
      std::vector<std::int64_t> wanted(static_cast<std::size_t>(said.rows));
      broadcast(wanted.data(), static_cast<int>(said.rows), MPI_INT64_T, ranks_);
      gather(solve_sparse({}, said.columns, places(wanted)), interrupted(), said.columns, {});
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

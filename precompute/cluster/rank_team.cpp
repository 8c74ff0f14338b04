#include "precompute/cluster/rank_team.h"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <exception>
#include <thread>
#include <utility>

#include "precompute/cluster/mumps_numbers.h"
#include "precompute/cluster/rank_calls.h"
#include "precompute/machine/allotment.h"
#include "precompute/numerics/parcel.h"

namespace palpate {
namespace {

constexpr std::chrono::microseconds between_looks{500};  // time between polls while threads of the rank solve
constexpr std::int64_t no_tile = -1;                     // marks a report that is a line

/// Threads of each rank of a node; ranks that are not bound to processors divide them equally.
int threads_of_rank(MPI_Comm node) {
  cpu_set_t mask;
  CPU_ZERO(&mask);
  ::sched_getaffinity(0, sizeof mask, &mask);
  std::vector<cpu_set_t> masks(static_cast<std::size_t>(size_of(node)));
  MPI_Allgather(&mask, sizeof mask, MPI_BYTE, masks.data(), sizeof mask, MPI_BYTE, node);
  for (const cpu_set_t& other : masks) CPU_OR(&mask, &mask, &other);
  return std::max(1, std::min(allotted_processors(), CPU_COUNT(&mask) / size_of(node)));
}

/// Text of one rank, in all ranks.
std::string text_of_rank(int rank, std::string text) {
  constexpr std::int64_t at_once = std::int64_t{1} << 30;  // MPI counts in ints
  std::int64_t bytes = std::ssize(text);
  broadcast(&bytes, 1, MPI_INT64_T, MPI_COMM_WORLD, rank);
  text.resize(static_cast<std::size_t>(bytes));
  for (std::int64_t at = 0; at < bytes; at += at_once)
    broadcast(text.data() + at, static_cast<int>(std::min(at_once, bytes - at)), MPI_BYTE, MPI_COMM_WORLD,
              rank);
  return text;
}

}  // namespace

/// State of one call of `work`.
struct RankTeam::Round {
  const std::vector<Tile>& tiles;
  const TileWork& work;
  std::atomic<int> solving;      // threads of this rank
  std::exception_ptr failure{};  // exception of one of them
};

RankTeam::RankTeam() : rank_(rank_in(MPI_COMM_WORLD)), size_(size_of(MPI_COMM_WORLD)) {
  MPI_Comm node = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &node);
  size_here_ = size_of(node);
  default_jobs_ = threads_of_rank(node);
  MPI_Comm_free(&node);
  constexpr int bytes = sizeof(std::int64_t);
  void* memory = nullptr;
  MPI_Win_allocate(RankTeam::leads() ? bytes : 0, bytes, MPI_INFO_NULL, MPI_COMM_WORLD, &memory, &counter_);
  MPI_Win_lock_all(MPI_MODE_NOCHECK, counter_);
}

void RankTeam::end() {
  MPI_Win_unlock_all(counter_);
  MPI_Win_free(&counter_);
}

/// Draws a tile that no other thread gets; a number past the last if none is left.
std::int64_t RankTeam::draw() {
  constexpr std::int64_t one = 1;
  std::int64_t tile = 0;
  const std::scoped_lock lock(calls_);
  MPI_Fetch_and_op(&one, &tile, MPI_INT64_T, 0, 0, MPI_SUM, counter_);
  MPI_Win_flush(0, counter_);
  return tile;
}

void RankTeam::set_counter(std::int64_t tile) {
  std::int64_t before = 0;
  const std::scoped_lock lock(calls_);
  MPI_Fetch_and_op(&tile, &before, MPI_INT64_T, 0, 0, MPI_REPLACE, counter_);
  MPI_Win_flush(0, counter_);
}

/// Work of one thread.
void RankTeam::solve(Round& round, int worker) {
  const std::int64_t tiles = std::ssize(round.tiles);
  try {
    for (std::int64_t tile = draw(); tile < tiles; tile = draw()) {
      round.work.solve(round.tiles[static_cast<std::size_t>(tile)], worker);
      add_news(tile, "");
    }
  } catch (...) {
    const std::scoped_lock lock(telling_);
    if (!round.failure) round.failure = std::current_exception();
  }
  --round.solving;
}

bool RankTeam::work(const std::vector<Tile>& tiles, int jobs, const TileWork& work) {
  if (leads()) set_counter(0);
  const auto* bytes = reinterpret_cast<const char*>(tiles.data());
  const std::string shared = share({bytes, leads() ? tiles.size() * sizeof(Tile) : 0});
  std::vector<Tile> all(shared.size() / sizeof(Tile));
  if (!all.empty()) std::memcpy(all.data(), shared.data(), shared.size());
  Round round{all, work, jobs};
  std::vector<std::jthread> threads;
  threads.reserve(static_cast<std::size_t>(jobs));
  for (int worker = 0; worker < jobs; ++worker)
    threads.emplace_back([this, &round, worker] { solve(round, worker); });
  try {
    return attend(round);
  } catch (...) {
    set_counter(std::ssize(all));  // threads end after their current tiles
    throw;
  }
}

/// Polls until all ranks have reported everything that they solved: then no tile is being solved, and no
/// thread draws any more.
bool RankTeam::attend(Round& round) {
  bool stopped = false;
  for (bool ended = false; !ended;) {
    ended = round.solving == 0;
    if (!stopped && round.work.interrupted()) {
      stopped = true;
      set_counter(std::ssize(round.tiles));  // stops all ranks
    }
    pass_on(round);
    if (!ended) std::this_thread::sleep_for(between_looks);
  }
  int mine = stopped ? 1 : 0, any_stopped = 0;
  MPI_Request last = MPI_REQUEST_NULL;
  MPI_Iallreduce(&mine, &any_stopped, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD, &last);
  while (!is_over(last)) {
    pass_on(round);
    std::this_thread::sleep_for(between_looks);
  }
  return any_stopped == 0;
}

/// Passes on reports of this rank's threads, and in the leader those of other ranks. Rethrows the exception
/// of a thread.
void RankTeam::pass_on(Round& round) {
  const std::string own = take_news();
  {
    const std::scoped_lock lock(telling_);
    if (round.failure) std::rethrow_exception(round.failure);
  }
  if (!leads()) return send_news(own);
  const auto solved = [&](std::int64_t tile) {
    round.work.done(round.tiles[static_cast<std::size_t>(tile)]);
  };
  hear(own, solved);
  for (std::string news = receive_news(); !news.empty(); news = receive_news()) hear(news, solved);
}

void RankTeam::add_news(std::int64_t tile, const std::string& line) {
  Parcel news;
  news.carry(tile);
  std::vector<char> text(line.begin(), line.end());
  news.carry(text);
  const std::scoped_lock lock(telling_);
  news_ += news.bytes();
}

std::string RankTeam::take_news() {
  const std::scoped_lock lock(telling_);
  return std::exchange(news_, {});
}

/// Sends reports and returns once the leader has them, so that none are in flight when all ranks have ended.
void RankTeam::send_news(const std::string& news) {
  if (news.empty()) return;
  MPI_Request request = MPI_REQUEST_NULL;
  {
    const std::scoped_lock lock(calls_);
    MPI_Issend(news.data(), static_cast<int>(news.size()), MPI_BYTE, 0, 0, MPI_COMM_WORLD, &request);
  }
  while (!is_over(request)) std::this_thread::sleep_for(between_looks);
}

/// A report that a rank has sent; empty if there is none.
std::string RankTeam::receive_news() {
  int there = 0, count = 0;
  MPI_Status status = {};
  const std::scoped_lock lock(calls_);
  MPI_Iprobe(MPI_ANY_SOURCE, 0, MPI_COMM_WORLD, &there, &status);
  if (there == 0) return {};
  MPI_Get_count(&status, MPI_BYTE, &count);
  std::string news(static_cast<std::size_t>(count), '\0');
  MPI_Recv(news.data(), count, MPI_BYTE, status.MPI_SOURCE, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return news;
}

void RankTeam::hear(std::string_view news, const std::function<void(std::int64_t tile)>& solved) {
  Parcel rest(news);
  while (!rest.empty()) {
    std::int64_t tile = 0;
    std::vector<char> line;
    rest.carry(tile);
    rest.carry(line);
    if (tile == no_tile) {
      listener_({line.begin(), line.end()});
    } else {
      solved(tile);
    }
  }
}

bool RankTeam::is_over(MPI_Request& request) {
  int over = 0;
  const std::scoped_lock lock(calls_);
  MPI_Test(&request, &over, MPI_STATUS_IGNORE);
  return over != 0;
}

void RankTeam::tell(const std::string& line) {
  add_news(no_tile, line);
}

bool RankTeam::can_spread() const {
  return size_ > 1 && has_mumps();
}

std::unique_ptr<SpreadNumbers> RankTeam::spread(const SparseMatrix& K, const Factor& analysed, int jobs) {
  return make_mumps_numbers(MPI_COMM_WORLD, K, analysed.permutation(), {.threads = jobs});
}

bool RankTeam::any(bool here) {
  int mine = here ? 1 : 0, all = 0;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(&mine, &all, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD, &request);
  wait(request);
  return all != 0;
}

std::string RankTeam::share(std::string text) {
  return text_of_rank(0, std::move(text));
}

void RankTeam::exchange(const std::string& bytes, const std::function<void(std::string_view)>& take) {
  for (int rank = 0; rank < size_; ++rank) {
    const std::string theirs = text_of_rank(rank, rank == rank_ ? bytes : "");
    if (rank != rank_) take(theirs);
  }
}

}  // namespace palpate

#include "precompute/cluster/rank_team.h"

#include <mpi.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <sstream>

#include "base/error.h"
#include "precompute/cluster/mumps_numbers.h"
#include "precompute/cluster/rank_messages.h"
#include "precompute/cluster/rank_threads.h"
#include "precompute/machine/allotment.h"

namespace palpate {
namespace {

using Clock = RankClock;

constexpr std::chrono::microseconds between_looks{500};  // for messages, while threads of the rank solve
constexpr std::chrono::seconds between_signs{5};         // of life, from every rank
constexpr std::chrono::seconds longest_silence{60};      // since the first message of a call of `work`
constexpr Clock::time_point never{};
constexpr int page = 4096;         // bytes that are exchanged together
constexpr std::int64_t ahead = 4;  // a rank takes tiles ahead while each thread of all has more than so many

enum class Kind : std::int32_t {
  ask,    // `first` tiles now, up to `count` more ahead
  give,   // a tile
  told,   // a line
  done,   // a tile
  back,   // `count` tiles that are not solved
  stop,   // interrupted here
  halt,   // begin no more tiles
  end,    // all is done (`first` = 1) or interrupted
  alive,  // nothing else to say
};

struct Head {
  Kind kind{};
  std::int32_t epoch = 0;  // number of the `work` that it belongs to
  std::int64_t first = 0, count = 0;
  double cost = 0.0;
};

struct Message {
  Head head;
  std::string text;
  int from = 0;
};

void barrier(MPI_Comm comm) {
  if (size_of(comm) == 1) return;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibarrier(comm, &request);
  wait(request);
}

}  // namespace

struct RankTeam::Impl {
  /// One call of `work`.
  struct Round {
    explicit Round(const TileWork& work) : tile_work(work) {}

    const TileWork& tile_work;
    RankMutex mutex;  // of all that follows
    RankCondition ready;
    std::deque<Tile> stock;  // that threads of this rank take from; the leader's is that of all
    std::deque<Message> outbox;
    int waiting = 0;  // threads
    bool closed = false, halted = false, told_stop = false;
    std::exception_ptr failure;
  };

  void form();
  void send(int to, const Head& head, const std::string& text = "");
  [[nodiscard]] std::optional<Message> receive();
  void solve(Round& round, int worker);
  void halt(Round& round);
  bool lead(Round& round, const std::function<void(const std::string&)>& listener, int jobs);
  void take(Round& round, const Tile& tile);
  bool follow(Round& round, int jobs);
  void tell_stop(Round& round);
  void answer_asks(Round& round);
  void show_signs_of_life();
  void expect_signs_of_life();
  void lead_message(Round& round, const Message& message,
                    const std::function<void(const std::string&)>& listener);

  MPI_Comm node = MPI_COMM_NULL;
  MPI_Comm team = MPI_COMM_NULL;  // of this rank where it takes part
  bool by_node = false;
  FactorOf factor_of = FactorOf::rank;
  std::string lines;  // of a tile that is solved together, for the leader
  int default_jobs = 1;
  std::int32_t epoch = 0;
  std::deque<Message> early;  // of calls of `work` and `gather` that are to come
  Round* round = nullptr;     // under way
  // The leader's:
  std::int64_t out = 0;                           // tiles that were given and not done
  std::vector<std::array<std::int64_t, 2>> asks;  // of each rank: now, ahead
  std::vector<bool> joined;                       // ranks that have begun this call: the file is open there
  std::int64_t all_threads = 1;
  bool interrupted = false;
  std::vector<Clock::time_point> heard;
  Clock::time_point shown;
};

void RankTeam::Impl::send(int to, const Head& head, const std::string& text) {
  std::vector<char> bytes(sizeof head + text.size());
  std::memcpy(bytes.data(), &head, sizeof head);
  std::copy(text.begin(), text.end(), bytes.begin() + sizeof head);
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Isend(bytes.data(), static_cast<int>(bytes.size()), MPI_BYTE, to, 0, team, &request);
  wait(request);
}

std::optional<Message> RankTeam::Impl::receive() {
  if (!early.empty() && early.front().head.epoch <= epoch) {
    Message message = std::move(early.front());
    early.pop_front();
    heard[static_cast<std::size_t>(message.from)] = Clock::now();
    return message;
  }
  int there = 0;
  MPI_Status status = {};
  MPI_Iprobe(MPI_ANY_SOURCE, 0, team, &there, &status);
  if (there == 0) return {};
  int count = 0;
  MPI_Get_count(&status, MPI_BYTE, &count);
  std::vector<char> bytes(static_cast<std::size_t>(count));
  MPI_Recv(bytes.data(), count, MPI_BYTE, status.MPI_SOURCE, 0, team, MPI_STATUS_IGNORE);
  Message message;
  if (bytes.size() < sizeof message.head) return {};
  std::memcpy(&message.head, bytes.data(), sizeof message.head);
  message.text.assign(bytes.begin() + sizeof message.head, bytes.end());
  message.from = status.MPI_SOURCE;
  if (message.head.epoch > epoch) {
    early.push_back(std::move(message));
    return {};
  }
  heard[static_cast<std::size_t>(message.from)] = Clock::now();
  return message;
}

/// A thread's work.
void RankTeam::Impl::solve(Round& all, int worker) {
  std::unique_lock lock(all.mutex);
  while (true) {
    ++all.waiting;
    all.ready.wait(lock, [&] { return all.closed || (!all.halted && !all.stock.empty()); });
    --all.waiting;
    if (all.closed) return;
    const Tile tile = all.stock.front();
    all.stock.pop_front();
    lock.unlock();
    try {
      all.tile_work.solve(tile, worker);
    } catch (...) {
      lock.lock();
      if (!all.failure) all.failure = std::current_exception();
      return;
    }
    lock.lock();
    all.outbox.push_back({{Kind::done, epoch, tile.first, tile.count, tile.cost}, "", 0});
  }
}

/// Gives ranks the tiles that they have asked for.
void RankTeam::Impl::answer_asks(Round& all) {
  for (std::size_t k = 1; k < asks.size(); ++k) {
    auto& [now, later] = asks[k];
    std::vector<Tile> given;
    {
      const std::scoped_lock lock(all.mutex);
      while (!all.halted && !all.stock.empty() &&
             (now > 0 || (later > 0 && std::ssize(all.stock) > ahead * all_threads))) {
        given.push_back(all.stock.front());
        all.stock.pop_front();
        --(now > 0 ? now : later);
      }
    }
    later = 0;
    for (const Tile& tile : given) {
      ++out;
      send(static_cast<int>(k), {Kind::give, epoch, tile.first, tile.count, tile.cost});
    }
  }
}

void RankTeam::Impl::lead_message(Round& all, const Message& message,
                                  const std::function<void(const std::string&)>& listener) {
  const Head& head = message.head;
  if (head.epoch != epoch) return;
  auto& ask = asks[static_cast<std::size_t>(message.from)];
  joined[static_cast<std::size_t>(message.from)] = true;
  switch (head.kind) {
    case Kind::ask:
      ask = {ask[0] + head.first, head.count};
      break;
    case Kind::told:
      listener(message.text);
      break;
    case Kind::done:
      --out;
      all.tile_work.done({head.first, head.count, head.cost});
      break;
    case Kind::back:
      out -= head.count;
      break;
    case Kind::stop:
      interrupted = true;
      break;
    default:
      break;
  }
}

void RankTeam::Impl::show_signs_of_life() {
  if (Clock::now() < shown + between_signs) return;
  shown = Clock::now();
  if (rank_in(team) > 0) {
    send(0, {Kind::alive, epoch});
    return;
  }
  for (int to = 1; to < size_of(team); ++to) send(to, {Kind::alive, epoch});
}

void RankTeam::Impl::expect_signs_of_life() {
  const bool leads = rank_in(team) == 0;
  for (std::size_t k = 0; k < heard.size(); ++k) {
    if ((k == 0) == leads || heard[k] == never || Clock::now() < heard[k] + longest_silence) continue;
    throw Error(
        "rank " + std::to_string(k) + " has not answered for a minute: its node is gone, or stands still",
        "MPI", "Give the same command again: it goes on with the columns that are done");
  }
}

/// No thread of this rank begins a tile any more.
void RankTeam::Impl::halt(Round& all) {
  const std::scoped_lock lock(all.mutex);
  if (all.halted) return;
  all.halted = true;
  if (rank_in(team) > 0 && !all.stock.empty())
    all.outbox.push_back({{Kind::back, epoch, 0, std::ssize(all.stock)}, "", 0});
  all.stock.clear();
}

bool RankTeam::Impl::lead(Round& all, const std::function<void(const std::string&)>& listener, int jobs) {
  asks.assign(static_cast<std::size_t>(size_of(team)), {0, 0});
  joined.assign(asks.size(), false);
  joined.front() = true;
  all_threads = std::int64_t{jobs} * size_of(team);
  out = 0;
  interrupted = false;
  while (true) {
    bool idle = true;
    while (const auto message = receive()) {
      idle = false;
      lead_message(all, *message, listener);
    }
    std::deque<Message> own;
    bool ended = false;
    {
      const std::scoped_lock lock(all.mutex);
      own.swap(all.outbox);
      ended = all.stock.empty() && all.waiting == jobs;
      if (all.failure) std::rethrow_exception(all.failure);
    }
    for (const Message& message : own)
      all.tile_work.done({message.head.first, message.head.count, message.head.cost});
    const bool all_joined = std::find(joined.begin(), joined.end(), false) == joined.end();
    if (ended && all_joined && out == 0 && own.empty() && idle) break;
    if ((interrupted = interrupted || all.tile_work.interrupted()) && !all.halted) {
      halt(all);
      for (int to = 1; to < size_of(team); ++to) send(to, {Kind::halt, epoch});
    }
    answer_asks(all);
    show_signs_of_life();
    expect_signs_of_life();
    if (idle) pause_for(between_looks);
  }
  for (int to = 1; to < size_of(team); ++to) send(to, {Kind::end, epoch, interrupted ? 0 : 1});
  return !interrupted;
}

/// Puts a tile into the stock, or gives it back.
void RankTeam::Impl::take(Round& all, const Tile& tile) {
  const std::scoped_lock lock(all.mutex);
  if (all.halted) {
    all.outbox.push_back({{Kind::back, epoch, 0, 1}, "", 0});
  } else {
    all.stock.push_back(tile);
    all.ready.notify_one();
  }
}

bool RankTeam::Impl::follow(Round& all, int jobs) {
  std::int64_t asked = 0;  // tiles that were asked for and did not come
  while (true) {
    bool idle = true;
    while (const auto message = receive()) {
      idle = false;
      const Head& head = message->head;
      if (head.kind == Kind::end && head.epoch == epoch) return head.first != 0;
      if (head.kind == Kind::halt) halt(all);
      if (head.kind == Kind::give) {
        asked = std::max<std::int64_t>(asked - 1, 0);
        take(all, {head.first, head.count, head.cost});
      }
    }
    std::deque<Message> own;
    std::int64_t need = 0, more = 0;
    {
      const std::scoped_lock lock(all.mutex);
      own.swap(all.outbox);
      if (all.failure) std::rethrow_exception(all.failure);
      need = all.halted ? 0 : all.waiting - std::ssize(all.stock) - asked;
      more = std::max<std::int64_t>(jobs - std::ssize(all.stock), 0);
    }
    for (const Message& message : own) send(0, message.head, message.text);
    if (need > 0) {
      send(0, {Kind::ask, epoch, need, more});
      asked += need;
    }
    tell_stop(all);
    show_signs_of_life();
    expect_signs_of_life();
    if (idle) pause_for(between_looks);
  }
}

/// Says once that this rank was interrupted.
void RankTeam::Impl::tell_stop(Round& all) {
  if (all.told_stop || !all.tile_work.interrupted()) return;
  all.told_stop = true;
  send(0, {Kind::stop, epoch});
}

void RankTeam::Impl::form() {
  if (team != MPI_COMM_NULL) MPI_Comm_free(&team);
  const bool takes_part = !by_node || rank_in(node) == 0;
  MPI_Comm_split(MPI_COMM_WORLD, takes_part ? 0 : MPI_UNDEFINED, rank_in(MPI_COMM_WORLD), &team);

  // The processors of the node's ranks.
  cpu_set_t mask;
  CPU_ZERO(&mask);
  ::sched_getaffinity(0, sizeof mask, &mask);
  std::vector<cpu_set_t> masks(static_cast<std::size_t>(size_of(node)));
  MPI_Allgather(&mask, sizeof mask, MPI_BYTE, masks.data(), sizeof mask, MPI_BYTE, node);
  int own = allotted_processors(), sum = 0;
  MPI_Allreduce(&own, &sum, 1, MPI_INT, MPI_SUM, node);
  for (const cpu_set_t& other : masks) CPU_OR(&mask, &mask, &other);
  const int here = std::max(1, std::min(sum, CPU_COUNT(&mask)));
  default_jobs = by_node ? here : std::max(1, std::min(own, here / size_of(node)));
  if (by_node && takes_part) ::sched_setaffinity(0, sizeof mask, &mask);
  if (takes_part) heard.assign(static_cast<std::size_t>(size_of(team)), never);
}

RankTeam::RankTeam() : impl_(std::make_unique<Impl>()) {
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_in(MPI_COMM_WORLD), MPI_INFO_NULL,
                      &impl_->node);
  MPI_Comm_dup(MPI_COMM_WORLD, &impl_->team);
}

RankTeam::~RankTeam() = default;

void RankTeam::form(FactorOf factor_of) {
  impl_->by_node = factor_of == FactorOf::node || factor_of == FactorOf::automatic;
  impl_->factor_of = factor_of;
  impl_->form();
}

bool RankTeam::takes_part() const {
  return impl_->team != MPI_COMM_NULL;
}

bool RankTeam::leads() const {
  return takes_part() && rank_in(impl_->team) == 0;
}

int RankTeam::size() const {
  return takes_part() ? size_of(impl_->team) : 1;
}

int RankTeam::size_here() const {
  return impl_->by_node ? 1 : size_of(impl_->node);
}

int RankTeam::rank() const {
  return takes_part() ? rank_in(impl_->team) : rank_in(MPI_COMM_WORLD);
}

int RankTeam::default_jobs() const {
  return impl_->default_jobs;
}

bool RankTeam::work(const std::vector<Tile>& tiles, int jobs, const TileWork& work) {
  Impl::Round round(work);
  ++impl_->epoch;
  impl_->heard.assign(impl_->heard.size(), never);
  if (leads()) round.stock.assign(tiles.begin(), tiles.end());
  impl_->round = &round;
  std::vector<RankThread> threads;
  const auto close = [&] {
    const std::scoped_lock lock(round.mutex);
    round.closed = true;
    round.ready.notify_all();
  };
  try {
    for (int worker = 0; worker < jobs; ++worker)
      threads.emplace_back([this, &round, worker] { impl_->solve(round, worker); });
    const bool whole = leads() ? impl_->lead(round, listener_, jobs) : impl_->follow(round, jobs);
    close();
    threads.clear();
    impl_->round = nullptr;
    return whole;
  } catch (...) {
    close();
    throw;
  }
}

Spreading RankTeam::spreading() const {
  if (impl_->factor_of == FactorOf::all) return Spreading::always;
  const bool may = impl_->factor_of == FactorOf::automatic && size() > 1 && has_mumps();
  return may ? Spreading::where_needed : Spreading::never;
}

std::unique_ptr<SpreadNumbers> RankTeam::spread(const SparseMatrix& K, const Factor& analysed, int jobs) {
  return make_mumps_numbers(impl_->team, K, analysed.permutation(), {.threads = jobs});
}

void RankTeam::hand_over_lines() {
  const std::vector<std::string> all = gather(impl_->lines);
  impl_->lines.clear();
  for (const std::string& of_rank : all) {
    std::istringstream lines(of_rank);
    for (std::string line; std::getline(lines, line);) listener_(line);
  }
}

void RankTeam::tell(const std::string& line) {
  if (impl_->round == nullptr) {
    impl_->lines += line;
    if (line.empty() || line.back() != '\n') impl_->lines += '\n';
    return;
  }
  const std::scoped_lock lock(impl_->round->mutex);
  impl_->round->outbox.push_back({{Kind::told, impl_->epoch}, line, 0});
}

bool RankTeam::any(bool here) {
  int mine = here ? 1 : 0, all = 0;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallreduce(&mine, &all, 1, MPI_INT, MPI_MAX, impl_->team, &request);
  wait(request);
  return all != 0;
}

std::string RankTeam::share(std::string text) {
  std::int64_t bytes = std::ssize(text);
  broadcast(&bytes, 1, MPI_INT64_T, impl_->team);
  text.resize(static_cast<std::size_t>(bytes));
  broadcast(text.data(), static_cast<int>(bytes), MPI_BYTE, impl_->team);
  return text;
}

/// MPI counts in ints, so pages are exchanged.
void RankTeam::exchange(const std::string& bytes, const std::function<void(std::string_view)>& take) {
  MPI_Comm team = impl_->team;
  const auto ranks = static_cast<std::size_t>(size());
  std::vector<std::int64_t> sizes(ranks);
  const std::int64_t own = std::ssize(bytes);
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Iallgather(&own, 1, MPI_INT64_T, sizes.data(), 1, MPI_INT64_T, team, &request);
  wait(request);

  std::vector<int> counts(ranks), starts(ranks);
  int all = 0;
  for (std::size_t k = 0; k < ranks; ++k) {
    counts[k] = static_cast<int>((sizes[k] + page - 1) / page);
    starts[k] = all;
    all += counts[k];
  }
  MPI_Datatype pages = MPI_DATATYPE_NULL;
  MPI_Type_contiguous(page, MPI_BYTE, &pages);
  MPI_Type_commit(&pages);
  std::vector<char> received(static_cast<std::size_t>(all) * page);
  const auto place = [&](std::size_t k) {
    return received.data() + static_cast<std::size_t>(starts[k]) * page;
  };
  std::copy(bytes.begin(), bytes.end(), place(static_cast<std::size_t>(rank())));
  MPI_Iallgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, received.data(), counts.data(), starts.data(), pages,
                  team, &request);
  wait(request);
  MPI_Type_free(&pages);
  for (std::size_t k = 0; k < ranks; ++k)
    if (k != static_cast<std::size_t>(rank())) take({place(k), static_cast<std::size_t>(sizes[k])});
}

std::vector<std::string> RankTeam::gather(const std::string& text) {
  std::vector<std::string> texts(static_cast<std::size_t>(size()));
  ++impl_->epoch;
  if (!leads()) {
    impl_->send(0, {Kind::told, impl_->epoch}, text);
    return {};
  }
  texts.front() = text;
  for (std::size_t missing = texts.size() - 1; missing > 0;) {
    const auto message = impl_->receive();
    if (!message) {
      pause_for(between_looks);
    } else if (message->head.kind == Kind::told && message->head.epoch == impl_->epoch) {
      texts[static_cast<std::size_t>(message->from)] = message->text;
      --missing;
    }
  }
  return texts;
}

void RankTeam::end() {
  barrier(MPI_COMM_WORLD);
  if (impl_->team != MPI_COMM_NULL) MPI_Comm_free(&impl_->team);
  MPI_Comm_free(&impl_->node);
}

}  // namespace palpate

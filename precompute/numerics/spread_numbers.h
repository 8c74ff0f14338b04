// Numbers of a factor that no process has alone.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace palpate {

/// Memory of the processes that have parts of a factor.
struct SpreadMemory {
  std::int64_t expected = 0;      ///< of the process that needs most [byte]
  std::int64_t expected_all = 0;  ///< of all [byte]
  std::int64_t used = 0;          ///< by the process that used most, once factorised [byte]
  std::int64_t used_all = 0;      ///< by all [byte]
  int room = 0;                   ///< work space beyond the estimate that the factorisation took [percent]
};

/// The numbers of a Cholesky factor over several processes. All make the same calls in the same order, unless
/// they `serve`; what is given counts in the leader. The dofs are those of K.
class SpreadNumbers {
 public:
  SpreadNumbers() = default;
  virtual ~SpreadNumbers() = default;
  SpreadNumbers(const SpreadNumbers&) = delete;
  SpreadNumbers& operator=(const SpreadNumbers&) = delete;

  /// Throws Error when K is not positive definite or memory is short.
  virtual void factorize() = 0;

  /// x = K^-1 b [n, columns] column-major, in every process.
  virtual std::vector<double> solve(std::span<const double> b, std::int64_t columns) = 0;

  /// u = K^-1 f at the dofs `to`, of loads f [from x columns] on the dofs `from`, both row-major, -1 where
  /// held. In the leader, while the others serve.
  virtual void multiply(std::span<const std::int64_t> from, std::int64_t columns, std::span<const double> f,
                        std::span<const std::int64_t> to, std::span<double> u) = 0;

  /// Takes part in what the leader solves, until it calls `release`. The leader is told when `interrupted`.
  virtual void serve(const std::function<bool()>& interrupted) = 0;
  virtual void release() = 0;                          ///< by the leader
  [[nodiscard]] virtual bool interrupted() const = 0;  ///< a process that serves, as the leader knows

  [[nodiscard]] virtual SpreadMemory memory() const = 0;
};

}  // namespace palpate

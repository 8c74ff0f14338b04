// Numbers of a factor distributed over several processes.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace palpate {

/// Memory of the processes that hold parts of a factor.
struct SpreadMemory {
  std::int64_t expected = 0;      ///< of the process that needs most [byte]
  std::int64_t expected_all = 0;  ///< of all [byte]
  std::int64_t used = 0;          ///< by the process that used most, after factorisation [byte]
  std::int64_t used_all = 0;      ///< by all [byte]
  int room = 0;                   ///< work space beyond the estimate that the factorisation used [percent]
};

/// Numbers of a Cholesky factor over several processes. All make the same calls in the same order, unless
/// they `serve`; arguments count in the leader. Dofs are those of K.
class SpreadNumbers {
 public:
  SpreadNumbers() = default;
  virtual ~SpreadNumbers() = default;
  SpreadNumbers(const SpreadNumbers&) = delete;
  SpreadNumbers& operator=(const SpreadNumbers&) = delete;

  /// Computes the factor. Throws Error if K is not positive definite or memory is short.
  virtual void factorize() = 0;

  /// x = K^-1 b [n, columns] column-major, in every process.
  virtual std::vector<double> solve(std::span<const double> b, std::int64_t columns) = 0;

  /// u = K^-1 f at the dofs `to`, for loads f [from x columns] on the dofs `from`, both row-major, -1 for
  /// held dofs. In the leader, while the others serve.
  virtual void multiply(std::span<const std::int64_t> from, std::int64_t columns, std::span<const double> f,
                        std::span<const std::int64_t> to, std::span<double> u) = 0;

  /// Takes part in the leader's solves until it calls `release`. Reports to the leader when `interrupted`.
  virtual void serve(const std::function<bool()>& interrupted) = 0;
  virtual void release() = 0;                          ///< called by the leader
  [[nodiscard]] virtual bool interrupted() const = 0;  ///< true in the leader if a serving process is
                                                       ///< interrupted

  [[nodiscard]] virtual SpreadMemory memory() const = 0;
};

}  // namespace palpate

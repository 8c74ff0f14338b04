// Solver for contact with many points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/core/solve/contact_problem.h"
#include "runtime/core/solve/gmres.h"

namespace palpate {

/// Solves a ContactProblem with many contacts: block Gauss-Seidel sweeps, each contact solved exactly with
/// the others fixed, and between them steps of a semismooth Newton method on Alart & Curnier's equations
/// (1991) with three unknowns at a sticking contact and two at a slipping one, or one without friction,
/// solved by preconditioned GMRES (Saad & Schultz 1986). Sweeps smooth the forces and keep them inside the
/// cones; Newton steps remove the errors for which sweeps converge slowly. It starts from the guess in lambda
/// plus its predicted change, or from the guess alone if that is better, and costs almost nothing if the
/// guess is the solution. W and all long vectors are in single precision: forces and motions change little
/// from tick to tick. docs/decisions has the comparison with other methods. All memory is allocated at
/// construction.
///
/// Residual: the largest difference of the two sides of the equations at a contact, relative to the largest
/// force. The sum of the forces, which is felt, is accurate to a tenth of that: the remaining errors are
/// rough and cancel.
class NewtonKrylov {
 public:
  NewtonKrylov(Index max_contacts, Index max_rows);

  /// Computes problem.lambda from the guess in it. False if the residual exceeds ManyTuning's `accepted` at
  /// the end of the budget: lambda is then the best found, inside the cones.
  bool solve(ContactProblem& problem) noexcept;

  /// Improves lambda of a problem of few contacts, with W in double precision, to single-precision accuracy,
  /// as `solve` does. False if the capacity is exceeded, or the residual exceeds `accepted`.
  bool improve_few(ContactProblem& problem) noexcept;

  /// Derivative of lambda with respect to b, for up to three changes: `db` and `dlambda` [changes x rows];
  /// dlambda holds a guess before, which may be zero. Contacts stay open, sticking or slipping as they are.
  void derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                  std::span<double> dlambda) noexcept;

  [[nodiscard]] int products() const noexcept { return products_; }  ///< products with W in the last `solve`
  [[nodiscard]] int rounds() const noexcept { return rounds_; }      ///< rounds of the last `solve`
  [[nodiscard]] double residual() const noexcept {
    return residual_;
  }  ///< residual of the last `solve` [largest force]
  /// True if `solve` left time for another pass.
  [[nodiscard]] bool was_easy() const noexcept;
  /// r [rows] at the end of the last `solve` [m].
  [[nodiscard]] std::span<const float> motion() const noexcept { return r_; }

 private:
  enum class Kind : std::uint8_t { absent, normal, cone, held };
  enum class Mode : std::uint8_t { open, stick, slip };
  static constexpr int most_changes = 3;

  struct Contact {
    Index first = 0;  // row
    int rows = 0;
    Index owner = -1;  // contact of a held row
    Kind kind = Kind::held;
    Mode mode = Mode::open;
    double mu = 0.0;
    double w = 0.0;                                         // mean of the diagonal of W
    Vec3 n = Vec3::Zero();                                  // normal in the axes of the rows
    Eigen::Matrix3d D = Eigen::Matrix3d::Identity();        // block of W for the contact itself
    Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();  // inverse of D
    Vec3 e = Vec3::Zero();                                  // slipping: direction of the tangential force
    Vec3 across = Vec3::Zero();                             // slipping: direction across it
    double turning = 0.0;                                   // slipping: motion across per force across [m/N]
  };

  /// Contact that is not open, in the reduced system of GMRES: three unknowns if it sticks, two if it slips.
  /// Matrices are row-major.
  struct Reduced {
    Index first = 0;  // row
    int rows = 0;
    std::array<float, 9> image{};    // forces from unknowns
    std::array<float, 9> test{};     // equations from motions
    std::array<float, 9> inverse{};  // unknowns from equations, for the contact alone
    float turning = 0.0F;            // second equation from the second unknown
  };

  void load(ContactProblem& problem) noexcept;
  void enter_cone(const Contact& contact) noexcept;
  void enter_cones() noexcept;
  void find_motion(const ContactProblem& problem) noexcept;
  void move_by_change(const ContactProblem& problem) noexcept;
  void predict(const ContactProblem& problem) noexcept;
  void keep_best() noexcept;
  template <typename Real>
  [[nodiscard]] Vec3 at(const std::vector<Real>& v, const Contact& contact) const noexcept;
  void change_force(const Contact& contact, const Vec3& change) noexcept;
  void open(const Contact& contact) noexcept;
  [[nodiscard]] bool is_present(const Contact& contact) const noexcept;
  [[nodiscard]] Vec3 suiting_change(const Contact& contact, const Vec3& f, const Vec3& r) const noexcept;
  [[nodiscard]] Vec3 slipping_force(const Contact& contact, const Vec3& f, const Vec3& r,
                                    const Vec3& sticking) const noexcept;
  [[nodiscard]] Vec3 difference(const Contact& contact, const Vec3& f, const Vec3& r) const noexcept;
  void sweep(const ContactProblem& problem) noexcept;
  void find_residual() noexcept;
  [[nodiscard]] bool may_press(const Contact& contact, const Vec3& f, const Vec3& r) const noexcept;
  void choose_modes() noexcept;
  void move_to_modes(const ContactProblem& problem) noexcept;
  bool newton_step(const ContactProblem& problem) noexcept;
  void reduce() noexcept;
  void fill_image(const float* y, float* x) const noexcept;
  void test(const float* motion, float* out) const noexcept;
  void multiply_by_compliance(const ContactProblem& problem, int systems) noexcept;
  void solve_reduced(const ContactProblem& problem, int systems) noexcept;
  bool fill_guess(std::span<const double> dlambda, int changes) noexcept;
  [[nodiscard]] double product_work() const noexcept;
  [[nodiscard]] double round_work(bool with_step) const noexcept;
  void count_product() noexcept;
  [[nodiscard]] int most_steps() const noexcept;
  void take_best() noexcept;

  std::ptrdiff_t stride_;  // length of vectors
  std::vector<Contact> contacts_;
  Index count_ = 0;
  Index rows_ = 0;
  std::vector<double> f_,
      best_f_;  // [rows] forces: the sum of single-precision changes; those of the smallest residual
  std::vector<float> r_, best_r_;          // [rows] motion
  std::vector<double> few_b_, few_guess_;  // [rows] for a problem of few contacts
  std::vector<float> change_, product_;
  std::ptrdiff_t padded_rows_ = 0;
  std::vector<Reduced> reduced_;  // [max_contacts] the first active_ are used
  std::size_t active_ = 0;        // number of contacts that are not open
  std::vector<Gmres> gmres_;      // [most_changes]
  std::vector<float> x_, v_;      // [most_changes x stride] forces, and motions by them
  std::vector<float> y_;          // [most_changes x stride] unknowns
  std::vector<float> step_;       // [stride]
  std::vector<float> motions_;    // [most steps x stride] motions by the images of GMRES, for one system
  int products_ = 0;
  double work_ = 0.0;  // multiplications
  int rounds_ = 0;
  double residual_ = 0.0;       // [largest force]
  double largest_force_ = 0.0;  // [N]
  double best_ = 0.0;           // residual of best_f_
};

}  // namespace palpate

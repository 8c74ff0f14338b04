// Contact of many points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/solve/contact_problem.h"
#include "runtime/solve/gmres.h"

namespace palpate {

/// Solves a ContactProblem of many contacts: block Gauss-Seidel sweeps, each contact solved exactly with the
/// others as they are, and between them steps of a semismooth Newton method on Alart & Curnier's equations
/// (1991) that has three unknowns at a contact that sticks, two at one that slips and one without friction,
/// and is solved by preconditioned GMRES (Saad & Schultz 1986). Sweeps make the forces smooth and keep them
/// in the cones; Newton's steps settle what sweeps are slow at. It starts from the guess in lambda and what
/// is predicted of its change, or without that where it is no better, and costs next to nothing where the
/// guess is the solution. W and all that is long is in single precision: forces and
/// motions change little from tick to tick. docs/decisions has what it was compared with. All memory is taken
/// at construction.
///
/// Residual: the largest difference of the two sides of the equations at a contact, against the largest
/// force. What is felt, the sum, is right to a tenth of it: what is left is rough, and cancels.
class NewtonKrylov {
 public:
  NewtonKrylov(Index max_contacts, Index max_rows);

  /// Fills problem.lambda from the guess in it. False when the residual is over ManyTuning's `accepted` at
  /// the end of the budget: lambda is then the best that was found, and in the cones.
  bool solve(ContactProblem& problem) noexcept;

  /// Makes lambda of a problem of few contacts, W in double precision, better: to what single precision tells
  /// apart, as `solve` does. False when there is no room, or the residual is over `accepted`.
  bool improve_few(ContactProblem& problem) noexcept;

  /// What lambda changes by when b does, to first order, for up to three changes: `db` and `dlambda`
  /// [changes x rows]; dlambda holds a guess before, which may be zero. Contacts stay open, sticking or
  /// slipping as they are.
  void derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                  std::span<double> dlambda) noexcept;

  [[nodiscard]] int products() const noexcept { return products_; }  ///< with W, of the last `solve`
  [[nodiscard]] int rounds() const noexcept { return rounds_; }      ///< of the last `solve`
  [[nodiscard]] double residual() const noexcept {
    return residual_;
  }  ///< of the last `solve` [largest force]
  /// Whether `solve` left time for another.
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
    Index owner = -1;  // of a held row
    Kind kind = Kind::held;
    Mode mode = Mode::open;
    double mu = 0.0;
    double w = 0.0;                                         // mean of W's diagonal
    Vec3 n = Vec3::Zero();                                  // normal in the rows' axes
    Eigen::Matrix3d D = Eigen::Matrix3d::Identity();        // W at the contact itself
    Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();  // of D
    Vec3 e = Vec3::Zero();                                  // slipping: direction of the tangential force,
    Vec3 across = Vec3::Zero();                             // and across it
    double turning = 0.0;                                   // slipping: motion across by a force across [m/N]
  };

  /// A contact that is not open as GMRES has it: three unknowns where it sticks, two where it slips. Matrices
  /// are stored by rows.
  struct Reduced {
    Index first = 0;  // row
    int rows = 0;
    std::array<float, 9> image{};    // forces by the unknowns
    std::array<float, 9> test{};     // equations by the motion
    std::array<float, 9> inverse{};  // unknowns by the equations, of the contact alone
    float turning = 0.0F;            // second equation by the second unknown
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

  std::ptrdiff_t stride_;  // of vectors
  std::vector<Contact> contacts_;
  Index count_ = 0;
  Index rows_ = 0;
  std::vector<double> f_,
      best_f_;  // [rows] forces: the sum of single-precision changes; of the smallest residual
  std::vector<float> r_, best_r_;          // [rows] motion
  std::vector<double> few_b_, few_guess_;  // [rows] of a problem of few contacts
  std::vector<float> change_, product_;
  std::ptrdiff_t padded_rows_ = 0;
  std::vector<Reduced> reduced_;  // [max_contacts], the first active_
  std::size_t active_ = 0;        // contacts that are not open
  std::vector<Gmres> gmres_;      // [most_changes]
  std::vector<float> x_, v_;      // [most_changes x stride] forces, motions by them
  std::vector<float> y_;          // [most_changes x stride] unknowns
  std::vector<float> step_;       // [stride]
  std::vector<float> motions_;    // [most steps x stride] by GMRES' images, of one system
  int products_ = 0;
  double work_ = 0.0;  // multiplications
  int rounds_ = 0;
  double residual_ = 0.0;       // [largest force]
  double largest_force_ = 0.0;  // [N]
  double best_ = 0.0;           // residual of best_f_
};

}  // namespace palpate

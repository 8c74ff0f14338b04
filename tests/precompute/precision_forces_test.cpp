// The forces that a touch gives, from the stored precision: against K itself, solved with the touched nodes
// held, which is another route than the Green's functions.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "precompute/inspect.h"
#include "precompute/numerics/assembly.h"
#include "precompute/verify.h"
#include "tests/support/bodies/baked_body.h"
#include "tests/support/folders.h"

namespace palpate::precision_forces_test {
namespace {

using test::slender_beam;

/// A block on a foam that is a million times softer.
constexpr const char* stiff_on_soft = R"(name = "stiff_on_soft"
[geometry]
box = {size = [0.1, 0.1, 0.1], cells = [4, 4, 4]}
[[material]]
youngs_modulus = 1e3
poissons_ratio = 0.3
[[material]]
youngs_modulus = 1e9
poissons_ratio = 0.3
half_space = {point = [0, 0, 0.05], normal = [0, 0, 1]}
[[fixed]]
lowest = {axis = "z", percent = 1}
)";

constexpr const char* cube = R"(name = "cube"
[geometry]
box = {size = [0.1, 0.1, 0.1], cells = [5, 5, 5]}
[material]
youngs_modulus = 5000
poissons_ratio = 0.4
[[fixed]]
lowest = {axis = "z", percent = 1}
)";

std::string with_precision(const std::string& text, const std::string& precision) {
  return text + "[storage]\nprecision = \"" + precision + "\"\n";
}

class Baked : public testing::Test, public test::BakedBody {};

/// Reactions of K when some stored nodes are displaced by u: an own solve with those held.
class Reactions {
 public:
  explicit Reactions(const Model& model)
      : model_(model), stiffness_(assemble_stiffness(stiffness_input(model))) {
    K_ = stiffness_.K.selfadjointView<Eigen::Lower>();
  }

  [[nodiscard]] Eigen::VectorXd operator()(const std::vector<Index>& stored, const Eigen::VectorXd& u) const {
    std::vector<std::int64_t> number(static_cast<std::size_t>(K_.rows()), 0);
    std::vector<std::int64_t> held;
    for (const Index k : stored) {
      for (int axis = 0; axis < 3; ++axis)
        held.push_back(stiffness_.free_of_dof[static_cast<std::size_t>(
            3 * std::int64_t{model_.stored_nodes[static_cast<std::size_t>(k)]} + axis)]);
    }
    for (const std::int64_t dof : held) number[static_cast<std::size_t>(dof)] = -1;
    std::int64_t rest = 0;
    for (std::int64_t& i : number) i = i < 0 ? -1 : rest++;
    Eigen::VectorXd displaced = Eigen::VectorXd::Zero(K_.rows());
    for (std::size_t i = 0; i < held.size(); ++i) displaced[held[i]] = u[static_cast<Eigen::Index>(i)];
    const Eigen::VectorXd by_held = K_ * displaced;
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd load(rest);
    for (std::int64_t j = 0; j < K_.cols(); ++j) {
      const std::int64_t column = number[static_cast<std::size_t>(j)];
      if (column < 0) continue;
      load[column] = -by_held[j];
      for (SparseMatrix::InnerIterator entry(K_, j); entry; ++entry)
        if (const std::int64_t row = number[static_cast<std::size_t>(entry.row())]; row >= 0)
          entries.emplace_back(row, column, entry.value());
    }
    Eigen::SparseMatrix<double> inner(rest, rest);
    inner.setFromTriplets(entries.begin(), entries.end());
    const Eigen::VectorXd free = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(inner).solve(load);
    for (std::int64_t j = 0; j < K_.cols(); ++j)
      if (number[static_cast<std::size_t>(j)] >= 0) displaced[j] = free[number[static_cast<std::size_t>(j)]];
    const Eigen::VectorXd force = K_ * displaced;
    Eigen::VectorXd f(u.size());
    for (std::size_t i = 0; i < held.size(); ++i) f[static_cast<Eigen::Index>(i)] = force[held[i]];
    return f;
  }

 private:
  const Model& model_;
  Stiffness stiffness_;
  SparseMatrix K_;
};

double largest(const Eigen::VectorXd& f) {
  double most = 0.0;
  for (Eigen::Index node = 0; node < f.size() / 3; ++node)
    most = std::max(most, f.segment<3>(3 * node).norm());
  return most;
}

/// Stored nodes of the surface that are free.
std::vector<Index> free_surface_nodes(const Model& model) {
  std::vector<Index> nodes;
  for (Index k = 0; k < static_cast<Index>(model.stored_nodes.size()); ++k) {
    const Index node = model.stored_nodes[static_cast<std::size_t>(k)];
    if (std::find(model.surface.begin(), model.surface.end(), node) != model.surface.end())
      nodes.push_back(k);
  }
  return nodes;
}

/// The worst force error of touches of 1, 2, 5 and 30 neighbouring nodes at random places, moved as a whole
/// and at random: f = C^-1 u.
double worst_force_error(const Model& model) {
  const Reactions reactions(model);
  const std::vector<Index> nodes = free_surface_nodes(model);
  const auto position = [&](Index k) {
    return model.mesh.nodes[static_cast<std::size_t>(model.stored_nodes[static_cast<std::size_t>(k)])];
  };
  std::mt19937 random(3);
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  double worst = 0.0;
  for (int place = 0; place < 12; ++place) {
    const Vec3 at = position(nodes[random() % nodes.size()]);
    std::vector<Index> near = nodes;
    std::sort(near.begin(), near.end(), [&](Index a, Index b) {
      return std::pair((position(a) - at).norm(), a) < std::pair((position(b) - at).norm(), b);
    });
    for (const std::size_t count : {1U, 2U, 5U, 30U}) {
      const std::vector<Index> touched(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count));
      const auto size = 3 * static_cast<Eigen::Index>(count);
      const auto dof = [&](Eigen::Index i) {
        return 3 * Eigen::Index{touched[static_cast<std::size_t>(i / 3)]} + i % 3;
      };
      const auto xi = [&](Eigen::Index i, Eigen::Index j) { return model.greens(dof(i), dof(j)); };
      const Eigen::LLT<Eigen::MatrixXd> C(Eigen::MatrixXd::NullaryExpr(size, size, xi));
      for (Eigen::Index kind = 0; kind < 3; ++kind) {
        Eigen::VectorXd u(size);
        for (Eigen::Index i = 0; i < size; ++i)
          u[i] = kind == 2 ? entry(random) : (i % 3 == 2 * kind ? 1.0 : 0.0);
        const Eigen::VectorXd expected = reactions(touched, u);
        worst = std::max(worst, largest(C.solve(u) - expected) / largest(expected));
      }
    }
  }
  return worst;
}

using PrecisionForces = Baked;

TEST_F(PrecisionForces, OfASlenderBodyAreRightByDefault) {
  const Model model = bake_body(slender_beam);
  EXPECT_EQ(model.greens.precision(), Precision::split_precision);
  EXPECT_GT(model.force_errors[Precision::single_precision], 1e-4);
  EXPECT_LE(model.force_errors[Precision::split_precision], 1e-4);
  EXPECT_LE(worst_force_error(model), 1e-4);
  // That it is one element thick is the only one.
  EXPECT_EQ(said_.find("warning", said_.find("one element thick")), std::string::npos) << said_;
}

TEST_F(PrecisionForces, OfAStiffBlockOnFoamAreRightByDefault) {
  const Model model = bake_body(stiff_on_soft);
  EXPECT_EQ(model.greens.precision(), Precision::split_precision);
  EXPECT_LE(worst_force_error(model), 1e-4);
}

TEST_F(PrecisionForces, OfACompactBodyNeedNoMoreThanSingle) {
  const Model model = bake_body(cube);
  EXPECT_EQ(model.greens.precision(), Precision::single_precision);
  EXPECT_LE(worst_force_error(model), 1e-5);
  EXPECT_EQ(precision_warning(model, model.greens.precision()), "");
}

/// What was measured is what the runtime's forces are wrong by, to the luck of the places.
TEST_F(PrecisionForces, InSinglePrecisionAreToldToBeWrong) {
  const Model model = bake_body(with_precision(slender_beam, "single"));
  EXPECT_EQ(model.greens.precision(), Precision::single_precision);
  const double told = model.force_errors[Precision::single_precision], found = worst_force_error(model);
  EXPECT_GT(found, 1e-4);
  EXPECT_GT(told, found / 3.0);
  EXPECT_LT(told, 100.0 * found);
  EXPECT_NE(said_.find("warning: contact forces"), std::string::npos) << said_;
  EXPECT_NE(inspect(model).find("WARNING"), std::string::npos);
  EXPECT_NE(precision_warning(model, Precision::single_precision), "");
  const VerifyReport report = verify(model, file_);
  EXPECT_TRUE(report.passed()) << to_text(report);
  EXPECT_EQ(report.warnings.size(), 1U);
}

TEST_F(PrecisionForces, InDoublePrecisionAreRight) {
  const Model model = bake_body(with_precision(slender_beam, "double"));
  EXPECT_LE(model.force_errors[Precision::double_precision], 1e-7);
  EXPECT_LE(worst_force_error(model), 1e-7);
}

TEST_F(PrecisionForces, OfPackedDynamicsAreMeasuredToo) {
  const Model model = bake_body(std::string(slender_beam) +
                                "[storage]\nscope = \"full\"\n[dynamics]\nmethod = "
                                "\"packed\"\ntime_step = 0.1\n");
  EXPECT_EQ(model.greens.precision(), Precision::split_precision);
  EXPECT_EQ(model.dynamics.inverse.precision(), Precision::split_precision);
  ASSERT_NE(model.dynamics.inverse.smooth(), nullptr);
  EXPECT_NE(model.dynamics.inverse.smooth()->rows, model.greens.smooth()->rows);
  EXPECT_LE(model.dynamics.force_errors[Precision::split_precision], 1e-4);
  const VerifyReport report = verify(model, file_);
  EXPECT_TRUE(report.passed()) << to_text(report);
}

TEST_F(PrecisionForces, AFileInSplitPrecisionIsTheSameForAnyNumberOfJobs) {
  bake_body(slender_beam);
  const std::string first = bytes();
  bake_body(slender_beam, 3);
  EXPECT_EQ(bytes(), first);
}

TEST_F(PrecisionForces, AKilledRunIsContinuedInSplitPrecision) {
  std::string beam = slender_beam;  // of so many columns that the run is killed amid them
  beam.replace(beam.find("[40, 1, 1]"), 10, "[100, 2, 2]");
  const Model model = bake_body(beam);
  EXPECT_EQ(model.greens.precision(), Precision::split_precision);
  const std::string whole = bytes();
  std::filesystem::remove(file_);
  const std::string progress = file_.string() + ".progress", toml = (folder_ / "model.toml").string();
  const std::string program = palpate::test::built_file("precompute/palpate-precompute");
  const pid_t child = ::fork();
  if (child == 0) {
    const int null = ::open("/dev/null", O_WRONLY);
    ::dup2(null, STDERR_FILENO);
    ::execl(program.c_str(), program.c_str(), toml.c_str(), "-j", "1", "-o", file_.c_str(), nullptr);
    ::_exit(127);
  }
  const auto columns_done = [&] {
    std::ifstream in(progress);
    std::int64_t done = 0;
    for (std::string line; std::getline(in, line);) {
      std::istringstream words(line);
      std::string word;
      std::int64_t matrix = 0, first = 0, count = 0;
      if (words >> word >> matrix >> first >> count && word == "columns") done += count;
    }
    return done;
  };
  int status = 0;
  bool ended = false;
  while (!ended && columns_done() == 0) ended = ::waitpid(child, &status, WNOHANG) == child;
  if (!ended) {
    ::kill(child, SIGKILL);
    ::waitpid(child, &status, 0);
  }
  EXPECT_FALSE(WIFEXITED(status) && WEXITSTATUS(status) != 0);
  const std::int64_t done = columns_done();
  bake_body(beam);
  if (done > 0 && done < model.stored_dofs()) {  // else this process was held up until the run was over
    EXPECT_NE(said_.find(std::to_string(done) + " of " + std::to_string(model.stored_dofs()) +
                         " columns were kept"),
              std::string::npos)
        << said_;
  }
  EXPECT_EQ(bytes(), whole);
}

}  // namespace
}  // namespace palpate::precision_forces_test

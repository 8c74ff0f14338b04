// A sphere that slides at constant depth over a baked body.
//
//   sliding_study jumps MODEL.palpate.hdf [RADIUS [DEPTH]]
//     how much the force changes from one tick to the next
//   sliding_study stale MODEL.palpate.hdf OUT.csv [RADIUS [DEPTH]]
//     what the contact points of some time ago would make of the device's present pose; OUT.csv: the force
//     over time on one track
//
// The sphere is pressed in by 3 mm (DEPTH) below where it just touches the body at rest.
// scripts/studies/sliding runs both.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/core/tick/step.h"
#include "tests/bench/palpation_paths.h"

namespace palpate {
namespace {

constexpr int tracks_laid = 12;
constexpr double track_length = 0.04;  // [m]

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0.0;
  const auto k = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

std::string name_of(const std::optional<double>& friction) {
  return friction ? fmt::format("{:g}", *friction) : "the material's";
}

double share(const Vec3& change, const Vec3& a, const Vec3& b) {
  const double force = std::max(a.norm(), b.norm());
  return force > 0.0 ? change.norm() / force : 0.0;
}

/// Changes of force between the ticks of slides, as a share of the force.
struct Jumps {
  std::vector<double> hand, contact;
  std::vector<double> beyond;  // of the hand's change, what motion by the local stiffness does not explain
  std::vector<double> behind;  // how far the hand's force is from the contact's
  double handing_over = 0.0;   // ticks
};

void slide(const Body& body, const test::Slide& slide, State state, Jumps& jumps) {
  Vec3 hand_before = Vec3::Zero();
  Vec3 contact_before = Vec3::Zero();
  Vec3 device_before = Vec3::Zero();
  for (std::size_t k = 0; k < slide.poses.size(); ++k) {
    step(body, state, slide.poses[k]);
    const ToolState& tool = state.tools.front();
    const Vec3 hand = tool.wrench.force;
    const Vec3 contact = state.tools.front().contact_wrench.force;
    if (k >= slide.first_slide) {
      jumps.hand.push_back(share(hand - hand_before, hand, hand_before));
      const double explained = (tool.local.stiffness * (tool.device.position - device_before)).norm();
      jumps.beyond.push_back(std::max(0.0, (hand - hand_before).norm() - explained) /
                             std::max(hand.norm(), hand_before.norm()));
      jumps.contact.push_back(share(contact - contact_before, contact, contact_before));
      jumps.behind.push_back(share(hand - contact, contact, contact));
      jumps.handing_over += has(state.status, StepStatus::handing_over) ? 1.0 : 0.0;
    }
    hand_before = hand;
    contact_before = contact;
    device_before = tool.device.position;
  }
}

void print_jumps(const Body& body, double radius, double depth) {
  const std::vector<test::Track> tracks = test::lay_tracks(body, radius, track_length, tracks_laid);
  fmt::print("{}: {} tracks of {:.0f} mm, sphere of {:.1f} mm, {:.1f} mm deep\n\n", body.model().name,
             tracks.size(), 1e3 * track_length, 1e3 * radius, 1e3 * depth);
  fmt::print(
      "| body | friction | mm/s | ticks | hand: largest | 99 % | median | over 2 % | beyond motion | "
      "contact: largest | 99 % | median | ticks handing over | hand behind contact: 99 % |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const std::optional<double> friction : {std::optional<double>(0.0), std::optional<double>()}) {
    for (const double speed : {0.05, 0.2}) {
      Jumps jumps;
      for (const test::Track& track : tracks) {
        slide(body, test::slide_along(track, depth, speed),
              State(body, {.tools = {Tool{.radius = radius, .friction = friction}}}), jumps);
      }
      const auto per_cent = [](const std::vector<double>& values, double fraction) {
        return 100.0 * quantile(values, fraction);
      };
      fmt::print(
          "| {} | {} | {:.0f} | {} | {:.2f} % | {:.2f} % | {:.2f} % | {:.1f} % | {:.2f} % | {:.1f} % | "
          "{:.2f} % | {:.2f} % | {:.1f} % | {:.1f} % |\n",
          body.model().name, name_of(friction), 1e3 * speed, jumps.hand.size(), per_cent(jumps.hand, 1.0),
          per_cent(jumps.hand, 0.99), per_cent(jumps.hand, 0.5),
          100.0 *
              static_cast<double>(std::count_if(jumps.hand.begin(), jumps.hand.end(),
                                                [](double jump) { return jump > 0.02; })) /
              static_cast<double>(jumps.hand.size()),
          per_cent(jumps.beyond, 1.0), per_cent(jumps.contact, 1.0), per_cent(jumps.contact, 0.99),
          per_cent(jumps.contact, 0.5), 100.0 * jumps.handing_over / static_cast<double>(jumps.hand.size()),
          per_cent(jumps.behind, 0.99));
      std::fflush(stdout);
    }
  }
}

/// The contact problem of a tick, kept: points, normals and compliance, with the device's position that it
/// was made for.
struct FrozenContact {
  ContactProblem problem;
  std::vector<Vec3> directions;  // [rows] in which each row's force acts on the tool
  Vec3 device;

  explicit FrozenContact(const State& state)
      : problem(state.scratch.problem), device(state.tools.front().device.position) {
    for (Index i = 0; i < problem.rows; ++i)
      directions.push_back(state.scratch.rows[static_cast<std::size_t>(i)].force);
  }
};

/// Solves contact problems that another time made.
class StaleSolver {
 public:
  explicit StaleSolver(const State& state)
      : problem_(state.scratch.problem),
        active_set_(state.scratch.problem.stride),
        cone_solver_(state.max_contacts(), state.scratch.problem.stride) {}

  /// Force on the tool with the device where it is now.
  Vec3 force(const FrozenContact& frozen, const Vec3& device) {
    problem_ = frozen.problem;
    for (std::size_t i = 0; i < frozen.directions.size(); ++i)
      problem_.b[i] += frozen.directions[i].dot(device - frozen.device);
    if (problem_.frictionless) {
      active_set_.solve(problem_);
    } else {
      cone_solver_.solve(problem_);
    }
    Vec3 force = Vec3::Zero();
    for (std::size_t i = 0; i < frozen.directions.size(); ++i)
      force += problem_.lambda[i] * frozen.directions[i];
    return force;
  }

 private:
  ContactProblem problem_;
  ActiveSet active_set_;
  ConeSolver cone_solver_;
};

/// Of SOFA's simulation steps (docs/measurements/contact.md), in ticks.
struct Age {
  double milliseconds;
  std::size_t ticks;
};
constexpr std::array<Age, 5> ages = {{{0.0, 0}, {0.6, 1}, {1.7, 2}, {46.0, 46}, {450.0, 450}}};

struct StaleErrors {
  std::array<std::vector<double>, ages.size()> error;  // share of the slide's mean force
  std::array<double, ages.size()> lost{};              // ticks in contact without a stale force
  std::vector<double> time_to_wrong;                   // [s] from freezing to an error of `wrong`
};

constexpr double wrong = 0.1;              // of the mean force
constexpr std::size_t freeze_stride = 20;  // ticks from one freezing to the next

/// Slides and keeps each tick's contact and force.
struct Recorded {
  std::vector<FrozenContact> contacts;
  std::vector<Vec3> force;  // on the tool, the contact's own
  double mean_force = 0.0;  // while sliding [N]
};

Recorded record(const Body& body, State state, const test::Slide& slide) {
  Recorded recorded;
  for (std::size_t k = 0; k < slide.poses.size(); ++k) {
    step(body, state, slide.poses[k]);
    recorded.contacts.emplace_back(state);
    recorded.force.push_back(state.tools.front().contact_wrench.force);
    if (k >= slide.first_slide) recorded.mean_force += recorded.force.back().norm();
  }
  recorded.mean_force /= static_cast<double>(slide.poses.size() - slide.first_slide);
  return recorded;
}

void compare(const test::Slide& slide, const Recorded& recorded, StaleSolver& solver, StaleErrors& errors) {
  const auto stale = [&](std::size_t at, std::size_t age) {
    return solver.force(recorded.contacts[at - age], slide.poses[at].position);
  };
  for (std::size_t k = slide.first_slide; k < slide.poses.size(); ++k) {
    for (std::size_t a = 0; a < ages.size(); ++a) {
      const Vec3 force = stale(k, ages[a].ticks);
      errors.error[a].push_back((force - recorded.force[k]).norm() / recorded.mean_force);
      if (force.norm() == 0.0 && recorded.force[k].norm() > 0.0) errors.lost[a] += 1.0;
    }
  }
  for (std::size_t frozen = slide.first_slide + 100; frozen < slide.poses.size(); frozen += freeze_stride) {
    for (std::size_t at = frozen + 1; at < slide.poses.size(); ++at) {
      if (!((stale(at, at - frozen) - recorded.force[at]).norm() > wrong * recorded.mean_force)) continue;
      errors.time_to_wrong.push_back(test::tick * static_cast<double>(at - frozen));
      break;
    }
  }
}

/// Force along the track's outward direction by contacts of each age.
void write_curves(const std::string& file, const test::Track& track, const test::Slide& slide,
                  const Recorded& recorded, StaleSolver& solver) {
  std::ofstream out(file);
  out << "t,now";
  for (std::size_t a = 1; a < ages.size(); ++a) out << fmt::format(",{:g}", ages[a].milliseconds);
  out << "\n";
  for (std::size_t k = slide.first_slide; k < slide.poses.size(); ++k) {
    out << fmt::format("{:.3f},{:.6g}", test::tick * static_cast<double>(k - slide.first_slide),
                       -recorded.force[k].dot(track.inward));
    for (std::size_t a = 1; a < ages.size(); ++a) {
      const Vec3 force = solver.force(recorded.contacts[k - ages[a].ticks], slide.poses[k].position);
      out << fmt::format(",{:.6g}", -force.dot(track.inward));
    }
    out << "\n";
  }
  if (!out.flush()) throw Error("cannot be written", file, "choose another place");
}

void print_stale(const Body& body, const std::string& file, double radius, double depth) {
  const std::vector<test::Track> tracks = test::lay_tracks(body, radius, track_length, tracks_laid);
  const State start(body, {.tools = {Tool{.radius = radius, .friction = 0.0}}, .max_contacts = 24});
  StaleSolver solver(start);
  fmt::print("{}: {} tracks of {:.0f} mm, sphere of {:.1f} mm, {:.1f} mm deep, frictionless\n\n",
             body.model().name, tracks.size(), 1e3 * track_length, 1e3 * radius, 1e3 * depth);
  fmt::print(
      "| mm/s | contact set | error, median | 99 % | worst | ticks without force "
      "|\n|---|---|---|---|---|---|\n");
  std::string freezing;
  for (const double speed : {0.05, 0.1, 0.2}) {
    StaleErrors errors;
    for (const test::Track& track : tracks) {
      const test::Slide slide = test::slide_along(track, depth, speed);
      const Recorded recorded = record(body, start, slide);
      compare(slide, recorded, solver, errors);
      if (speed == 0.1 && &track == &tracks.front()) write_curves(file, track, slide, recorded, solver);
    }
    for (std::size_t a = 0; a < ages.size(); ++a) {
      fmt::print("| {:.0f} | {:g} ms old | {:.2f} % | {:.1f} % | {:.1f} % | {:.1f} % |\n", 1e3 * speed,
                 ages[a].milliseconds, 100.0 * quantile(errors.error[a], 0.5),
                 100.0 * quantile(errors.error[a], 0.99), 100.0 * quantile(errors.error[a], 1.0),
                 100.0 * errors.lost[a] / static_cast<double>(errors.error[a].size()));
    }
    freezing +=
        fmt::format("| {:.0f} | {:.0f} ms | {:.0f} ms | {:.0f} ms | {} |\n", 1e3 * speed,
                    1e3 * quantile(errors.time_to_wrong, 0.0), 1e3 * quantile(errors.time_to_wrong, 0.1),
                    1e3 * quantile(errors.time_to_wrong, 0.5), errors.time_to_wrong.size());
  }
  fmt::print(
      "\nTime from freezing the contact set to a force that is {:.0f} % wrong:\n\n"
      "| mm/s | soonest | soonest tenth | median | cases |\n|---|---|---|---|---|\n{}",
      100.0 * wrong, freezing);
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  const std::string study = argc > 1 ? argv[1] : "";
  const int first_number = study == "stale" ? 4 : 3;
  if ((study != "jumps" && study != "stale") || argc < first_number || argc > first_number + 2) {
    fmt::print(stderr,
               "usage: sliding_study jumps MODEL.palpate.hdf [RADIUS [DEPTH]]\n"
               "       sliding_study stale MODEL.palpate.hdf OUT.csv [RADIUS [DEPTH]]\n");
    return 2;
  }
  const double radius = argc > first_number ? std::strtod(argv[first_number], nullptr) : 0.005;
  const double depth = argc > first_number + 1 ? std::strtod(argv[first_number + 1], nullptr) : 0.003;
  try {
    const palpate::Body body(palpate::load_model(argv[2]));
    if (study == "jumps") palpate::print_jumps(body, radius, depth);
    if (study == "stale") palpate::print_stale(body, argv[3], radius, depth);
  } catch (const palpate::Error& error) {
    std::fputs(palpate::to_text(error).c_str(), stderr);
    return 1;
  }
}

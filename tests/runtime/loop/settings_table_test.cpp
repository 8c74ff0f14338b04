// The tables of settings and of safety bounds: each member stands in them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>

#include "base/error.h"
#include "runtime/loop/settings.h"
#include "runtime/safety/safety.h"

namespace palpate {
namespace {

/// A value for each setting that is not its default, as it is written.
const SettingsText others = {{"tool", "capsule:0.25,0.5"},
                             {"friction", "0.3"},
                             {"coupling", "250"},
                             {"coupling-torsion", "0.75"},
                             {"max-force", "7.5"},
                             {"hand-over", "inf"},
                             {"reach", "0.125"},
                             {"max-contacts", "7"},
                             {"contact", "dynamic"},
                             {"load-scale", "0"},
                             {"stiffness-scale", "2"},
                             {"overlay", "r=16,rings=16"},
                             {"overlay-law", "neo-hookean"},
                             {"overlay-memory", "64"},
                             {"depth", "yes"},
                             {"rate", "5000"},
                             {"motion-scale", "0.5"},
                             {"force-scale", "4"},
                             {"origin", "1,2,3"},
                             {"axes", "x,-z,y"},
                             {"safety", "max_force=2"},
                             {"solver", "neo-hookean"},
                             {"poissons-ratio", "0.45"},
                             {"live-step", "0.002"},
                             {"integrator", "midpoint"},
                             {"step-solver", "cg"},
                             {"gravity", "0,0,-9.81"},
                             {"mass-damping", "1"},
                             {"stiffness-damping", "0.5"},
                             {"yield", "0.1"},
                             {"creep", "3"},
                             {"most-plastic", "0.4"},
                             {"free", "yes"},
                             {"floor", "-0.1"},
                             {"room", "0,0,0,1,1,2"},
                             {"obstacle", "0,0,0,1,2,1"},
                             {"wall-friction", "0.25"}};

TEST(SettingsTable, HasEachMember) {
  const auto& [tool, reach, contacts, contact, load, stiffness, overlay, law, memory, depth, live, rate,
               motion, force, origin, axes, safety] = Settings{};
  const Settings all = read_settings(others);
  const auto& [tool2, reach2, contacts2, contact2, load2, stiffness2, overlay2, law2, memory2, depth2, live2,
               rate2, motion2, force2, origin2, axes2, safety2] = all;
  EXPECT_NE(reach, reach2);
  EXPECT_NE(contacts, contacts2);
  EXPECT_NE(contact, contact2);
  EXPECT_NE(load, load2);
  EXPECT_NE(stiffness, stiffness2);
  EXPECT_NE(overlay.kind, overlay2.kind);
  EXPECT_NE(law, law2);
  EXPECT_NE(memory, memory2);
  EXPECT_NE(depth, depth2);
  const auto& [solver, poisson, step, integrator, step_solver, gravity, by_mass, by_stiffness, yield, creep,
               most_plastic, free, floor, room, obstacle, wall_friction] = live;
  const auto& [solver2, poisson2, step2, integrator2, step_solver2, gravity2, by_mass2, by_stiffness2, yield2,
               creep2, most_plastic2, free2, floor2, room2, obstacle2, wall_friction2] = live2;
  EXPECT_NE(solver, solver2);
  EXPECT_NE(poisson, poisson2);
  EXPECT_NE(step, step2);
  EXPECT_NE(integrator, integrator2);
  EXPECT_NE(step_solver, step_solver2);
  EXPECT_NE(gravity, gravity2);
  EXPECT_NE(by_mass, by_mass2);
  EXPECT_NE(by_stiffness, by_stiffness2);
  EXPECT_NE(yield, yield2);
  EXPECT_NE(creep, creep2);
  EXPECT_NE(most_plastic, most_plastic2);
  EXPECT_NE(free, free2);
  EXPECT_NE(floor, floor2);
  EXPECT_NE(room, room2);
  EXPECT_NE(obstacle, obstacle2);
  EXPECT_NE(wall_friction, wall_friction2);
  EXPECT_NE(rate, rate2);
  EXPECT_NE(motion, motion2);
  EXPECT_NE(force, force2);
  EXPECT_NE(origin, origin2);
  EXPECT_NE(axes, axes2);
  EXPECT_NE(safety.has_value(), safety2.has_value());
  const auto& [radius, length, disc_radius, coupling, torsion, most, hand_over, unset, friction] = tool;
  const auto& [radius2, length2, disc_radius2, coupling2, torsion2, most2, hand_over2, unset2, friction2] =
      tool2;
  EXPECT_NE(radius, radius2);
  EXPECT_NE(length, length2);
  EXPECT_EQ(disc_radius, disc_radius2) << "no tool has both";
  EXPECT_NE(disc_radius, read_settings({{"tool", "disc:0.25,0.125"}}).tool.disc_radius);
  EXPECT_NE(coupling, coupling2);
  EXPECT_NE(torsion, torsion2);
  EXPECT_NE(most, most2);
  EXPECT_NE(hand_over, hand_over2);
  EXPECT_EQ(unset, unset2) << "the reach is that of the settings";
  EXPECT_NE(friction, friction2);
}

TEST(SettingsTable, TellsEachAsItIsWritten) {
  SettingsText told = split_settings(to_text(read_settings(others)));
  EXPECT_EQ(told.size(), settings_table().size());
  EXPECT_EQ(std::exchange(told["safety"], "max_force=2").substr(0, 12), "max_force=2,");
  EXPECT_EQ(told, others);
  for (const Setting& setting : settings_table()) EXPECT_TRUE(others.contains(setting.name)) << setting.name;
}

TEST(SettingsTable, ReadsADiscAndTellsItToTheLastBit) {
  const Tool disc = read_settings({{"tool", "disc:0.02,0.005"}}).tool;
  EXPECT_EQ(disc.disc_radius, 0.02);
  EXPECT_EQ(disc.radius, 0.005);
  EXPECT_EQ(disc.length, 0.0);
  EXPECT_EQ(parse_shape("disc:0.02").radius, 0.1 * 0.02) << "the usual edge";
  EXPECT_EQ(parse_shape("disc:0.02,0.02").radius, 0.02) << "as round as a sphere";
  for (const char* text : {"disc:0.1,0.03", "disc:0.30000000000000004", "disc:1e-07,3.3e-08"}) {
    const Settings read = read_settings({{"tool", text}});
    const Tool again = read_settings(split_settings(to_text(read))).tool;
    EXPECT_EQ(again.disc_radius, read.tool.disc_radius) << text;
    EXPECT_EQ(again.radius, read.tool.radius) << text;
  }
  const auto problem = [](const char* text) -> std::string {
    try {
      static_cast<void>(parse_shape(text));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  for (const char* text : {"disc:", "disc:0", "disc:0.1,0", "disc:0.1,-0.01", "disc:5mm", "disc:0.1,inf"})
    EXPECT_NE(problem(text).find("is not a positive number of metres"), std::string::npos) << text;
  EXPECT_NE(problem("disc:0.1,0.11").find("rounded by more than the radius"), std::string::npos);
  for (const char* text : {"disc", "disk:0.1", "disc:0.1,0.01,0.01"})
    EXPECT_NE(problem(text).find("is none of"), std::string::npos) << text;
}

TEST(SettingsTable, HasTheDefaults) {
  std::set<std::string> in_words;
  SettingsText defaults;
  for (const Setting& setting : settings_table()) {
    try {
      static_cast<void>(read_settings({{setting.name, setting.otherwise}}));
      defaults[setting.name] = setting.otherwise;
    } catch (const Error&) {
      in_words.insert(setting.name);
    }
  }
  EXPECT_EQ(in_words, (std::set<std::string>{"tool", "friction", "coupling", "coupling-torsion", "max-force",
                                             "reach", "origin", "poissons-ratio", "safety", "solver", "floor",
                                             "room", "obstacle"}));
  Settings read = read_settings(defaults), made;
  read.live.solver = made.live.solver = LiveLaw::corotational;  // else the others of it are not told
  read.overlay = made.overlay = OverlayOptions{.kind = OverlayKind::uniform};  // else its memory is not told
  EXPECT_EQ(to_text(read), to_text(made));
}

TEST(SafetyFields, AreAllMembers) {
  const SafetyOptions options;
  std::set<const void*> members = {&options.period};
  for_each_safety_field(options, [&](const SafetyField&, const auto& number) { members.insert(&number); });
  static_assert(alignof(SafetyOptions) == sizeof(double), "each number takes as much room as a double");
  EXPECT_EQ(members.size() * sizeof(double), sizeof(SafetyOptions)) << "a member is not in the table";
}

TEST(SafetyFields, AreReadInTheirRanges) {
  const auto where = [](const std::string& text) -> std::string {
    try {
      static_cast<void>(parse_safety(text));
    } catch (const Error& error) {
      return error.where();
    }
    return "";
  };
  for_each_safety_field(SafetyOptions{}, [&](const SafetyField& field, const auto& number) {
    const std::string name(field.name);
    EXPECT_EQ(where(name + "=0"), field.range.contains(0.0) ? "" : "--safety") << name;
    EXPECT_EQ(where(name + "=-1"), "--safety") << name;
    EXPECT_EQ(where(name + "=" + fmt::format("{}", number)), "") << name;
  });
  EXPECT_EQ(where("buzz_flips=7.5"), "--safety");
  EXPECT_EQ(where("buzz_flips=1e10"), "--safety");
}

}  // namespace
}  // namespace palpate

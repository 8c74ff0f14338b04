#include "runtime/viewer/page_word.h"

#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>

namespace palpate {
namespace {

using Json = nlohmann::json;

constexpr int deepest = 4;
constexpr double farthest = 1e6;  // [m]
constexpr double quaternion_error = 0.01;
constexpr std::int64_t most_frames = std::int64_t{1} << 53;  // largest exact integer of JavaScript

/// Error in a word; only in here.
struct Problem {
  std::string text;
};

/// Checks that the object has `type`, `members` and no others.
void expect_members(const Json& object, std::initializer_list<const char*> members) {
  for (const char* member : members) {
    if (!object.contains(member)) throw Problem{std::string("has no member ") + member};
  }
  if (object.size() != members.size() + 1) throw Problem{"has a member that it should not have"};
}

bool boolean(const Json& object, const char* member) {
  const Json& value = object.at(member);
  if (!value.is_boolean()) throw Problem{std::string(member) + " is neither true nor false"};
  return value.get<bool>();
}

template <std::size_t count>
Eigen::Matrix<double, static_cast<int>(count), 1> numbers(const Json& object, const char* member) {
  const Json& values = object.at(member);
  if (!values.is_array() || values.size() != count)
    throw Problem{std::string(member) + " is not an array of " + std::to_string(count) + " numbers"};
  Eigen::Matrix<double, static_cast<int>(count), 1> result;
  for (std::size_t k = 0; k < count; ++k) {
    const double x = values[k].is_number() ? values[k].get<double>() : std::nan("");
    if (!(std::abs(x) <= farthest))
      throw Problem{std::string(member) + " has what is not a number or is larger than 1e6"};
    result[static_cast<Eigen::Index>(k)] = x;
  }
  return result;
}

PointerPose pointer(const Json& object) {
  PointerPose wanted;
  wanted.pose.position = numbers<3>(object, "position");
  const Eigen::Vector4d orientation = numbers<4>(object, "orientation");
  if (!(std::abs(orientation.norm() - 1.0) <= quaternion_error))
    throw Problem{"orientation is not a quaternion of length 1"};
  wanted.pose.orientation.coeffs() = orientation.normalized();
  wanted.pose.grab = boolean(object, "grab");
  wanted.lifted = boolean(object, "lifted");
  return wanted;
}

SettingsChange change(const Json& settings) {
  if (!settings.is_object()) throw Problem{"settings is not an object"};
  SettingsChange change;
  for (const auto& [name, value] : settings.items()) {
    if (!value.is_null() && !value.is_string())
      throw Problem{"settings has a value that is neither text nor null"};
    change[name] = value.is_null() ? std::nullopt : std::optional(value.get<std::string>());
  }
  return change;
}

std::int64_t frame_number(const Json& frame) {
  if (!frame.is_number_unsigned() || frame.get<std::uint64_t>() > static_cast<std::uint64_t>(most_frames))
    throw Problem{"frame is not a number of a frame"};
  return frame.get<std::int64_t>();
}

PageWord word_of(const Json& object) {
  if (!object.is_object()) throw Problem{"is not a JSON object"};
  const auto found = object.find("type");
  if (found == object.end() || !found->is_string()) throw Problem{"has no type"};
  PageWord word{.type = found->get<std::string>()};
  const auto is = [&](const char* type, std::initializer_list<const char*> members) {
    if (word.type != type) return false;
    expect_members(object, members);
    return true;
  };
  if (is("point", {"position", "orientation", "grab", "lifted"})) {
    word.ask = [wanted = pointer(object)](ViewedRun& run) { run.point(wanted); };
  } else if (is("change", {"settings"})) {
    word.ask = [settings = change(object["settings"])](ViewedRun& run) { run.change(settings); };
  } else if (is("seek", {"frame"})) {
    word.frame = frame_number(object["frame"]);
    word.ask = [frame = *word.frame](ViewedRun& run) { run.seek(frame); };
  } else if (is("pause", {"paused"})) {
    word.ask = [paused = boolean(object, "paused")](ViewedRun& run) { run.pause(paused); };
  } else if (is("record", {"on"})) {
    word.ask = [on = boolean(object, "on")](ViewedRun& run) { run.record(on); };
  } else if (is("control", {"take"})) {
    word.take = boolean(object, "take");
  } else if (is("step", {})) {
    word.ask = &ViewedRun::step_once;
  } else if (is("reset", {})) {
    word.ask = &ViewedRun::reset;
  } else if (is("acknowledge", {})) {
    word.ask = &ViewedRun::acknowledge;
  } else if (!is("follow", {})) {
    throw Problem{"has a type that is unknown"};
  }
  return word;
}

}  // namespace

std::optional<PageWord> parse_page_word(std::string_view text, std::string& problem) {
  if (text.size() > longest_page_word) {
    problem = "the message is longer than 16 KiB";
    return std::nullopt;
  }
  if (text.find('\0') != std::string_view::npos) {  // the parser would take it for the end
    problem = "the message is not JSON";
    return std::nullopt;
  }
  bool too_deep = false;
  const Json object = Json::parse(
      text,
      [&too_deep](int depth, Json::parse_event_t, Json&) {
        too_deep = too_deep || depth > deepest;
        return !too_deep;
      },
      false);
  if (too_deep || object.is_discarded()) {
    problem = too_deep ? "the message is nested too deep" : "the message is not JSON";
    return std::nullopt;
  }
  try {
    return word_of(object);
  } catch (const Problem& found) {
    problem = "the message " + found.text;
    return std::nullopt;
  }
}

}  // namespace palpate

#include "runtime/viewer/run_words.h"

#include <algorithm>

#include "base/json_text.h"

namespace palpate {
namespace {

using Json = nlohmann::json;

constexpr double highest_rate = 1e5;

}  // namespace

std::string hello_word(const char* mode, std::uint64_t page, bool has_book) {
  return json_text(Json{{"type", "hello"},
                        {"protocol", 2},
                        {"version", PALPATE_VERSION},
                        {"mode", mode},
                        {"id", page},
                        {"book", has_book}});
}

Json error_members(const Error& error) {
  return {{"what", error.what()}, {"where", error.where()}, {"hint", error.hint()}};
}

std::string error_word(const std::string& about, const Error& error) {
  const auto* typed = dynamic_cast<const PageError*>(&error);
  const PageRefusal reason = typed != nullptr ? typed->reason() : PageRefusal::value;
  Json word = error_members(error);
  word["type"] = "error";
  word["about"] = about;
  word["reason"] = page_refusal_names[static_cast<std::size_t>(reason)].second;
  return json_text(word);
}

StateWord::StateWord(const std::string& json) : members_(Json::parse(json, nullptr, false)) {
  if (!members_.is_object())
    throw Error("what the run says of itself is not a JSON object", "viewer", "report this as a bug");
  const auto found = members_.find("times");
  if (found == members_.end()) return;
  times_ = std::move(*found);
  members_.erase(found);
}

double StateWord::rate() const {
  const auto found = members_.find("rate");
  if (found == members_.end() || !found->is_number()) return usual_rate;
  return std::clamp(found->get<double>(), 1.0, highest_rate);
}

std::string StateWord::for_page(std::uint32_t scene, const PageRole& role, const Json& times) const {
  Json state = members_;
  state["type"] = "state";
  state["scene"] = scene;
  state["you"] = role.is_controller ? "controller" : "watcher";
  state["controlled"] = role.controlled;
  state["watchers"] = role.pages;
  state["alone"] = role.own_frame.has_value();
  if (role.own_frame) state["frame"] = *role.own_frame;
  const auto pointer = members_.find("pointer");
  state["pointer"] = role.is_controller && pointer != members_.end() && *pointer == true;
  if (!times.is_null()) state["times"] = times;
  return json_text(state);
}

}  // namespace palpate

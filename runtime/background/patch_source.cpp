#include "runtime/background/patch_source.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace palpate {
namespace {

constexpr std::size_t most_patches = 4096;
constexpr auto request_pause = std::chrono::microseconds(500);
constexpr std::int64_t tangent_stride = 5;  // ticks between tangents, without a builder

}  // namespace

const char* name_of(PatchLaw law) noexcept {
  return law == PatchLaw::linear ? "linear" : "neo-hookean";
}

PatchSource::PatchSource(const Body& body, const State& state, const PatchSourceOptions& options)
    : body_(body),
      options_(options),
      maker_(body, options.rings, options.finest),
      choice_(body, state),
      slots_(most_patches),
      first_slot_(maker_.is_graded() ? body.surface_rest_positions().size()
                                     : static_cast<std::size_t>(body.greens().nodes()),
                  -1),
      next_slot_(most_patches, -1),
      requests_(PatchRequests{}),
      deliveries_(2 * most_patches),
      loads_(PatchLoad(static_cast<std::size_t>(state.surface.near.capacity()))),
      delivered_tangents_(Tangent{}) {
  if (options_.law != PatchLaw::linear) tangents_.emplace(body, maker_);
  for (std::size_t slot = most_patches; slot-- > 0;) free_slots_.push_back(static_cast<Index>(slot));
  if (options_.in_background) builder_ = std::thread([this] { build_wishes(); });
}

PatchSource::~PatchSource() {
  stop_ = true;
  if (builder_.joinable()) builder_.join();
}

void PatchSource::serve(State& state) noexcept {
  choice_.follow(body_, state);
  if (!options_.in_background && !choice_.now().empty()) {
    ++round_;
    build(choice_.now());
  }
  requests_.next() = choice_.requests();
  requests_.publish();
  receive();
  const PatchKey& wanted = choice_.now();
  post_load(state, wanted);
  state.surface.patch_is_older = false;
  if (!take_tangent(state, wanted) && !wanted.empty())
    state.surface.patch_is_older = !take_linear(state, wanted);
  if (!wanted.empty()) count(state);
}

/// Posts the forces of the last tick to the builder; without one, does its work.
void PatchSource::post_load(const State& state, const PatchKey& wanted) noexcept {
  if (!tangents_) return;
  PatchLoad& load = loads_.next();
  load.clear();
  load.key = wanted.empty() ? used_ : wanted;
  const NearField& near = state.surface.near;
  load.by = near.patch().get();
  for (Index place = 0; place < near.count(); ++place) {
    const Vec3 force = near.force(place);
    if (!force.isZero(0.0)) load.add(near.node(place), force);
  }
  const bool is_due = state.ticks % tangent_stride == 0 || !(load.key == tangents_->key());
  if (!options_.in_background && is_due) follow_load(load);
  loads_.publish();
}

/// Uses the latest patch from a tangent, even of another place, until there is one for this place.
bool PatchSource::take_tangent(State& state, const PatchKey& wanted) noexcept {
  if (!tangents_) return false;
  std::shared_ptr<const Patch>& patch = state.surface.patch;
  const Tangent& tangent = delivered_tangents_.read();
  if (tangent.patch == nullptr) {  // the last one is for forces that have ended
    if (patch == nullptr || !patch->has_offset()) return false;
    const std::shared_ptr<const Patch>* linear = find(used_);
    patch = linear != nullptr ? *linear : nullptr;
    return false;
  }
  if (patch != tangent.patch) {
    if (patch != nullptr && !(used_ == tangent.key)) ++counts_.switches;
    patch = tangent.patch;
    used_ = tangent.key;
  }
  state.surface.patch_is_older = !wanted.empty() && !(wanted == used_);
  return true;
}

/// Sets the requested linear patch. False if it is not available.
bool PatchSource::take_linear(State& state, const PatchKey& wanted) noexcept {
  if (wanted == used_ && state.surface.patch != nullptr) return true;
  const std::shared_ptr<const Patch>* patch = find(wanted);
  if (patch == nullptr) return false;
  if (state.surface.patch != nullptr) ++counts_.switches;
  state.surface.patch = *patch;
  used_ = wanted;
  return true;
}

void PatchSource::serve(State& state, Index centre, bool older) noexcept {
  if (centre < 0) {
    state.surface.patch_is_older = older;
    return;
  }
  PatchKey key;
  key.add(centre);
  ++round_;
  build(key);
  receive();
  post_load(state, key);
  if (!take_tangent(state, key)) static_cast<void>(take_linear(state, key));
  state.surface.patch_is_older = older;
  count(state);
}

void PatchSource::count(const State& state) noexcept {
  const bool touches = std::any_of(state.tools.begin(), state.tools.end(),
                                   [](const ToolState& tool) { return tool.contacts > 0; });
  ++counts_.ticks;
  counts_.older += state.surface.patch_is_older ? 1 : 0;
  counts_.in_contact += touches ? 1 : 0;
  counts_.older_in_contact += touches && state.surface.patch_is_older ? 1 : 0;
}

void PatchSource::receive() noexcept {
  Delivery delivery;
  while (deliveries_.pop(delivery)) {
    Delivery& slot = slots_[delivery.slot];
    if (slot.patch != nullptr) unlink(delivery.slot);
    slot = std::move(delivery);
    if (slot.patch == nullptr) continue;
    Index& first = first_slot_[slot.key.centres[0]];
    next_slot_[slot.slot] = first;
    first = slot.slot;
  }
}

void PatchSource::unlink(Index slot) noexcept {
  Index* link = &first_slot_[slots_[slot].key.centres[0]];
  while (*link != slot) link = &next_slot_[*link];
  *link = next_slot_[slot];
}

const std::shared_ptr<const Patch>* PatchSource::find(const PatchKey& key) const noexcept {
  for (Index slot = first_slot_[key.centres[0]]; slot >= 0; slot = next_slot_[slot]) {
    const Delivery& at = slots_[slot];
    if (at.key == key) return &at.patch;
  }
  return nullptr;
}

void PatchSource::build_wishes() {
  while (!stop_) {
    ++round_;
    const PatchRequests& requests = requests_.read();
    if (tangents_ && (requests.count == 0 || !build(requests.keys[0])) && follow_load(loads_.read()))
      continue;
    if (!build_next(requests)) std::this_thread::sleep_for(request_pause);
  }
}

/// Builds requested patches first, then those in the file, then, while there is memory, patches around the
/// first centre, in the direction of the tool first.
bool PatchSource::build_next(const PatchRequests& requests) {
  const std::size_t usual = kept_.empty() ? 0 : bytes_ / kept_.size();
  std::size_t wanted = 0;  // bytes of the requests so far: later ones must not displace them
  for (std::size_t k = 0; k < requests.count && (k == 0 || wanted + usual <= options_.memory); ++k) {
    if (build(requests.keys[k])) return true;
    const std::shared_ptr<const Patch>& patch = kept_.at(requests.keys[k]).patch;
    if (patch != nullptr) wanted += patch->bytes();
  }
  if (build_stored()) return true;
  if (bytes_ + 2 * usual > options_.memory) return false;
  if (requests.count == 0 || requests.keys[0].count() != 1) return false;
  const Index centre = requests.keys[0].centres[0];
  std::vector<Index> neighbours = maker_.neighbours(centre);
  const auto along = [&](Index node) {
    return (body_.rest_position(node) - body_.rest_position(centre)).dot(requests.direction);
  };
  std::sort(neighbours.begin(), neighbours.end(),
            [&](Index a, Index b) { return along(a) != along(b) ? along(a) > along(b) : a < b; });
  for (const Index neighbour : neighbours) {
    PatchKey key;
    key.add(neighbour);
    if (build(key)) return true;
  }
  return false;
}

/// Loads the next patch of the file, in order, as long as there is memory.
bool PatchSource::build_stored() {
  const StoredOverlay& overlay = body_.model().overlay;
  while (next_stored_ < overlay.centres.size()) {
    const Index centre = body_.stored_node(overlay.centres[next_stored_]);
    const CondensedPatch* condensed = centre >= 0 ? maker_.stored(centre) : nullptr;
    if (condensed == nullptr || free_slots_.empty() || bytes_ + bytes_of(*condensed) > options_.memory) {
      next_stored_ = overlay.centres.size();
      break;
    }
    ++next_stored_;
    PatchKey key;
    key.add(centre);
    if (build(key)) return true;
  }
  return false;
}

bool PatchSource::build(const PatchKey& key) {
  std::erase_if(retired_, [](const auto& patch) { return patch.use_count() == 1; });
  const auto found = kept_.find(key);
  if (found != kept_.end()) {
    found->second.wanted = round_;
    return false;
  }
  const auto begin = std::chrono::steady_clock::now();
  std::shared_ptr<const Patch> patch;
  try {
    patch = maker_.make({key.centres.data(), static_cast<std::size_t>(key.count())});
  } catch (const std::exception&) {
    ++failed_;  // not retried; the tick continues without it
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  longest_build_ = std::max<double>(longest_build_, took.count());
  Kept& kept = kept_[key];
  kept.wanted = round_;
  if (patch == nullptr) return true;
  ++built_;
  bytes_ += patch->bytes();
  make_room();
  kept.slot = free_slots_.back();
  free_slots_.pop_back();
  kept.patch = patch;
  deliver({kept.slot, key, std::move(patch)});
  return true;
}

/// Continues with the tangent patch under a load. False if there is nothing to do.
bool PatchSource::follow_load(const PatchLoad& load) noexcept {
  if (!tangents_->follow(load)) return false;
  Tangent& next = delivered_tangents_.next();
  next.key = tangents_->key();
  next.patch = tangents_->patch();
  delivered_tangents_.publish();
  return true;
}

/// Removes the patches that have not been wanted for longest until the rest is within the budget. A later
/// `build` frees them, once the tick and all displays have released them too.
void PatchSource::make_room() {
  while (bytes_ > options_.memory || free_slots_.empty()) {
    auto oldest = kept_.end();
    for (auto it = kept_.begin(); it != kept_.end(); ++it) {
      if (it->second.slot < 0 || it->second.wanted == round_) continue;
      if (oldest == kept_.end() || it->second.wanted < oldest->second.wanted) oldest = it;
    }
    if (oldest == kept_.end()) return;
    bytes_ -= oldest->second.patch->bytes();
    free_slots_.push_back(oldest->second.slot);
    deliver({oldest->second.slot, oldest->first, nullptr});
    retired_.push_back(std::move(oldest->second.patch));
    kept_.erase(oldest);
  }
}

void PatchSource::deliver(Delivery delivery) {
  while (!deliveries_.push(delivery) && !stop_) std::this_thread::sleep_for(request_pause);
}

}  // namespace palpate

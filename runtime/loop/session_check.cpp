#include "runtime/loop/session_check.h"

#include <fmt/core.h>

#include <cstdint>

#include "base/error.h"
#include "runtime/body/patch_maker.h"
#include "runtime/core/tick/status.h"
#include "runtime/safety/device.h"
#include "runtime/safety/fault.h"

namespace palpate {
namespace {

constexpr auto all_events =
    static_cast<unsigned>(DeviceEvent::opened_again | DeviceEvent::lost | DeviceEvent::acknowledged |
                          DeviceEvent::input_lost | DeviceEvent::lifted | DeviceEvent::resumed);

std::uint32_t all_status_bits() {
  std::uint32_t bits = 0;
  for (const auto& [bit, name] : status_names) bits |= static_cast<std::uint32_t>(bit);
  return bits;
}

}  // namespace

void check_session(const RecordingFile& session) {
  const std::uint32_t status_bits = all_status_bits();
  for (std::int64_t k = 0; k < session.ticks(); ++k) {
    const TickRecord tick = session.tick(k);
    const auto expect = [&](bool known, const char* name, std::uint32_t value, const char* kind) {
      if (known) return;
      throw Error(fmt::format("/tool/0/tick, row {}: {} is {}, which is no {}", k, name, value, kind),
                  session.path().string(),
                  "copy the file again; if it is whole, read it with the version that made it: " +
                      session.generator());
    };
    expect(tick.phase < safety_phase_names.size(), "phase", tick.phase, "phase of safety");
    expect(tick.fault < fault_names.size(), "fault", tick.fault, "fault");
    expect((tick.event & ~all_events) == 0, "event", tick.event, "set of events");
    expect((tick.status & ~status_bits) == 0, "status", tick.status, "set of status bits");
  }
}

RecordingFile open_session(const std::filesystem::path& path) {
  RecordingFile session(path);
  check_session(session);
  return session;
}

void check_overlays(const RecordingFile& session, const Body& body) {
  const auto nodes = static_cast<std::int64_t>(body.model().mesh.nodes.size());
  for (std::int64_t k = 0; k < session.ticks(); ++k) {
    const Index node = session.tick(k).patch;
    if (node < 0) continue;
    if (centre_of_record(body, node) >= 0) continue;
    throw Error(
        fmt::format("/tool/0/tick, row {}: patch is {}, which is no node that an overlay can lie round: "
                    "the body has {} nodes",
                    k, node, nodes),
        session.path().string(),
        "replay it with the model that it was recorded with: " + session.info().model_path);
  }
}

}  // namespace palpate
